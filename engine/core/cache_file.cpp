#include "engine/core/cache_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "engine/core/error.h"
#include "engine/core/file.h"
#include "engine/core/temporary.h"

namespace ballot {
namespace {

namespace fs = std::filesystem;

bool is_of_this_user(const struct stat& info) {
  return (info.st_uid == ::geteuid() || info.st_uid == 0) && (info.st_mode & S_IWOTH) == 0;
}

}  // namespace

bool is_own_file(const fs::path& path) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  struct stat file {
  }, around{};
  return ::lstat(path.c_str(), &file) == 0 && S_ISREG(file.st_mode) && is_of_this_user(file) &&
         ::stat(folder.c_str(), &around) == 0 && is_of_this_user(around);
}

std::optional<std::vector<std::byte>> read_cache(const fs::path& path) {
  if (!is_own_file(path)) return std::nullopt;
  try {
    return read_file(path);
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

bool write_cache(const fs::path& path, std::span<const std::byte> bytes) {
  try {
    make_cache_folder(path.parent_path());
    write_file(path, bytes);
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

void make_cache_folder(const fs::path& folder) {
  if (folder.empty() || ::mkdir(folder.c_str(), 0700) == 0 || errno == EEXIST) return;
  if (errno != ENOENT) cannot_write(folder, errno_text(errno));
  make_cache_folder(folder.parent_path());
  if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) cannot_write(folder, errno_text(errno));
}

}  // namespace ballot
