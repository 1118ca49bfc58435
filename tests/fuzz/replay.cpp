// The short run of the fuzz targets, with any compiler and without libFuzzer: the seeds, the inputs that are kept, and
// mutations of them, which are the same in every run.
//   ballot_fuzz_replay [--inputs N] [--seed S] [TARGET ...]
//   ballot_fuzz_replay TARGET --file FILE
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include <unistd.h>

#include "tests/fuzz/mutate.h"

namespace ballot::fuzz {

namespace {

const char* running = "";  // the target
std::size_t number = 0;    // of the input
const std::string* input = nullptr;
std::string kept_as;  // the file that an input which ends the process is written to

/// Keeps the input that ends the process and says where. Calls only what POSIX allows in a handler of signals.
void report(int signal) {
  char line[256];
  const int length = std::snprintf(line, sizeof line, "target %s: input %zu ended by signal %d; it is %s\n", running,
                                   number, signal, kept_as.c_str());
  (void)!::write(STDERR_FILENO, line, std::size_t(length));
  if (std::FILE* file = std::fopen(kept_as.c_str(), "wb"); file && input) {
    std::fwrite(input->data(), 1, input->size(), file);
    std::fclose(file);
  }
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void begin(const Target& target) {
  static const std::filesystem::path start = std::filesystem::current_path();  // targets may go to other folders
  running = target.name;
  number = 0;
  kept_as = (start / (std::string("crash-") + running)).string();
}

void read_one(const Target& target, const std::string& bytes) {
  input = &bytes;
  ++number;
  read_input(target, bytes);
}

void replay(const Target& target, std::size_t inputs, unsigned seed) {
  begin(target);
  std::vector<std::string> pool = target.seeds;
  for (std::string& kept : kept_inputs(target.name)) pool.push_back(std::move(kept));
  for (const std::string& each : pool) read_one(target, each);
  Random random(seed);
  const BytesChange change = simple_change(random, target.words);
  while (number < inputs) {
    std::string next = pool[random() % pool.size()];
    for (std::size_t i = 0, changes = 1 + random() % 4; i < changes; ++i)
      mutate(next, target, target.largest, random, change);
    read_one(target, next);
  }
  std::printf("%s: %zu inputs, no finding\n", target.name, number);
}

int usage() {
  std::fprintf(stderr, "usage: ballot_fuzz_replay [--inputs N] [--seed S] [--file FILE] [TARGET ...]; targets:");
  for (const std::string& name : target_names()) std::fprintf(stderr, " %s", name.c_str());
  std::fprintf(stderr, "\n");
  return 2;
}

int run(int argc, char** argv) {
  std::size_t inputs = 1000;
  unsigned seed = 1;
  std::string file;
  std::vector<std::string> names;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.starts_with("--") && i + 1 == argc) return usage();
    if (word == "--inputs")
      inputs = std::strtoul(argv[++i], nullptr, 10);
    else if (word == "--seed")
      seed = unsigned(std::strtoul(argv[++i], nullptr, 10));
    else if (word == "--file")
      file = argv[++i];
    else
      names.push_back(word);
  }
  if (names.empty()) names = target_names();
  prepare();
  for (const int signal : {SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL}) std::signal(signal, report);
  for (const std::string& name : names) {
    const Target target = find_target(name);
    if (!target.read) return usage();
    if (file.empty()) {
      replay(target, inputs, seed);
      continue;
    }
    begin(target);
    read_one(target, bytes_in(file));
  }
  return 0;
}

}  // namespace

}  // namespace ballot::fuzz

int main(int argc, char** argv) { return ballot::fuzz::run(argc, argv); }
