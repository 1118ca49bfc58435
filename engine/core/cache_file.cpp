#include "engine/core/cache_file.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <mutex>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/memory.h"
#include "engine/core/say.h"
#include "engine/core/temporary.h"

namespace ballot {
namespace {

namespace fs = std::filesystem;

constexpr int kFolder = O_PATH | O_DIRECTORY | O_CLOEXEC;
constexpr const char* kMesaFolder = "mesa_shader_cache";  // the name that Mesa gives its folder
constexpr const char* kMesaVariable = "MESA_SHADER_CACHE_DIR";
constexpr const char* kMesaOff = "MESA_SHADER_CACHE_DISABLE";
constexpr const char* kOpenFiles = "/proc/self/fd/";
constexpr off_t kMesaIndex = 8 + 20 * 65536;  // bytes of the file that Mesa maps: a size, and 2^16 keys of 20 bytes

/// A folder that is not used. Its text says which and why.
struct Refusal {
  std::string text;
  bool of_driver = false;  // for Mesa's cache alone
};

/// Prints that there is no cache, once in the life of a process.
void say_no_cache(const std::string& reason) {
  static std::once_flag once;
  std::call_once(once, [&] { say_aside("ballot: no cache: {}\n", reason); });
}

/// Throws Refusal if the error is that this user cannot write there.
void expect_writable(int code, const fs::path& path) {
  if (code == EROFS || code == EACCES || code == EPERM)
    throw Refusal{fmt::format("{} cannot be written: {}; name a folder of your own in XDG_CACHE_HOME", path.string(),
                              errno_text(code))};
}

/// Throws Refusal unless a folder belongs to this user and cannot be written by others.
void expect_own(const struct stat& info, const fs::path& path) {
  if (info.st_uid != ::geteuid())
    throw Refusal{fmt::format("{} belongs to user {}, not to {}; name a folder of your own in XDG_CACHE_HOME",
                              path.string(), info.st_uid, ::geteuid())};
  if ((info.st_mode & (S_IWGRP | S_IWOTH)) != 0)
    throw Refusal{fmt::format("{} can be written by others (mode {:o}); chmod go-w it if you trust what it holds",
                              path.string(), info.st_mode & 07777)};
}

/// The same for the folder that the environment names. It may be root's too, such as /tmp, and others may write there.
void expect_own_start(struct stat info, const fs::path& path) {
  info.st_mode = 0;
  if (info.st_uid != 0) expect_own(info, path);
}

/// Makes a folder and those above it that are missing, but only below a folder of this user or of root. Returns false
/// if that fails.
bool make_folders(const fs::path& folder) {
  struct stat info {};
  const fs::path here = folder.empty() ? fs::path(".") : folder;
  if (::stat(here.c_str(), &info) == 0) {
    expect_own_start(info, here);
    return true;
  }
  if (errno != ENOENT || !make_folders(folder.parent_path())) return false;
  if (::mkdir(folder.c_str(), 0700) == 0 || errno == EEXIST) return true;
  expect_writable(errno, folder);
  return false;
}

/// A folder as the environment names it, and the folders below it that lead to another.
struct Way {
  fs::path start;
  std::vector<fs::path> below;
};

/// Returns the way to a folder of a cache: from the folder that holds cache_folder(), or else from the one above.
Way way_to(const fs::path& folder) {
  try {
    const fs::path top = cache_folder(), inside = folder.lexically_relative(top.parent_path());
    if (!inside.empty() && *inside.begin() == top.filename())
      return {top.parent_path(), {inside.begin(), inside.end()}};
  } catch (const Error&) {
    // No folder is known for caches, so this is another.
  }
  return {folder.parent_path(), {folder.filename()}};
}

/// Opens a folder in another, and makes it before if `make` is set. Returns no descriptor, and sets errno, if it is
/// missing. Throws Refusal. `path` names it there.
Descriptor open_below(const Descriptor& at, const fs::path& path, bool make) {
  const std::string name = path.filename().string();
  if (make && ::mkdirat(at.get(), name.c_str(), 0700) != 0 && errno != EEXIST) {
    expect_writable(errno, path);
    return Descriptor(-1);
  }
  Descriptor next(::openat(at.get(), name.c_str(), kFolder | O_NOFOLLOW));
  struct stat info {};
  if (next.get() < 0 && (errno == ELOOP || errno == ENOTDIR))
    throw Refusal{path.string() + " is a link or no folder; remove it"};
  if (next.get() < 0 || ::fstat(next.get(), &info) != 0) return Descriptor(-1);
  expect_own(info, path);
  return next;
}

/// Opens the last folder of a way, as open_below() does.
Descriptor open_folder(const Way& way, bool make) {
  if (make && !make_folders(way.start)) return Descriptor(-1);
  fs::path path = way.start.empty() ? fs::path(".") : way.start;
  Descriptor at(::open(path.c_str(), kFolder));
  struct stat info {};
  if (at.get() < 0 || ::fstat(at.get(), &info) != 0) return Descriptor(-1);
  expect_own_start(info, path);
  for (const fs::path& name : way.below)
    if (at = open_below(at, path /= name, make); at.get() < 0) break;
  return at;
}

/// Opens a file of a cache folder as a regular file of this user alone. Returns no descriptor if it is none.
Descriptor open_own(const Descriptor& folder, const char* name, int flags, struct stat& info) {
  Descriptor fd(::openat(folder.get(), name, flags | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC, 0600));
  const bool own = fd.get() >= 0 && ::fstat(fd.get(), &info) == 0 && S_ISREG(info.st_mode) &&
                   info.st_uid == ::geteuid() && (info.st_mode & (S_IWGRP | S_IWOTH)) == 0;
  return own ? std::move(fd) : Descriptor(-1);
}

/// Throws Refusal if the error is that a disk has no room.
void expect_room(int code, const fs::path& path) {
  if (code == ENOSPC || code == EDQUOT || code == EFBIG)
    throw Refusal{fmt::format("{} has no room: {}", path.string(), errno_text(code)), true};
}

/// Gives the file that Mesa maps all its room on the disk. Returns false if it cannot be made. Throws Refusal.
bool reserve_index(const Descriptor& folder, const fs::path& path) {
  struct stat info {};
  const Descriptor index = open_own(folder, "index", O_RDWR | O_CREAT, info);
  int code = index.get() < 0 ? errno : 0;
  const off_t bytes = std::max(info.st_size, kMesaIndex);
  rlimit most{};
  const bool limited = ::getrlimit(RLIMIT_FSIZE, &most) == 0 && most.rlim_cur < rlim_t(bytes);
  if (code == 0 && limited && info.st_size < bytes) code = EFBIG;  // the system would end the process
  if (code == 0 && ::fallocate(index.get(), 0, 0, bytes) != 0) code = errno;
  if (code == EOPNOTSUPP) {  // such a file system can tell alone what is free
    struct statvfs disk {};
    const bool room = ::fstatvfs(index.get(), &disk) == 0 && disk.f_bavail * disk.f_frsize >= std::uint64_t(bytes);
    code = room ? 0 : ENOSPC;
  }
  if (code != 0 && index.get() >= 0 && info.st_size == 0) ::unlinkat(folder.get(), "index", 0);
  expect_room(code, path);
  expect_writable(code, path);
  return code == 0;
}

/// Returns the folder that the environment gives Mesa's cache; "" if there is none, or one that a process which began
/// this one had set.
fs::path given_to_driver() {
  const char* given = std::getenv(kMesaVariable);
  return given && !std::string_view(given).starts_with(kOpenFiles) ? given : "";
}

/// Returns the way to the folder for Mesa's cache. Each vector width of llvmpipe has its own: Mesa's cache does not
/// tell widths apart, and code that was cached at one width crashes at another (seen on 25.0.7).
Way way_of_driver() {
  if (const fs::path given = given_to_driver(); !given.empty()) return {given, {}};
  const char* width = std::getenv("LP_NATIVE_VECTOR_WIDTH");
  return way_to(cache_folder() / (width ? std::string("mesa-width-") + width : "mesa"));
}

/// Makes Mesa's folder in `folder` and gives it its room. Returns false if it cannot be made. Throws Refusal.
bool reserve_folder(const Descriptor& folder, const fs::path& path) {
  struct stat info {};
  if (folder.get() < 0) expect_room(errno, path);
  if (folder.get() < 0 || ::fstat(folder.get(), &info) != 0) return false;
  if ((info.st_mode & S_ISVTX) == 0 && (info.st_mode & (S_IWGRP | S_IWOTH)) != 0)
    throw Refusal{path.string() + " can be written by others, who could exchange what is in it; chmod go-w it"};
  const Descriptor inside = open_below(folder, path / kMesaFolder, true);
  if (inside.get() < 0) expect_room(errno, path);
  return inside.get() >= 0 && reserve_index(inside, path / kMesaFolder);
}

/// Does what prepare_driver_cache() does, each time.
void prepare_mesa_cache() {
  const char* off = std::getenv(kMesaOff);
  if (off && *off && std::string_view("1yYtT").find(*off) != std::string_view::npos) return;
  try {
    const Way way = way_of_driver();
    fs::path path = way.start;
    for (const fs::path& name : way.below) path /= name;
    Descriptor folder = open_folder(way, true);
    if (reserve_folder(folder, path)) {
      // Mesa opens it by descriptor too: nobody can exchange a folder above for another.
      ::setenv(kMesaVariable, fmt::format("{}{}", kOpenFiles, folder.release()).c_str(), 1);
      return;
    }
  } catch (const Refusal& refusal) {
    if (refusal.of_driver || !given_to_driver().empty())
      say_aside("ballot: the driver's cache is off: {}\n", refusal.text);
    else
      say_no_cache(refusal.text);
  } catch (const Error&) {
    // No folder is known for caches.
  }
  ::setenv(kMesaOff, "true", 1);
}

}  // namespace

InputStream open_cache(const fs::path& path) {
  InputStream none(nullptr, &std::fclose);
  try {
    const Descriptor folder = open_folder(way_to(path.parent_path()), false);
    struct stat info {};
    if (folder.get() < 0) return none;
    Descriptor fd = open_own(folder, path.filename().c_str(), O_RDONLY, info);
    if (fd.get() >= 0) none.reset(::fdopen(fd.get(), "rb"));
    if (none) fd.release();
  } catch (const Refusal& refusal) {
    say_no_cache(refusal.text);
  }
  return none;
}

std::optional<std::vector<std::byte>> read_cache(const fs::path& path) {
  const InputStream file = open_cache(path);
  struct stat info {};
  if (!file || ::fstat(::fileno(file.get()), &info) != 0) return std::nullopt;
  std::vector<std::byte> bytes;
  try {
    need_memory(std::uint64_t(info.st_size), path.string());
    bytes.resize(std::size_t(info.st_size));
  } catch (const std::exception&) {
    return std::nullopt;
  }
  return std::fread(bytes.data(), 1, bytes.size(), file.get()) == bytes.size() ? std::optional(bytes) : std::nullopt;
}

bool write_cache(const fs::path& path, std::initializer_list<std::span<const std::byte>> parts) {
  try {
    Descriptor folder = open_folder(way_to(path.parent_path()), true);
    if (folder.get() < 0) return false;
    if (::faccessat(folder.get(), ".", W_OK, AT_EACCESS) != 0) expect_writable(errno, path.parent_path());
    Temporary temporary(std::move(folder), path.parent_path(), mode_t{0600}, path);
    OutputFile out(temporary.descriptor(), path);
    for (const auto& part : parts) out.write(part.data(), part.size());
    out.close();
    temporary.rename_to(path.filename());
    return true;
  } catch (const Refusal& refusal) {
    say_no_cache(refusal.text);
  } catch (const std::exception&) {
    // It costs time.
  }
  return false;
}

bool write_cache(const fs::path& path, std::span<const std::byte> bytes) { return write_cache(path, {bytes}); }

void say_damaged_cache(const fs::path& path) {
  static std::once_flag once;
  std::call_once(once,
                 [&] { say_aside("ballot: {} is damaged or of another version; it is made anew\n", path.string()); });
}

void prepare_driver_cache() {
  static std::once_flag once;
  std::call_once(once, prepare_mesa_cache);
}

}  // namespace ballot
