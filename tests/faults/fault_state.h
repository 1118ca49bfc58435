// What the layer of the tests counts, and which call it makes fail.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <map>
#include <mutex>
#include <string>

namespace fault {

/// Of the process; guarded by `mutex`.
struct State {
  std::mutex mutex;
  std::string kind;
  unsigned long at = 0;
  std::map<std::string, unsigned long> calls;  // by kind
  std::map<std::string, long> live;            // objects by function that made them
  bool lost = false;
  State() {
    const char* text = std::getenv("BALLOT_FAULT");
    const std::string fault = text ? text : "none";
    kind = fault.substr(0, fault.find(':'));
    if (kind != fault) at = std::strtoul(fault.c_str() + kind.size() + 1, nullptr, 10);
  }
};

inline State& state() {
  static State all;
  return all;
}

/// Counts a call of a kind. Returns true if it is the one that fails.
inline bool fails(const char* kind) {
  const std::lock_guard lock(state().mutex);
  return ++state().calls[kind] == state().at && state().kind == kind;
}

inline bool is_lost() {
  const std::lock_guard lock(state().mutex);
  return state().lost;
}

inline void lose() {
  const std::lock_guard lock(state().mutex);
  state().lost = true;
}

/// Notes how many bytes of a pipeline cache the driver was given.
inline void note_cache(std::size_t bytes) {
  const std::lock_guard lock(state().mutex);
  state().calls["cache"] = bytes;
}

inline void count(const char* object, long change) {
  const std::lock_guard lock(state().mutex);
  state().live[object] += change;
}

/// Appends what was counted and which objects are left to the file of BALLOT_FAULT_LOG.
inline void write_log() {
  const char* path = std::getenv("BALLOT_FAULT_LOG");
  std::FILE* file = path ? std::fopen(path, "a") : nullptr;
  if (!file) return;
  for (const char* kind : {"allocate", "submit", "wait", "outdated", "cache"})
    std::fprintf(file, "%s %lu ", kind, state().calls[kind]);
  std::string left;
  for (const auto& [object, number] : state().live)
    if (number != 0) left += " " + object + "=" + std::to_string(number);
  std::fprintf(file, "left:%s\n", left.c_str());
  std::fclose(file);
}

}  // namespace fault
