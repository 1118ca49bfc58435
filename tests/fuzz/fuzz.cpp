#include "tests/fuzz/fuzz.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "engine/core/error.h"
#include "engine/core/memory.h"

namespace ballot::fuzz {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMemory = std::uint64_t{2} << 30;  // with what a sanitizer keeps

struct Row {
  const char* name;
  Target (*make)();
};
constexpr Row kTargets[] = {{"bvh", bvh_target},         {"cache", cache_target}, {"checkpoint", checkpoint_target},
                            {"command", command_target}, {"exr", exr_target},     {"gltf", gltf_target},
                            {"mesh", mesh_target},       {"npy", npy_target},     {"obj", obj_target},
                            {"views", views_target}};

constexpr const char* kRaw[] = {"std::",       "vector::", "basic_string", "json.exception",      "bad_alloc",
                                "bad_variant", "_M_",      "map::at",      "fault inside Ballot", "terminate called"};

std::string_view current;  // the input that is read

#ifdef __clang__
#define BALLOT_UNSEEN __attribute__((no_sanitize("coverage")))
#else
#define BALLOT_UNSEEN
#endif

/// Returns true if a text holds a word. libFuzzer watches comparisons, and would put the words into inputs, which
/// errors quote.
BALLOT_UNSEEN bool holds(std::string_view text, const char* word) {
  for (std::size_t at = 0; at < text.size(); ++at) {
    std::size_t i = 0;
    while (word[i] != 0 && at + i < text.size() && text.data()[at + i] == word[i]) ++i;
    if (word[i] == 0) return true;
  }
  return false;
}

/// The folder of this process; removed at its end.
struct Folder {
  fs::path path;
  Folder() {
    std::error_code error;
    const fs::path root = fs::is_directory("/dev/shm", error) ? fs::path("/dev/shm") : fs::temp_directory_path();
    path = root / ("ballot-fuzz-" + std::to_string(::getpid()));
    fs::create_directories(path);
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
};

std::string from_hex(const std::string& text) {
  std::string digits, bytes;
  std::ranges::copy_if(text, std::back_inserter(digits), [](unsigned char c) { return std::isxdigit(c) != 0; });
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
    bytes.push_back(static_cast<char>(std::stoi(digits.substr(i, 2), nullptr, 16)));
  return bytes;
}

}  // namespace

std::vector<std::string> target_names() {
  std::vector<std::string> names;
  for (const Row& row : kTargets) names.emplace_back(row.name);
  return names;
}

Target find_target(std::string_view name) {
  for (const Row& row : kTargets)
    if (name == row.name) return row.make();
  return {};
}

std::vector<std::string> kept_inputs(std::string_view name) {
  const fs::path kept = fs::path(BALLOT_SOURCE_DIR) / "tests/fuzz/corpus" / name;
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(kept, error)) files.push_back(entry.path());
  std::ranges::sort(files);
  std::vector<std::string> inputs;
  for (const fs::path& file : files)
    inputs.push_back(file.extension() == ".hex" ? from_hex(bytes_in(file)) : bytes_in(file));
  return inputs;
}

void read_input(const Target& target, std::string_view input) {
  current = input;
  target.read(input);
}

void prepare() { set_memory_limit(kMemory); }

const fs::path& folder() {
  static const Folder own;
  return own.path;
}

fs::path put(const std::string& name, std::string_view content) {
  const fs::path path = folder() / name;
  std::ofstream(path, std::ios::binary | std::ios::trunc)
      .write(content.data(), static_cast<std::streamsize>(content.size()));
  return path;
}

std::string bytes_in(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void finding(std::string_view what, std::string_view text) {
  std::fprintf(stderr, "finding: %.*s: %.*s\n", int(what.size()), what.data(), int(text.size()), text.data());
  std::abort();
}

bool is_raw(std::string_view text) {
  return std::ranges::any_of(kRaw, [&](const char* word) { return holds(text, word) && !holds(current, word); });
}

void expect_plain(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    if (is_raw(error.what())) finding("a raw text", error.what());
  } catch (const std::bad_alloc&) {  // an error of one line, too
  } catch (const std::exception& error) {
    finding("an exception that is no Error", error.what());
  }
}

}  // namespace ballot::fuzz
