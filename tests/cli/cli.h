// The fixture of the command-line tests: it runs commands as a user does, in temporary folders.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "shaders/shared/layout.h"
#include "tests/temporary.h"

namespace ballot::test {

/// The outcome of a run: the exit code (128 + signal if the program was killed), standard output and standard error.
struct Result {
  int code = -1;
  std::string out, err;
};

using Words = std::vector<std::string>;
using Environment = std::map<std::string, std::string>;

/// A fixture with its own working folder, cache folder and folder for temporary files. They are removed after the test.
class Cli : public ::testing::Test {
 protected:
  Cli();

  /// Runs `ballot args` in the working folder, with the environment variables of `more` added. Kills it after two
  /// minutes.
  Result run(const Words& args, const Environment& more = {}) const;

  /// Runs `ballot args` and expects exit code 0 and no message of the validation layers.
  Result succeed(const Words& args, const Environment& more = {}) const;

  /// Runs `ballot args`. Expects this exit code, an error message that contains every part, and the same set of files
  /// as before.
  void refuse(int code, std::initializer_list<std::string_view> parts, const Words& args,
              const Environment& more = {}) const;

  /// Starts the program ballot and kills it with SIGKILL as soon as the file exists.
  void kill_when_there_is(const std::string& file, const Words& args) const;

  /// Runs tools/report with the arguments, of one line of a shell, and expects exit code 0. Returns what it printed.
  std::string report(const std::string& args) const;

  std::filesystem::path path(const std::string& name) const { return root_ / "work" / name; }
  std::string write(const std::string& name, std::string_view content) const;  // returns `name`
  std::string read(const std::string& name) const;
  nlohmann::json json(const std::string& name) const { return nlohmann::json::parse(read(name)); }
  /// Returns the files of the working folder and below, and any temporary file that was left behind.
  std::set<std::string> files() const;

  /// Writes square.glb: two triangles in [-1, 1]^2 at z = 0, with views "front" (from z = 3) and "far" (from z = 6).
  std::string square() const;
  /// Writes orthographic.glb: the same square, with one orthographic view "plan" that is half as high as the square.
  std::string orthographic() const;
  /// Writes empty.glb: one view and no triangle.
  std::string empty() const;
  /// Writes rays.npy: n rays along -z from z = 2 over [-2, 2]^2, so that some miss the square.
  std::string rays(std::size_t n = 64) const;
  std::vector<Hit> hits(const std::string& name = "hits.npy") const;
  /// Writes an array of so many columns, such as points.npy of 3 or rays.npy of 6.
  template <class Number = float>
  void array(const std::string& name, const std::vector<Number>& numbers, std::size_t columns) const {
    std::string header = fmt::format("{{'descr': '<f{}', 'fortran_order': False, 'shape': ({}, {}), }}", sizeof(Number),
                                     numbers.size() / columns, columns);
    header.resize((10 + header.size() + 64) / 64 * 64 - 10, ' ');
    header.back() = '\n';
    std::string file("\x93NUMPY\x01\x00", 8);
    file += char(header.size() % 256);
    file += char(header.size() / 256);
    file += header;
    file.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
    write(name, file);
  }
  /// Returns the items of an array.
  template <class T>
  std::vector<T> items(const std::string& name, const char* descr) const {
    const std::string file = read(name);
    const std::size_t start = file.find('\n') + 1;
    EXPECT_NE(file.find(descr), std::string::npos) << file.substr(0, start);
    std::vector<T> all((file.size() - start) / sizeof(T));
    if (!all.empty()) std::memcpy(all.data(), file.data() + start, all.size() * sizeof(T));
    return all;
  }

 private:
  const TemporaryFolder folder_;
  const std::filesystem::path root_ = folder_.path();
};

/// Returns the rays that Cli::rays writes.
std::vector<Ray> square_rays(std::size_t n);
/// True if the ray, one of square_rays(), hits the square.
bool hits_square(const Ray& ray);

/// Expects that there is at least one line, and that each line begins with "ballot: " or continues one, indented by two
/// spaces.
void expect_error_lines(const std::string& err);
/// Expects that the text contains every part.
void expect_parts(const std::string& text, std::initializer_list<std::string_view> parts);

}  // namespace ballot::test
