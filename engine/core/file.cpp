#include "engine/core/file.h"

#include <fcntl.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <optional>
#include <string>
#include <utility>

#include "engine/core/descriptor.h"
#include "engine/core/error.h"
#include "engine/core/file_id.h"
#include "engine/core/memory.h"
#include "engine/core/standard_output.h"
#include "engine/core/temporary.h"

namespace ballot {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void cannot_read(const fs::path& path, const std::string& reason) {
  const bool absent = !fs::exists(path);
  fail(Failure::Work, "cannot read {}: {}{}", path.string(), reason, absent ? "; check the path" : "");
}

// The place to which the bytes for a path go.
struct Target {
  fs::path file;               // the file to rename to; links are followed if Links::Follow
  bool in_place = false;       // a device, a pipe or an open descriptor that is written to, not replaced
  std::optional<mode_t> mode;  // mode of the file that is replaced
};

fs::path follow_links(const fs::path& path) {
  fs::path file = path;
  std::error_code ignored;
  for (int links = 0; fs::is_symlink(fs::symlink_status(file, ignored)); ++links) {
    if (links == 40) cannot_write(path, errno_text(ELOOP));
    std::error_code code;
    const fs::path next = fs::read_symlink(file, code);
    if (code) cannot_write(path, code.message());
    file = next.is_absolute() ? next : file.parent_path() / next;
  }
  return file;
}

/// Throws unless the folder of a file is there. Errors name `path`.
void expect_folder(const fs::path& file, const fs::path& path) {
  if (!file.has_filename()) cannot_write(path, "it names a folder");
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  struct stat info {};
  if (::stat(folder.c_str(), &info) != 0) {
    if (errno == ENOENT) cannot_write(path, "there is no folder " + folder.string());
    cannot_write(path, errno_text(errno));
  }
  if (!S_ISDIR(info.st_mode)) cannot_write(path, folder.string() + " is not a folder");
}

Target find_target(const fs::path& path, Links links) {
  if (path.empty()) cannot_write(path, "the name is empty");
  std::error_code ignored;
  const fs::file_status there = fs::symlink_status(path, ignored);
  if (links == Links::Replace && fs::exists(there) && !fs::is_regular_file(there) && !fs::is_directory(there)) {
    expect_folder(path, path);
    return {path, false, std::nullopt};
  }
  Target target{path, false, std::nullopt};
  if (const std::optional<int> fd = descriptor_of(path)) {
    const int flags = ::fcntl(data_descriptor(*fd), F_GETFL);
    if (flags < 0 || (flags & O_ACCMODE) == O_RDONLY) cannot_write(path, errno_text(EBADF));
    target.in_place = true;
    return target;
  }
  struct stat info {};
  if (::stat(path.c_str(), &info) == 0) {
    if (S_ISDIR(info.st_mode)) cannot_write(path, "it is a folder");
    if (::faccessat(AT_FDCWD, path.c_str(), W_OK, AT_EACCESS) != 0) cannot_write(path, errno_text(errno));
    if (!S_ISREG(info.st_mode)) {
      target.in_place = true;
      return target;
    }
    target.mode = info.st_mode & 0777;
  } else if (errno != ENOENT) {
    cannot_write(path, errno_text(errno));
  }
  target.file = follow_links(path);
  expect_folder(target.file, path);
  return target;
}

/// Returns the folder of a target's temporary file.
fs::path folder_for_temporary(const Target& target, const fs::path& path) {
  if (target.in_place) {
    std::error_code code;
    const fs::path folder = fs::temp_directory_path(code);
    if (code) cannot_write(path, "there is no folder for temporary files; set TMPDIR to one");
    return folder;
  }
  return target.file.has_parent_path() ? target.file.parent_path() : fs::path(".");
}

void write_all(int fd, std::span<const std::byte> bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(fd, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) cannot_write(path, errno_text(errno));
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
}

Temporary make_temporary(const Target& target, const fs::path& path) {
  const fs::path folder = folder_for_temporary(target, path);
  Descriptor opened(::open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
  if (opened.get() < 0) cannot_write(path, errno_text(errno));
  return {std::move(opened), folder, target.mode, path};
}

std::vector<std::byte> read_all(int fd, const fs::path& path, std::size_t expected) {
  // One byte more than the size lets the loop see the end of the file without growing the buffer. Pipes and files of
  // /proc report the size 0, so their buffer grows.
  need_memory(expected, path.string());
  std::vector<std::byte> bytes(expected + 1);
  std::size_t used = 0;
  for (;;) {
    if (used == bytes.size()) {
      need_memory(2 * bytes.size(), path.string());
      bytes.resize(std::max<std::size_t>(2 * bytes.size(), 65536));
    }
    const ssize_t count = ::read(fd, bytes.data() + used, bytes.size() - used);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) cannot_read(path, errno_text(errno));
    if (count == 0) break;
    used += static_cast<std::size_t>(count);
  }
  bytes.resize(used);
  return bytes;
}

/// Copies a temporary file to a device, a pipe or an open stream.
void copy_into(int from, const fs::path& path) {
  const off_t size = ::lseek(from, 0, SEEK_END);
  if (size < 0 || ::lseek(from, 0, SEEK_SET) != 0) cannot_write(path, errno_text(errno));
  const std::vector<std::byte> bytes = read_all(from, path, static_cast<std::size_t>(size));
  if (const std::optional<int> stream = descriptor_of(path)) return write_all(data_descriptor(*stream), bytes, path);
  Descriptor fd(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
  if (fd.get() < 0) cannot_write(path, errno_text(errno));
  write_all(fd.get(), bytes, path);
  if (::close(fd.release()) != 0 && errno != EINTR) cannot_write(path, errno_text(errno));
}

/// Opens a file for reading. O_NONBLOCK lets the open of a pipe return even if nobody writes to it.
Descriptor open_to_read(const fs::path& path, struct stat& info) {
  Descriptor fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (fd.get() < 0) cannot_read(path, errno_text(errno));
  if (::fstat(fd.get(), &info) != 0) cannot_read(path, errno_text(errno));
  note_file_read(info);
  return fd;
}

const char* kind_of(mode_t mode) {
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

void expect_regular(const fs::path& path, mode_t mode) {
  if (S_ISDIR(mode)) cannot_read(path, "it is a folder");
  if (!S_ISREG(mode)) cannot_read(path, fmt::format("it is {}; expected a regular file", kind_of(mode)));
}

}  // namespace

std::vector<std::byte> read_file(const fs::path& path) {
  struct stat info {};
  const Descriptor fd = open_to_read(path, info);
  expect_regular(path, info.st_mode);
  return read_all(fd.get(), path, static_cast<std::size_t>(info.st_size));
}

std::vector<std::byte> read_argument(const fs::path& path) {
  struct stat info {};
  const Descriptor fd = open_to_read(path, info);
  const bool open_pipe = descriptor_of(path) && (S_ISFIFO(info.st_mode) || S_ISSOCK(info.st_mode));
  if (!open_pipe) expect_regular(path, info.st_mode);
  if (open_pipe && ::fcntl(fd.get(), F_SETFL, 0) != 0) cannot_read(path, errno_text(errno));  // wait for the writer
  return read_all(fd.get(), path, static_cast<std::size_t>(info.st_size));
}

InputStream open_file(const fs::path& path) {
  struct stat info {};
  Descriptor fd = open_to_read(path, info);
  expect_regular(path, info.st_mode);
  InputStream stream(::fdopen(fd.get(), "rb"), &std::fclose);
  if (!stream) cannot_read(path, errno_text(errno));
  fd.release();
  return stream;
}

void write_atomically(const fs::path& path, const std::function<void(OutputFile& out)>& write, Links links) {
  const Target target = find_target(path, links);
  Temporary temporary = make_temporary(target, path);
  OutputFile out(temporary.descriptor(), path);
  write(out);
  out.close();
  if (target.in_place) {
    copy_into(temporary.descriptor(), path);
  } else {
    temporary.rename_to(target.file.filename());
  }
}

void write_file(const fs::path& path, std::span<const std::byte> bytes, Links links) {
  write_atomically(
      path, [&](OutputFile& out) { out.write(bytes.data(), bytes.size()); }, links);
}

void write_file(const fs::path& path, std::string_view text, Links links) {
  write_file(path, std::as_bytes(std::span(text)), links);
}

void write_stream(int descriptor, std::span<const std::byte> bytes) {
  write_all(data_descriptor(descriptor), bytes, descriptor == STDOUT_FILENO ? "standard output" : "the stream");
}

void check_writable(const fs::path& path) {
  const Target target = find_target(path, Links::Follow);
  make_temporary(target, path);
}

fs::path program_file() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  return error ? fs::path() : program;
}

bool program_lies_in(const fs::path& folder) {
  const fs::path inside = program_file().lexically_relative(folder);
  return !inside.empty() && *inside.begin() != "..";
}

fs::path cache_folder() {
  // The XDG base directory specification says to ignore a relative path.
  const char* xdg = std::getenv("XDG_CACHE_HOME");
  if (xdg && fs::path(xdg).is_absolute()) return fs::path(xdg) / "ballot";
  const char* home = std::getenv("HOME");
  if (!home || !*home) {
    static const std::string of_user = [] {
      const passwd* user = ::getpwuid(::getuid());
      return std::string(user && user->pw_dir ? user->pw_dir : "");
    }();
    home = of_user.c_str();
  }
  if (!home || !*home) fail(Failure::Work, "no folder for the cache: set XDG_CACHE_HOME or HOME");
  return fs::path(home) / ".cache" / "ballot";
}

OutputFile::OutputFile(int descriptor, fs::path path) : path_(std::move(path)), file_(nullptr) {
  Descriptor copy(::fcntl(descriptor, F_DUPFD_CLOEXEC, 0));
  if (copy.get() >= 0) file_ = ::fdopen(copy.get(), "wb");
  if (!file_) cannot_write(path_, errno_text(errno));
  copy.release();
}

OutputFile::~OutputFile() {
  if (file_) std::fclose(file_);
}

void OutputFile::failed() {
  if (error_ == 0) error_ = errno ? errno : EIO;
  cannot_write(path_, errno_text(error_));
}

void OutputFile::write(const void* bytes, std::size_t count) {
  if (count > 0 && std::fwrite(bytes, 1, count, file_) != count) failed();
}

void OutputFile::seek(std::uint64_t position) {
  if (::fseeko(file_, static_cast<off_t>(position), SEEK_SET) != 0) failed();
}

std::uint64_t OutputFile::tell() {
  const off_t position = ::ftello(file_);
  if (position < 0) failed();
  return static_cast<std::uint64_t>(position);
}

void OutputFile::close() {
  errno = 0;
  const bool broken = error_ != 0 || std::ferror(file_) != 0;
  const bool closed = std::fclose(std::exchange(file_, nullptr)) == 0;
  if (broken || !closed) failed();
}

}  // namespace ballot
