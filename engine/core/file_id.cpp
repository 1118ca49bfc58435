#include "engine/core/file_id.h"

#include <mutex>
#include <set>
#include <system_error>
#include <utility>

namespace ballot {
namespace {

using ReadFiles = std::set<std::pair<dev_t, ino_t>>;

std::mutex read_mutex;
bool remembering = false;

ReadFiles& read_files() {
  static ReadFiles files;
  return files;
}

}  // namespace

std::optional<FileId> file_id(const std::filesystem::path& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) == 0) {
    if (!S_ISREG(info.st_mode)) return std::nullopt;
    return FileId{info.st_dev, info.st_ino, {}};
  }
  std::filesystem::path file = path;  // a link is replaced below by its target, which does not exist yet
  std::error_code error;
  for (int links = 0; links < 40 && std::filesystem::is_symlink(std::filesystem::symlink_status(file, error)); ++links)
    file = file.parent_path() / std::filesystem::read_symlink(file, error);
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  if (::stat(folder.c_str(), &info) != 0) return std::nullopt;
  return FileId{info.st_dev, info.st_ino, file.filename().string()};
}

void remember_reads() {
  const std::lock_guard lock(read_mutex);
  remembering = true;
}

bool was_read(const FileId& id) {
  const std::lock_guard lock(read_mutex);
  return id.name.empty() && read_files().contains({id.device, id.number});
}

void note_file_read(const struct stat& info) {
  const std::lock_guard lock(read_mutex);
  if (remembering && S_ISREG(info.st_mode)) read_files().emplace(info.st_dev, info.st_ino);
}

}  // namespace ballot
