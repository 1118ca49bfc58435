// A watch on the shader folder that notices changed files.
#pragma once

#include <chrono>
#include <filesystem>
#include <map>

namespace ballot::view {

class ShaderWatch {
 public:
  explicit ShaderWatch(std::filesystem::path folder) : folder_(std::move(folder)), files_(look()) {}

  /// Returns true once after a change. Looks at the files at most twice a second.
  bool changed();

 private:
  using Files = std::map<std::filesystem::path, std::filesystem::file_time_type>;
  Files look() const;

  std::filesystem::path folder_;
  Files files_;
  std::chrono::steady_clock::time_point looked_ = std::chrono::steady_clock::now();
};

}  // namespace ballot::view
