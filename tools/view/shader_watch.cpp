#include "tools/view/shader_watch.h"

namespace ballot::view {

namespace fs = std::filesystem;

ShaderWatch::Files ShaderWatch::look() const {
  Files files;
  std::error_code error;
  for (fs::recursive_directory_iterator at(folder_, error), end; !error && at != end; at.increment(error)) {
    std::error_code gone;  // set if an editor is just replacing the file
    if (!at->is_regular_file(gone)) continue;
    const auto time = at->last_write_time(gone);
    if (!gone) files[at->path()] = time;
  }
  return files;
}

bool ShaderWatch::changed() {
  const auto now = std::chrono::steady_clock::now();
  if (now - looked_ < std::chrono::milliseconds(500)) return false;
  looked_ = now;
  Files files = look();
  if (files == files_) return false;
  files_ = std::move(files);
  return true;
}

}  // namespace ballot::view
