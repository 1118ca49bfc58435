#include "tests/cli/cli.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <thread>

#include "engine/core/npy.h"
#include "tests/cpu/gltf_builder.h"

extern char** environ;

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

Words environment_with(const Environment& changes) {
  Words all;
  for (char** entry = environ; *entry; ++entry) {
    const std::string text = *entry;
    if (!changes.contains(text.substr(0, text.find('=')))) all.push_back(text);
  }
  for (const auto& [name, value] : changes) all.push_back(name + "=" + value);
  return all;
}

/// Turns the forked child into the program. Calls only what POSIX allows between fork and exec.
[[noreturn]] void become(char** args, char** environment, const char* folder, const char* out, const char* err) {
  const int in = ::open("/dev/null", O_RDONLY);
  const int out_fd = ::open(out, O_WRONLY | O_CREAT | O_TRUNC, 0666),
            err_fd = ::open(err, O_WRONLY | O_CREAT | O_TRUNC, 0666);
  if (in < 0 || out_fd < 0 || err_fd < 0 || ::chdir(folder) != 0) ::_exit(126);
  ::dup2(in, 0);
  ::dup2(out_fd, 1);
  ::dup2(err_fd, 2);
  ::alarm(kSecondsAtMost);
  ::execve(args[0], args, environment);
  ::_exit(127);
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
  std::string pattern = (fs::path(::testing::TempDir()) / "ballot_cli_XXXXXX").string();
  if (!::mkdtemp(pattern.data())) throw std::runtime_error("cannot create a folder for the test: " + pattern);
  root_ = pattern;
  for (const char* name : {"work", "cache", "temporary", "streams"}) fs::create_directory(root_ / name);
}

Cli::~Cli() {
  std::error_code ignored;
  fs::remove_all(root_, ignored);
}

void Cli::kill_when_there_is(const std::string& file, const Words& args) const {
  Words words{BALLOT_BINARY};
  words.insert(words.end(), args.begin(), args.end());
  auto argv = pointers(words);
  const std::string folder = path("").string(), out = (root_ / "streams/out").string(),
                    err = (root_ / "streams/err").string();
  const pid_t child = ::fork();
  if (child == 0) become(argv.data(), environ, folder.c_str(), out.c_str(), err.c_str());
  for (int i = 0; i < 6000 && !fs::exists(path(file)); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  ::kill(child, SIGKILL);
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status)) << "ballot ended before it was killed";
}

Result Cli::run(const Words& args, const Environment& more) const {
  Words words{BALLOT_BINARY};
  words.insert(words.end(), args.begin(), args.end());
  Environment changes = more;
  changes.emplace("XDG_CACHE_HOME", (root_ / "cache").string());
  changes.emplace("TMPDIR", (root_ / "temporary").string());
  Words environment = environment_with(changes);
  auto argv = pointers(words), envp = pointers(environment);
  const std::string folder = path("").string(), out = (root_ / "streams/out").string(),
                    err = (root_ / "streams/err").string();
  const pid_t child = ::fork();
  if (child == 0) become(argv.data(), envp.data(), folder.c_str(), out.c_str(), err.c_str());
  int status = 0;
  if (child < 0 || ::waitpid(child, &status, 0) != child)
    throw std::runtime_error("cannot start ballot, or cannot wait for it to end");
  const Result result{WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_all(out), read_all(err)};
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
