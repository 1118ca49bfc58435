#include "engine/core/failure_text.h"

#include <algorithm>
#include <filesystem>
#include <new>
#include <system_error>

namespace ballot {

namespace {

FailureText no_memory() { return {Failure::Work, true, "out of memory; use a smaller scene or fewer rays at a time"}; }

}  // namespace

FailureText failure_text() {
  FailureText failure;
  try {
    throw;
  } catch (const Error& e) {
    failure = {e.kind(), false, e.what()};
  } catch (const std::bad_alloc&) {
    failure = no_memory();
  } catch (const std::length_error&) {  // more than a container can hold
    failure = no_memory();
  } catch (const std::filesystem::filesystem_error& e) {
    failure.text = fmt::format("cannot use {}: {}", e.path1().empty() ? "a file or folder" : e.path1().string(),
                               e.code().message());
  } catch (const std::system_error&) {
    failure.text = "the system refused a thread; raise the limits of ulimit -v and -u";
  } catch (...) {  // the text names a function of a library, and nothing of the user's
    failure.text =
        "a fault inside Ballot stopped the work; please report it with this call or command line and the files that it "
        "names";
  }
  return failure;
}

}  // namespace ballot
