#include "tests/cli/cli.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <sstream>
#include <thread>

#include "engine/files/npy.h"
#include "tests/cpu/gltf_builder.h"

namespace ballot::test {

namespace {

namespace fs = std::filesystem;

constexpr unsigned kSecondsAtMost = 120;  // after these a started program is killed

std::string read_all(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Expects none of the texts of exceptions that libraries throw: they name functions, and nothing of the user's.
void expect_plain_words(const std::string& err) {
  for (const char* raw : {"std::", "vector::", "basic_string", "json.exception", "bad_alloc", "bad_variant", "stof",
                          "stoi", "map::at", "_M_", "fault inside Ballot", "terminate called"})
    EXPECT_EQ(err.find(raw), std::string::npos) << err;
}

std::vector<char*> pointers(Words& words) {
  std::vector<char*> list;
  for (std::string& word : words) list.push_back(word.data());
  list.push_back(nullptr);
  return list;
}

/// Starts a copy of this process that goes to a folder, with its output in two files. Calls `work` in it, which returns
/// the exit code. Returns the copy's number.
pid_t start(const fs::path& folder, const fs::path& streams, const std::function<int()>& work) {
  std::fflush(nullptr);  // or the copy writes it too
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("cannot start a process");
  if (child > 0) return child;
  const int in = ::open("/dev/null", O_RDONLY);
  const int out = ::open((streams / "out").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666),
            err = ::open((streams / "err").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
  if (in < 0 || out < 0 || err < 0 || ::chdir(folder.c_str()) != 0) ::_exit(126);
  ::dup2(in, 0);
  ::dup2(out, 1);
  ::dup2(err, 2);
  ::alarm(kSecondsAtMost);
  const int code = work();
  std::fflush(nullptr);
  ::_exit(code);
}

GltfBuilder a_square() {
  GltfBuilder b;
  b.mesh(b.vec3({-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0}));
  b.primitive()["indices"] = b.indices({0, 1, 2, 0, 2, 3});
  b.node({{"mesh", 0}});
  return b;
}

void add_camera(GltfBuilder& b, const std::string& name, float z) {
  b.json["cameras"].push_back({{"type", "perspective"}, {"perspective", {{"yfov", 1.0}, {"znear", 0.1}}}});
  b.node({{"name", name}, {"camera", b.json["cameras"].size() - 1}, {"translation", {0, 0, z}}});
}

}  // namespace

Cli::Cli() {
  for (const char* name : {"work", "cache", "temporary", "streams"}) fs::create_directory(root_ / name);
}

void Cli::kill_when_there_is(const std::string& file, const Words& args) const {
  const pid_t child = start(path(""), root_ / "streams", [&] {
    Words words{BALLOT_BINARY};
    words.insert(words.end(), args.begin(), args.end());
    return ::execv(BALLOT_BINARY, pointers(words).data());
  });
  for (int i = 0; i < 6000 && !fs::exists(path(file)); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  ::kill(child, SIGKILL);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status)) << "ballot ended before it was killed";
}

Result Cli::run(const Words& args, const Environment& more) const {
  const pid_t child = start(path(""), root_ / "streams", [&] {
    Environment changes = more;
    changes.emplace("XDG_CACHE_HOME", (root_ / "cache").string());
    changes.emplace("TMPDIR", (root_ / "temporary").string());
    for (const auto& [name, value] : changes) ::setenv(name.c_str(), value.c_str(), 1);
    Words words{BALLOT_BINARY};
    words.insert(words.end(), args.begin(), args.end());
    // A copy would lack the threads that this process has started.
    return ::execv(BALLOT_BINARY, pointers(words).data());
  });
  int status = 0;
  if (::waitpid(child, &status, 0) != child) throw std::runtime_error("cannot wait for ballot to end");
  const Result result{WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_all(root_ / "streams/out"),
                      read_all(root_ / "streams/err")};
  expect_plain_words(result.err);
  return result;
}

Result Cli::succeed(const Words& args, const Environment& more) const {
  const Result result = run(args, more);
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.err.find("validation:"), std::string::npos) << result.err;
  return result;
}

void Cli::refuse(int code, std::initializer_list<std::string_view> parts, const Words& args,
                 const Environment& more) const {
  std::string command = "ballot";
  for (const std::string& word : args) command += " " + word;
  SCOPED_TRACE(command);
  const auto before = files();
  const Result result = run(args, more);
  EXPECT_EQ(result.code, code) << result.err;
  expect_error_lines(result.err);
  expect_parts(result.err, parts);
  EXPECT_EQ(files(), before);
}

std::string Cli::write(const std::string& name, std::string_view content) const {
  std::ofstream(path(name), std::ios::binary).write(content.data(), static_cast<std::streamsize>(content.size()));
  return name;
}

std::string Cli::report(const std::string& args) const {
  const std::string line = "cd '" + path("").string() +
                           "' && PYTHONDONTWRITEBYTECODE=1 python3 '" BALLOT_SOURCE_DIR "/tools/report' " + args +
                           " > '" + (root_ / "streams/out").string() + "'";
  EXPECT_EQ(std::system(line.c_str()), 0) << line;
  return read_all(root_ / "streams/out");
}

std::string Cli::read(const std::string& name) const { return read_all(path(name)); }

std::set<std::string> Cli::files() const {
  std::set<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(root_ / "work"))
    names.insert(fs::relative(entry.path(), root_ / "work").string());
  for (const char* folder : {"temporary", "cache"})
    for (const auto& entry : fs::recursive_directory_iterator(root_ / folder))
      if (entry.path().extension() == ".tmp") names.insert("left over: " + entry.path().string());
  return names;
}

