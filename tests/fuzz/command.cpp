// Command lines: each line of an input is an argument. There is no Vulkan loader, so a command ends where it asks for a
// device; what comes before, and the commands that need none, run as they are. They do so in the folder of this
// process, and no argument names another.
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "engine/files/image.h"
#include "engine/files/npy.h"
#include "tests/cpu/gltf_builder.h"
#include "tests/fuzz/fuzz.h"
#include "tools/program/program.h"

namespace ballot::fuzz {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kSweep = 200;  // command lines after which the folder is made anew

void write(const char* name, std::string_view content) {
  std::ofstream(fs::path(name), std::ios::binary).write(content.data(), std::ssize(content));
}

/// Makes the files that the words name, and enters their folder.
void enter_folder() {
  const fs::path home = folder() / "command";
  fs::current_path(folder());
  fs::remove_all(home);
  fs::create_directories(home);
  fs::current_path(home);
  write("s.glb", test::one_triangle().glb());
  write("v.json", R"({"views": [{"name": "a", "position": [0, 1, 2], "orientation": [0, 0, 0, 1], "yfov": 1}]})");
  const std::vector<Ray> rays(4, Ray{.origin = {0, 0, 2}, .t_min = 0, .dir = {0, 0, -1}, .t_max = 9});
  write_rays("r.npy", rays);
  for (const char* part : {"0/2", "1/2"}) {
    Image image{.width = 4, .height = 4};
    image.channels.push_back({"R", Pixel::Half, std::vector<float>(16, 0.5f), {}});
    image.attributes = {{"part", std::string(part)}, {"seconds", 1.0f}};
    write_exr(part[0] == '0' ? "p0.exr" : "p1.exr", image);
  }
}

/// An open file in memory in place of a stream of this process.
class Captured {
 public:
  explicit Captured(int stream) : stream_(stream), file_(::memfd_create("stream", MFD_CLOEXEC)) {}
  void begin() {
    (void)!::ftruncate(file_, 0);
    ::lseek(file_, 0, SEEK_SET);
    old_ = ::dup(stream_);
    ::dup2(file_, stream_);
  }
  std::string end() {
    ::dup2(old_, stream_);
    ::close(old_);
    std::string text(std::size_t(::lseek(file_, 0, SEEK_END)), '\0');
    text.resize(std::size_t(std::max<ssize_t>(0, ::pread(file_, text.data(), text.size(), 0))));
    return text;
  }

 private:
  int stream_, file_, old_ = -1;
};

/// Returns the arguments of an input; none if it is a command line that must not run here.
std::vector<std::string> arguments_of(std::string_view input) {
  std::vector<std::string> words{"ballot"};
  while (!input.empty() && words.size() < 40) {
    const std::size_t end = std::min(input.find('\n'), input.size());
    std::string word(input.substr(0, end));
    std::erase(word, '\0');
    if (word != "/dev/stdout" && word != "/dev/full") std::ranges::replace(word, '/', '_');
    words.push_back(std::move(word));
    input.remove_prefix(std::min(end + 1, input.size()));
  }
  for (const std::string& word : words)  // these write to the source tree, or compile for minutes
    if (word == "shaders" || word.starts_with("--write") || word == "..") return {};
  return words;
}

std::vector<std::string> command_seeds() {
  return {"render\ns.glb\n--view\nall\n--size\n16x16\n--spp\n2\n--out\no.exr\n--png\n--method\npacket\n--crop\n0,0,4,4",
          "trace\ns.glb\n--rays\nr.npy\n--out\nh.npy\n--knob\nvote=count\n--numeric\nexact\n--any",
          "bench\ns.glb\n--rays\nprimary,ao\n--methods\npacket,cut:threshold=3\n--json\nb2.json",
          "merge\np0.exr\np1.exr\n--out\nm.exr",
          "info\ns.glb\n--json\n-",
          "verify\ns.glb\n--rays\nr.npy\n--numeric\nplain,exact",
          "view\ns.glb\n--views-file\nv.json\n--shading\nheat",
          "distance\ns.glb\n--points\nr.npy\n--out\nd.npy",
          "check\ns.glb\n--memory\n512M",
          "methods",
          "inside\ns.glb\n--points\nr.npy\n--out\nd.npy\n--build\nfast\n--max-leaf\n2"};
}

std::vector<std::string> command_words() {
  return {"--out\n",
          "--json\n",
          "--size\n",
          "--spp\n",
          "--tiles\n1_2\n",
          "--crop\n",
          "--resume\n",
          "--frames\n",
          "--fps\n",
          "--time\n",
          "--animation\n",
          "--light\n",
          "--sky\n",
          "--reference\n",
          "--views-file\nv.json\n",
          "--method\n",
          "--methods\n",
          "--knob\n",
          "--numeric\n",
          "--rays\n",
          "--memory\n1\n",
          "--device\n",
          "--help\n",
          "-\n",
          "s.glb\n",
          "r.npy\n",
          "p0.exr\n",
          "v.json\n",
          "/dev/stdout\n",
          "/dev/full\n",
          "--seed\n4294967296\n",
          "-1\n",
          "nan\n",
          "1e39\n",
          "0x0\n",
          "99999x99999\n",
          "\xff\n"};
}

void read_command(std::string_view input) {
  static Captured out(STDOUT_FILENO), err(STDERR_FILENO);
  static std::size_t runs = 0;
  if (runs++ % kSweep == 0) {
    setenv("BALLOT_VULKAN_LOADER", "no-loader.so", 1);
    setenv("PATH", "/nonexistent", 1);
    setenv("XDG_CACHE_HOME", (folder() / "cache").c_str(), 1);
    for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY"}) unsetenv(name);
    enter_folder();
  }
  std::vector<std::string> words = arguments_of(input);
  if (words.empty()) return;
  std::vector<char*> list;
  for (std::string& word : words) list.push_back(word.data());
  list.push_back(nullptr);
  std::fflush(stdout);
  out.begin();
  err.begin();
  const int code = cli::program(int(words.size()), list.data());
  std::fflush(stdout);
  const std::string errors = err.end(), text = out.end();
  std::clearerr(stdout);
  prepare();
  if (code < 0 || code > int(Failure::Device)) finding("an unknown exit code", std::to_string(code));
  if (code != 0 && errors.find("ballot: ") == std::string::npos && text.empty())
    finding("a failure without a message", errors);
  if (is_raw(errors)) finding("a raw text", errors);
}

}  // namespace

Target command_target() { return {"command", Form::Bytes, command_seeds(), command_words(), read_command}; }

}  // namespace ballot::fuzz
