// The files of one command: none that it writes may be one that it reads, or be written twice.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/scene/device_scene.h"

namespace ballot::cli {

class CommandFiles {
 public:
  /// Notes a file that the command reads. `option` is for messages: the option that names it. "" and "-" name none.
  /// Throws Error(Arguments) if it is one that the command writes.
  void reads(const std::string& option, const std::filesystem::path& path);

  /// Notes a file that the command must write. Throws as writes(), also for "".
  std::filesystem::path must_write(const std::string& option, const std::filesystem::path& path);

  /// Notes a file that the command writes and checks that it can be. Returns the path to write to: for "-" that of
  /// standard output, which data then claims, so that text goes to standard error. "" names none.
  /// Throws Error(Arguments) if the command reads the file, also by another name or through a link, or writes it
  /// already; Error(Work) if it cannot be written.
  std::filesystem::path writes(const std::string& option, const std::filesystem::path& path);

  /// Throws Error(Arguments) if a file that will be written was read by now, such as a texture of the scene.
  void check_read() const;

 private:
  struct Named {
    std::string option;
    std::filesystem::path path;
    FileId id;
  };
  std::vector<Named> inputs_, outputs_;
  std::string streamed_;  // the option that writes to standard output
};

/// Checks that a folder is there or can be made, and that files can be made in it; makes nothing. For use before long
/// work. Throws Error(Work), which names the option.
void check_folder(const std::string& option, const std::filesystem::path& folder);

}  // namespace ballot::cli
