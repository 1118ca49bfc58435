// Files that appear whole or not at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

namespace ballot {

/// Whole file as bytes. Throws Error(Work) "cannot read PATH: reason"; a folder is an error too.
std::vector<std::byte> read_file(const std::filesystem::path& path);

/// Calls write(temporary path in the same folder), then renames it to `path`; on any exception the temporary is
/// removed and `path` is left as it was. A link is followed: what it points to is replaced, the link stays. A device or
/// a pipe (/dev/stdout) cannot be renamed to: it gets the bytes of a temporary in the system's temporary folder.
/// Throws Error(Work) "cannot write PATH: reason", as when the folder is missing or not writable. Thread-safe; of
/// several writers of one path the last one wins.
void write_atomically(const std::filesystem::path& path,
                      const std::function<void(const std::filesystem::path& temporary)>& write);
void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes);  // atomically
void write_file(const std::filesystem::path& path, std::string_view text);             // atomically

/// Checks, before long work begins, that `path` could be written; leaves nothing behind and does not touch what is
/// there. Throws as write_atomically.
void check_writable(const std::filesystem::path& path);

/// $XDG_CACHE_HOME/ballot or ~/.cache/ballot; created on first use by whoever writes. Never the source tree.
/// Throws Error(Work) if neither is known.
std::filesystem::path cache_folder();

/// The stream that a writer inside write_atomically fills: no failure, such as a full disk, goes unnoticed.
class OutputFile {
 public:
  /// Empties and opens `temporary`. Errors name `path`, the file that the user asked for. Throws Error(Work).
  OutputFile(const std::filesystem::path& temporary, std::filesystem::path path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(const void* bytes, std::size_t count);  // throws Error(Work)
  void seek(std::uint64_t position);                 // throws Error(Work)
  std::uint64_t tell();                              // throws Error(Work)
  void close();                                      // throws Error(Work) if this or anything before failed
  std::FILE* stream() { return file_; }

 private:
  [[noreturn]] void failed();

  std::filesystem::path path_;
  std::FILE* file_;
  int error_ = 0;  // the first errno
};

}  // namespace ballot
