// The temporary files beside which outputs appear whole, and the removal of those that killed processes left behind.
// Internal to engine/core.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>

#include "engine/core/descriptor.h"

namespace ballot {

/// An empty temporary file, .ballot-*.tmp, in a folder. The destructor removes it unless it was renamed. While it
/// exists its maker holds a lock on it (flock), which a process loses however it ends: a file without one is litter.
class Temporary {
 public:
  /// Makes the file, after sweep_temporaries(folder). `path` is the output that error messages name. `mode` is that of
  /// the file that is replaced, if there is one. Throws Error(Work).
  Temporary(const std::filesystem::path& folder, std::optional<mode_t> mode, const std::filesystem::path& path);
  ~Temporary();
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;

  const std::filesystem::path& file() const { return file_; }
  /// Renames the file to `target`. Throws Error(Work).
  void rename_to(const std::filesystem::path& target);

 private:
  bool make(const std::filesystem::path& file, std::optional<mode_t> mode);

  std::filesystem::path file_, path_;
  Descriptor lock_{-1};
};

/// Removes the temporary files of this program in a folder whose makers are gone, once for each folder in the life of a
/// process. Files that cannot be locked or removed stay. Thread-safe.
void sweep_temporaries(const std::filesystem::path& folder);

/// Throws Error(Work) "cannot write PATH: reason".
[[noreturn]] void cannot_write(const std::filesystem::path& path, const std::string& reason);
/// Returns the text of an errno.
std::string errno_text(int code);

}  // namespace ballot
