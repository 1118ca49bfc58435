// The temporary files beside which outputs appear whole, and the removal of those that killed processes left behind.
// Internal to engine/core.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>

#include "engine/core/descriptor.h"

namespace ballot {

/// An empty temporary file, .ballot-*.tmp, in a folder. It is written and read through its descriptor alone: by its
/// name another user of the folder could have put another file there. The destructor removes it unless it was renamed.
/// While it exists its maker holds a lock on it (flock), which a process loses however it ends: a file without one is
/// litter.
class Temporary {
 public:
  /// Makes the file, after sweep_temporaries(). `folder` is the open folder of the name `folder_name`, and `path` the
  /// output that error messages name. `mode` is that of the file that is replaced, if there is one. Throws Error(Work).
  Temporary(Descriptor folder, const std::filesystem::path& folder_name, std::optional<mode_t> mode,
            const std::filesystem::path& path);
  ~Temporary();
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;

  /// Returns the open file, to write and to read.
  int descriptor() const { return file_.get(); }
  /// Renames the file to `name` in the same folder. Throws Error(Work).
  void rename_to(const std::filesystem::path& name);

 private:
  bool make(const std::string& name, std::optional<mode_t> mode);

  Descriptor folder_;
  std::filesystem::path path_;
  std::string name_;
  Descriptor file_{-1};
};

/// Removes the temporary files of this program in an open folder whose makers are gone, once for each folder in the
/// life of a process. Files that cannot be locked or removed stay. Thread-safe.
void sweep_temporaries(const Descriptor& folder, const std::filesystem::path& folder_name);

/// Throws Error(Work) "cannot write PATH: reason".
[[noreturn]] void cannot_write(const std::filesystem::path& path, const std::string& reason);
/// Returns the text of an errno.
std::string errno_text(int code);

}  // namespace ballot