std::string Cli::square() const {
  GltfBuilder b = a_square();
  add_camera(b, "front", 3);
  add_camera(b, "far", 6);
  return write("square.glb", b.glb());
}

std::string Cli::orthographic() const {
  GltfBuilder b = a_square();
  b.json["cameras"] = {
      {{"type", "orthographic"}, {"orthographic", {{"xmag", 0.5}, {"ymag", 0.5}, {"znear", 0.1}, {"zfar", 9}}}}};
  b.node({{"name", "plan"}, {"camera", 0}, {"translation", {0, 0, 3}}});
  return write("orthographic.glb", b.glb());
}

std::string Cli::empty() const {
  GltfBuilder b;
  add_camera(b, "front", 3);
  return write("empty.glb", b.glb());
}

std::string Cli::rays(std::size_t n) const {
  write_rays(path("rays.npy"), square_rays(n));
  return "rays.npy";
}

std::vector<Hit> Cli::hits(const std::string& name) const { return read_hits(path(name)); }

std::vector<Ray> square_rays(std::size_t n) {
  std::vector<Ray> all;
  for (std::size_t i = 0; i < n; ++i) {
    const auto f = static_cast<float>(i);
    all.push_back({{2 * std::sin(3 * f + 1), 2 * std::cos(5 * f), 2}, 0, {0, 0, -0.5f}, 100});
  }
  return all;
}

bool hits_square(const Ray& ray) { return std::abs(ray.origin.x) <= 1 && std::abs(ray.origin.y) <= 1; }

void expect_error_lines(const std::string& err) {
  EXPECT_FALSE(err.empty()) << "standard error is empty, expected an error message";
  std::istringstream lines(err);
  std::string line;
  for (bool first = true; std::getline(lines, line); first = false)
    EXPECT_TRUE(line.starts_with("ballot: ") || (!first && line.starts_with("  "))) << line;
}

void expect_parts(const std::string& text, std::initializer_list<std::string_view> parts) {
  for (const std::string_view part : parts)
    EXPECT_NE(text.find(part), std::string::npos) << "'" << part << "' is not in: " << text;
}

}  // namespace ballot::test
