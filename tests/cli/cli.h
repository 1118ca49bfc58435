// Runs the ballot binary as a user does, in folders of its own.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <initializer_list>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "shaders/shared/layout.h"

namespace ballot::test {

/// What a run left: exit code (128 + signal if it was killed) and both streams.
struct Result {
  int code = -1;
  std::string out, err;
};

using Words = std::vector<std::string>;
using Environment = std::map<std::string, std::string>;

/// A test with a working folder, a cache and a folder for temporaries, all its own and gone afterwards.
class Cli : public ::testing::Test {
 protected:
  Cli();
  ~Cli() override;

  /// Runs `ballot args` in the working folder; killed after two minutes.
  Result run(const Words& args, const Environment& more = {}) const;

  /// Runs it and expects exit code 0 and no validation message.
  Result succeed(const Words& args, const Environment& more = {}) const;

  /// Runs it and expects this exit code, an error that holds every part, and the working folder as it was.
  void refuse(int code, std::initializer_list<std::string_view> parts, const Words& args,
              const Environment& more = {}) const;

  std::filesystem::path path(const std::string& name) const { return root_ / "work" / name; }
  std::string write(const std::string& name, std::string_view content) const;  // returns `name`
  std::string read(const std::string& name) const;
  nlohmann::json json(const std::string& name) const { return nlohmann::json::parse(read(name)); }
  std::set<std::string> files() const;  // of the working folder and below, and leftovers of temporaries

  /// square.glb: two triangles in [-1, 1]^2 at z = 0, views "front" (from z = 3) and "far" (from z = 6).
  std::string square() const;
  /// orthographic.glb: the same, seen by one orthographic view, "plan", half as high as the square.
  std::string orthographic() const;
  /// empty.glb: one view, no triangle.
  std::string empty() const;
  /// rays.npy: n rays along -z from z = 2 over [-2, 2] squared, so that some miss.
  std::string rays(std::size_t n = 64) const;
  std::vector<Hit> hits(const std::string& name = "hits.npy") const;

 private:
  std::filesystem::path root_;
};

/// Rays that Cli::rays writes, and whether and at what distance each hits the square.
std::vector<Ray> square_rays(std::size_t n);
bool hits_square(const Ray& ray);

/// Expects each line to be "ballot: ..." or, indented, to continue one.
void expect_error_lines(const std::string& err);
void expect_parts(const std::string& text, std::initializer_list<std::string_view> parts);

}  // namespace ballot::test
