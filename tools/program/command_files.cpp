#include "tools/program/command_files.h"

#include <unistd.h>

#include <cerrno>
#include <optional>
#include <system_error>

#include "engine/scene/device_scene.h"

namespace ballot::cli {

namespace {

constexpr const char* kStandardOutput = "/dev/stdout";

[[noreturn]] void clash(const std::string& option, const std::filesystem::path& path, const std::string& reason) {
  fail(Failure::Arguments, "{} {}: {}; name another file", option, path.string(), reason);
}

}  // namespace

void CommandFiles::reads(const std::string& option, const std::filesystem::path& path) {
  if (path.empty() || path == "-") return;
  const std::optional<FileId> id = file_id(path);
  if (!id) return;
  for (const Named& output : outputs_)
    if (output.id == *id)
      clash(output.option, output.path, "it is the file that " + option + " reads, and would be replaced");
  inputs_.push_back({option, path, *id});
}

std::filesystem::path CommandFiles::must_write(const std::string& option, const std::filesystem::path& path) {
  if (path.empty()) check_writable(path);  // throws
  return writes(option, path);
}

std::filesystem::path CommandFiles::writes(const std::string& option, const std::filesystem::path& path) {
  if (path.empty()) return path;
  if (path == "-" || descriptor_of(path) == STDOUT_FILENO) {
    if (!streamed_.empty()) clash(option, path, "standard output takes what " + streamed_ + " writes");
    streamed_ = option;
    claim_standard_output();
    check_writable(kStandardOutput);
    return kStandardOutput;
  }
  check_writable(path);
  const std::optional<FileId> id = file_id(path);
  if (!id) return path;
  for (const Named& input : inputs_)
    if (input.id == *id) clash(option, path, "it is the file that " + input.option + " reads, and would be replaced");
  for (const Named& output : outputs_)
    if (output.id == *id) clash(option, path, "it would be written twice, as " + output.option + " names it too");
  outputs_.push_back({option, path, *id});
  return path;
}

void check_folder(const std::string& option, const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::path there = std::filesystem::absolute(folder, error);
  while (!std::filesystem::exists(there, error) && there.has_relative_path()) there = there.parent_path();
  if (!std::filesystem::is_directory(there, error))
    fail(Failure::Work, "{} {}: cannot create the folder: {}: {}; name another", option, folder.string(),
         there.string(), std::generic_category().message(ENOTDIR));
  if (::access(there.c_str(), W_OK | X_OK) != 0)
    fail(Failure::Work, "{} {}: cannot write to the folder {}: {}; name another", option, folder.string(),
         there.string(), std::generic_category().message(errno));
}

void CommandFiles::check_read() const {
  for (const Named& output : outputs_)
    if (was_read(output.id)) clash(output.option, output.path, "the command reads this file, and would replace it");
}

}  // namespace ballot::cli
