#include "tests/fuzz/fuzz.h"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "engine/core/error.h"
#include "engine/core/memory.h"

namespace ballot::fuzz {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMemory = std::uint64_t{1} << 30;  // files that claim more are refused

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

void finding(const char* what, const char* text) {
  std::fprintf(stderr, "finding: %s: %s\n", what, text);
  std::abort();
}

/// Writes `word` as a line of libFuzzer's dictionaries.
std::string dictionary_line(const std::string& word) {
  std::string line = "\"";
  for (const char c : word) {
    char text[5];
    std::snprintf(text, sizeof(text), "\\x%02X", static_cast<unsigned>(static_cast<unsigned char>(c)));
    line += text;
  }
  return line + "\"\n";
}

/// Writes the seeds and, beside the folder, the dictionary.
int write_seeds(const fs::path& folder) {
  fs::create_directories(folder);
  int number = 0;
  for (const std::string& seed : seeds())
    std::ofstream(folder / ("seed-" + std::to_string(number++)), std::ios::binary) << seed;
  std::ofstream dictionary(folder.string() + ".dict");
  for (const std::string& word : words()) dictionary << dictionary_line(word);
  return number > 0 && dictionary ? 0 : 1;
}

}  // namespace

fs::path put(const std::string& name, std::string_view content) {
  static const Folder folder;
  const fs::path path = folder.path / name;
  std::ofstream(path, std::ios::binary | std::ios::trunc)
      .write(content.data(), static_cast<std::streamsize>(content.size()));
  return path;
}

void expect_plain(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    for (const char* raw : {"std::", "vector::", "basic_string", "json.exception", "bad_", "_M_", "map::at"})
      if (std::strstr(error.what(), raw)) finding("a raw text", error.what());
  } catch (const std::bad_alloc&) {  // an error of one line, too
  } catch (const std::exception& error) {
    finding("an exception that is no Error", error.what());
  }
}

}  // namespace ballot::fuzz

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  if (*argc == 3 && std::strcmp((*argv)[1], "--seeds") == 0) std::exit(ballot::fuzz::write_seeds((*argv)[2]));
  ballot::set_memory_limit(ballot::fuzz::kMemory);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ballot::fuzz::read({reinterpret_cast<const char*>(data), size});
  return 0;
}
