// The campaigns' program: libFuzzer over the target that the environment variable BALLOT_FUZZ_TARGET names.
//   ballot_fuzz --targets                                 lists the targets
//   BALLOT_FUZZ_TARGET=obj ballot_fuzz --seeds FOLDER     writes the seeds, and the dictionary FOLDER.dict
//   BALLOT_FUZZ_TARGET=obj ballot_fuzz CORPUS SEEDS ...   as libFuzzer's manual has it
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "tests/fuzz/mutate.h"

// Of libFuzzer; its own changes, with the dictionary and what it learns from comparisons.
extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);

namespace ballot::fuzz {

namespace {

const Target& target() {
  static const Target chosen = [] {
    const char* name = std::getenv("BALLOT_FUZZ_TARGET");
    Target found = find_target(name ? name : "");
    if (!found.read) {
      std::fprintf(stderr, "BALLOT_FUZZ_TARGET: there is no target '%s'; there are:", name ? name : "");
      for (const std::string& each : target_names()) std::fprintf(stderr, " %s", each.c_str());
      std::fprintf(stderr, "\n");
      std::exit(2);
    }
    return found;
  }();
  return chosen;
}

/// Returns `word` as a line of libFuzzer's dictionaries.
std::string dictionary_line(const std::string& word) {
  std::string line = "\"";
  for (const char c : word) {
    char text[5];
    std::snprintf(text, sizeof(text), "\\x%02X", static_cast<unsigned>(static_cast<unsigned char>(c)));
    line += text;
  }
  return line + "\"\n";
}

int write_seeds(const std::filesystem::path& seeds) {
  std::error_code error;
  std::filesystem::create_directories(seeds, error);
  std::vector<std::string> inputs = target().seeds;
  for (std::string& kept : kept_inputs(target().name)) inputs.push_back(std::move(kept));
  bool good = !inputs.empty();
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    std::ofstream file(seeds / ("seed-" + std::to_string(i)), std::ios::binary);
    file << inputs[i];
    good = good && file.flush().good();
  }
  std::ofstream dictionary(seeds.string() + ".dict");
  for (const std::string& word : target().words) dictionary << dictionary_line(word);
  if (good && dictionary.flush()) return 0;
  std::fprintf(stderr, "cannot write the seeds to %s\n", seeds.c_str());
  return 1;
}

void change_by_libfuzzer(std::string& bytes, std::size_t most) {
  std::vector<std::uint8_t> room(std::max(most, bytes.size()) + 1);
  std::memcpy(room.data(), bytes.data(), bytes.size());
  const std::size_t size = LLVMFuzzerMutate(room.data(), bytes.size(), std::max(most, bytes.size()));
  bytes.assign(reinterpret_cast<const char*>(room.data()), size);
}

}  // namespace

}  // namespace ballot::fuzz

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  if (*argc == 2 && std::strcmp((*argv)[1], "--targets") == 0) {
    for (const std::string& name : ballot::fuzz::target_names()) std::puts(name.c_str());
    std::exit(0);
  }
  if (*argc == 3 && std::strcmp((*argv)[1], "--seeds") == 0) std::exit(ballot::fuzz::write_seeds((*argv)[2]));
  ballot::fuzz::target();
  ballot::fuzz::prepare();
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ballot::fuzz::read_input(ballot::fuzz::target(), {reinterpret_cast<const char*>(data), size});
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed) {
  using namespace ballot::fuzz;
  Random random(seed);
  std::string input(reinterpret_cast<const char*>(data), size);
  mutate(input, target(), std::min(most, target().largest), random, change_by_libfuzzer);
  input.resize(std::min(input.size(), most));
  std::memcpy(data, input.data(), input.size());
  return input.size();
}
