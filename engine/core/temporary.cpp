#include "engine/core/temporary.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <atomic>
#include <cerrno>
#include <memory>
#include <mutex>
#include <random>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include "engine/core/error.h"

namespace ballot {
namespace {

namespace fs = std::filesystem;

// The random part is needed because process ids repeat between containers that share a folder.
std::string temporary_name() {
  static const unsigned process_key = std::random_device{}();
  static std::atomic<unsigned> counter{0};
  return fmt::format(".ballot-{}-{:08x}-{}.tmp", ::getpid(), process_key, counter++);
}

bool is_temporary_name(const std::string& name) { return name.starts_with(".ballot-") && name.ends_with(".tmp"); }

/// Removes a file if nobody holds its lock. The lock is held while the file is removed, so that a process that has just
/// made it finds that it is gone and makes another.
void remove_if_left(int folder, const char* name) {
  const Descriptor fd(::openat(folder, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  struct stat info {};
  if (fd.get() < 0 || ::fstat(fd.get(), &info) != 0 || !S_ISREG(info.st_mode)) return;
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) == 0) ::unlinkat(folder, name, 0);
}

/// Returns true the first time that a folder is named.
bool is_first_visit(const fs::path& folder) {
  static std::mutex mutex;
  static std::set<std::string> seen;
  std::error_code error;
  const std::string name = fs::absolute(folder, error).string();
  const std::lock_guard lock(mutex);
  return seen.insert(name).second;
}

}  // namespace

void cannot_write(const fs::path& path, const std::string& reason) {
  fail(Failure::Work, "cannot write {}: {}", path.string(), reason);
}

std::string errno_text(int code) { return std::generic_category().message(code); }

void sweep_temporaries(const Descriptor& folder, const fs::path& folder_name) {
  if (!is_first_visit(folder_name)) return;
  Descriptor list(::openat(folder.get(), ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  const std::unique_ptr<DIR, int (*)(DIR*)> names(list.get() < 0 ? nullptr : ::fdopendir(list.get()), &::closedir);
  if (!names) return;
  list.release();
  while (const dirent* entry = ::readdir(names.get()))
    if (is_temporary_name(entry->d_name)) remove_if_left(folder.get(), entry->d_name);
}

Temporary::Temporary(Descriptor folder, const fs::path& folder_name, std::optional<mode_t> mode, const fs::path& path)
    : folder_(std::move(folder)), path_(path) {
  sweep_temporaries(folder_, folder_name);
  for (int tries = 0; !make(temporary_name(), mode); ++tries)
    if (tries == 100) cannot_write(path_, errno_text(EEXIST));
}

/// Returns false if another name has to be tried.
bool Temporary::make(const std::string& name, std::optional<mode_t> mode) {
  constexpr int kNew = O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC;
  Descriptor fd(::openat(folder_.get(), name.c_str(), kNew, 0666));
  if (fd.get() < 0) {
    if (errno == EEXIST) return false;
    cannot_write(path_, errno_text(errno));
  }
  // Where a file system has no locks, nobody can sweep either.
  while (::flock(fd.get(), LOCK_EX) != 0 && errno == EINTR) {
  }
  struct stat info {};
  if (::fstat(fd.get(), &info) == 0 && info.st_nlink == 0) return false;  // swept before it was locked
  if (mode) (void)::fchmod(fd.get(), *mode);                              // a failure is harmless: the content counts
  name_ = name;
  file_ = std::move(fd);
  return true;
}

Temporary::~Temporary() {
  if (!name_.empty()) ::unlinkat(folder_.get(), name_.c_str(), 0);
}

void Temporary::rename_to(const fs::path& name) {
  if (::renameat(folder_.get(), name_.c_str(), folder_.get(), name.c_str()) != 0)
    cannot_write(path_, errno_text(errno));
  name_.clear();
}

}  // namespace ballot
