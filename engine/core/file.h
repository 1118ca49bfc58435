// Reading files, and writing them so that they appear whole or not at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace ballot {

/// Returns the whole file as bytes. Only a regular file is read, so that a name in a file from elsewhere cannot make
/// the program wait for a pipe or read a device without end. Throws Error(Work) "cannot read PATH: reason".
std::vector<std::byte> read_file(const std::filesystem::path& path);

/// Reads a file that the user names. As read_file(), but an open pipe is read too: /dev/stdin, or a shell's <(command).
std::vector<std::byte> read_argument(const std::filesystem::path& path);

/// Opens a regular file for reading. Throws as read_file().
using InputStream = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;
InputStream open_file(const std::filesystem::path& path);

/// What becomes of a symbolic link at a path that is written. Replace is for files that the user did not name, beside
/// an output: a link there may be another's, and must not lead the bytes elsewhere.
enum class Links { Follow, Replace };

class OutputFile;

/// Calls write(out) with a temporary file in the same folder, closes it and renames it to `path`. On any exception the
/// temporary is removed and `path` is unchanged.
///
/// A symbolic link is followed: its target is replaced and the link stays. A device, a pipe or an open stream, such as
/// /dev/stdout, is written to in place: the bytes go to a temporary in the system's temporary folder and are then
/// copied, to where a stream stands, so appending works (standard_output.h). A copy that fails leaves a part. With
/// Links::Replace a link, a device or a pipe is itself replaced.
/// Throws Error(Work) "cannot write PATH: reason", for example if the folder is missing or not writable.
/// Thread-safe. If several threads or processes write one path, the last one wins.
void write_atomically(const std::filesystem::path& path, const std::function<void(OutputFile& out)>& write,
                      Links links = Links::Follow);
/// Writes bytes or a text in this way.
void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes, Links links = Links::Follow);
void write_file(const std::filesystem::path& path, std::string_view text, Links links = Links::Follow);

/// Writes bytes to an open stream, as descriptor_of() gives it. Throws Error(Work).
void write_stream(int descriptor, std::span<const std::byte> bytes);

/// Checks that `path` can be written, for use before long work begins. Leaves nothing behind and does not change an
/// existing file. Throws as write_atomically does.
void check_writable(const std::filesystem::path& path);

/// Returns the path of the running program; "" if the system does not tell.
std::filesystem::path program_file();
/// Returns true if the running program lies below a folder. Files of the source tree are looked for at the place that
/// they had when the program was built in this case alone: elsewhere another user may have put files at that place.
bool program_lies_in(const std::filesystem::path& folder);

/// Returns $XDG_CACHE_HOME/ballot, or ~/.cache/ballot if that is not set or relative. Does not create the folder; the
/// first writer does.
/// Throws Error(Work) if neither is known.
std::filesystem::path cache_folder();

/// The output stream of a writer, as write_atomically() gives it. close() reports every failure before it, such as a
/// full disk.
class OutputFile {
 public:
  /// Writes to a copy of an open descriptor. Error messages name `path`, the file that the user asked for. Throws
  /// Error(Work).
  OutputFile(int descriptor, std::filesystem::path path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(const void* bytes, std::size_t count);  // throws Error(Work)
  void seek(std::uint64_t position);                 // throws Error(Work)
  std::uint64_t tell();                              // throws Error(Work)
  void close();                                      // throws Error(Work) if closing or an earlier call failed
  std::FILE* stream() { return file_; }

 private:
  [[noreturn]] void failed();

  std::filesystem::path path_;
  std::FILE* file_;
  int error_ = 0;  // errno of the first failure
};

}  // namespace ballot
