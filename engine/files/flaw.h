// What is wrong with a file, as its reader tells it, which need not know the path. Internal to engine/files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/memory.h"

namespace ballot {

/// What is wrong with a file. naming() adds the file's path.
class Flaw : public Error {
 public:
  /// `line`: its number in the file; 0: none is told.
  explicit Flaw(const std::string& text, std::size_t line = 0) : Error(Failure::Work, text), line_(line) {}
  std::size_t line() const { return line_; }

 private:
  std::size_t line_;
};

/// Throws Flaw with a formatted text.
template <class... Args>
[[noreturn]] void refuse(fmt::format_string<Args...> text, Args&&... args) {
  throw Flaw(fmt::format(text, std::forward<Args>(args)...));
}

/// need_memory() for what a file holds. Throws Flaw.
inline void need_memory_for(std::uint64_t bytes, std::string_view what) {
  try {
    need_memory(bytes, what);
  } catch (const Error& e) {
    throw Flaw(e.what());
  }
}

/// Returns what read() returns. Makes Error(Work) "PATH: text", or "PATH:LINE: text", of a Flaw.
template <class Read>
auto naming(const std::filesystem::path& path, const Read& read) {
  try {
    return read();
  } catch (const Flaw& flaw) {
    const std::string line = flaw.line() ? fmt::format(":{}", flaw.line()) : "";
    throw Error(flaw.kind(), path.string() + line + ": " + flaw.what());
  }
}

}  // namespace ballot
