#include "engine/core/say.h"

#include <cerrno>
#include <string>
#include <system_error>

#include "engine/core/error.h"
#include "engine/core/shown.h"

namespace ballot {
namespace {

[[noreturn]] void cannot_say() {
  fail(Failure::Work, "cannot write standard output: {}", std::generic_category().message(errno));
}

}  // namespace

void say_text(std::FILE* to, std::string_view text) {
  const std::string clean = shown(text);
  if (std::fwrite(clean.data(), 1, clean.size(), to) != clean.size() && to == stdout) cannot_say();
}

void flush_text() {
  errno = EIO;
  if (std::ferror(stdout) != 0 || std::fflush(stdout) != 0) cannot_say();
}

}  // namespace ballot
