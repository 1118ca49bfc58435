// Which file a path names, by device and number instead of by name, and which files this process has read. With them
// outputs are held apart from inputs.
#pragma once

#include <sys/stat.h>

#include <filesystem>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

namespace ballot {

/// A file or a place for one. Two paths with equal ids are one file, whatever links lead there.
struct FileId {
  dev_t device = 0;
  ino_t number = 0;
  std::string name;  // of a file that does not exist: its name in the folder `number`; else empty
  auto key() const { return std::tie(device, number, name); }
  bool operator==(const FileId& other) const { return key() == other.key(); }
};

/// Returns the id of a regular file, or of the place where one would be made. Nothing for pipes, devices and folders,
/// and where there is no folder.
std::optional<FileId> file_id(const std::filesystem::path& path);

/// Makes the process remember from now on which files it opens for reading. Thread-safe.
void remember_reads();
/// Returns true if the file was opened for reading since remember_reads(). Thread-safe.
bool was_read(const FileId& id);
/// Notes that a file was opened for reading; for file.cpp. Thread-safe.
void note_file_read(const struct stat& info);

}  // namespace ballot
