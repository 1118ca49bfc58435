#include "engine/core/memory.h"

#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

#include "engine/core/error.h"

namespace ballot {
namespace {

constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();
constexpr std::uint64_t kAlwaysFits = 16 << 20;

std::atomic<std::uint64_t> memory_limit{0};

/// Returns the number behind a word in a file of lines "word number ...", or behind the start of it for the word "".
std::uint64_t number_in(const std::filesystem::path& file, std::string_view word, std::uint64_t otherwise) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with(word)) continue;
    const std::size_t at = line.find_first_not_of(" \t", word.size());
    std::uint64_t value = 0;
    if (at == std::string::npos ||
        std::from_chars(line.data() + at, line.data() + line.size(), value).ec != std::errc{})
      return otherwise;  // such as "max"
    return value;
  }
  return otherwise;
}

std::uint64_t rest_of(std::uint64_t most, std::uint64_t used) { return most > used ? most - used : 0; }

/// Returns what is left in the control group of this process (version 2) and in those above it.
std::uint64_t group_left() {
  const std::filesystem::path root = "/sys/fs/cgroup";
  std::ifstream in("/proc/self/cgroup");
  std::uint64_t left = kNoLimit;
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with("0::/")) continue;
    for (std::filesystem::path group = line.substr(4);; group = group.parent_path()) {
      const std::filesystem::path folder = root / group;
      const std::uint64_t most = number_in(folder / "memory.max", "", kNoLimit);
      if (most != kNoLimit) {
        const std::uint64_t used = number_in(folder / "memory.current", "", 0);
        const std::uint64_t files = number_in(folder / "memory.stat", "inactive_file", 0);  // given back when needed
        left = std::min(left, rest_of(most, rest_of(used, files)));
      }
      if (group.empty()) break;
    }
  }
  return left;
}

/// The pages of this process.
struct OwnMemory {
  std::uint64_t space = 0, resident = 0, data = 0;  // bytes
};

OwnMemory own_memory() {
  std::ifstream in("/proc/self/statm");
  OwnMemory own;
  std::uint64_t shared = 0, code = 0, none = 0;
  in >> own.space >> own.resident >> shared >> code >> none >> own.data;
  const auto page = static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  return {own.space * page, own.resident * page, own.data * page};
}

/// Returns what is left below the limits on the address space and on data.
std::uint64_t space_left(const OwnMemory& own) {
  std::uint64_t left = kNoLimit;
  rlimit most{};
  if (::getrlimit(RLIMIT_AS, &most) == 0 && most.rlim_cur != RLIM_INFINITY) left = rest_of(most.rlim_cur, own.space);
  if (::getrlimit(RLIMIT_DATA, &most) == 0 && most.rlim_cur != RLIM_INFINITY)
    left = std::min(left, rest_of(most.rlim_cur, own.data));
  return left;
}

}  // namespace

void set_memory_limit(std::uint64_t bytes) { memory_limit = bytes; }

std::uint64_t memory_left() {
  const std::uint64_t kib = number_in("/proc/meminfo", "MemAvailable:", kNoLimit);
  std::uint64_t left = std::min(kib == kNoLimit ? kNoLimit : kib * 1024, group_left());
  const OwnMemory own = own_memory();
  left = std::min(left, space_left(own));
  if (const std::uint64_t most = memory_limit; most > 0) left = std::min(left, rest_of(most, own.resident));
  return left;
}

void need_memory(std::uint64_t bytes, std::string_view what, std::string_view advice) {
  const std::uint64_t most = memory_limit;
  if (most == 0 && bytes < kAlwaysFits) return;
  const std::uint64_t left = memory_left();
  if (bytes <= left) return;
  fail(Failure::Work, "{} needs about {} of memory, but {} is left{}; {}{}", what, size_text(bytes), size_text(left),
       most > 0 ? fmt::format(" of the limit of {}", size_text(most)) : "", advice,
       most > 0 ? " or raise --memory" : " or a machine with more");
}

void need_driver_space(std::uint64_t bytes, std::size_t threads, std::string_view what) {
  const std::uint64_t left = space_left(own_memory());
  if (left == kNoLimit) return;
  constexpr std::uint64_t kUnlimitedStack = 2 << 20, kBeside = 8 << 20;  // what a thread takes beside its stack
  rlimit stack{};
  const bool limited = ::getrlimit(RLIMIT_STACK, &stack) == 0 && stack.rlim_cur != RLIM_INFINITY;
  bytes += threads * ((limited ? stack.rlim_cur : kUnlimitedStack) + kBeside);
  if (bytes > left)
    fail(Failure::Device,
         "{} needs about {} of address space, but {} is left below the limit of ulimit -v or -d; raise it", what,
         size_text(bytes), size_text(left));
}

void spare_address_space() {
  rlimit space{};
  if (::getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY) ::mallopt(M_ARENA_MAX, 1);
}

void release_pages(std::span<const std::byte> used) {
  const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const auto first = reinterpret_cast<std::uintptr_t>(used.data());
  const std::uintptr_t begin = (first + page - 1) / page * page, end = (first + used.size()) / page * page;
  if (end > begin) ::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_DONTNEED);
}

std::string size_text(std::uint64_t bytes) {
  constexpr std::array<const char*, 5> kUnits{"bytes", "KiB", "MiB", "GiB", "TiB"};
  auto value = static_cast<double>(bytes);
  std::size_t unit = 0;
  while (value >= 1024 && unit + 1 < kUnits.size()) value /= 1024, ++unit;
  return unit == 0 ? fmt::format("{} bytes", bytes) : fmt::format("{:.2f} {}", value, kUnits[unit]);
}

std::uint64_t parse_bytes(std::string_view text, std::string_view option) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  std::string_view unit = text.substr(static_cast<std::size_t>(end - text.data()));
  double scale = 1;
  if (constexpr std::string_view kUnits = "KMGT"; !unit.empty() && kUnits.find(unit[0]) != std::string_view::npos) {
    scale = std::exp2(10.0 * static_cast<double>(kUnits.find(unit[0]) + 1));
    unit.remove_prefix(1);
    if (unit == "iB" || unit == "B") unit = {};
  }
  if (error != std::errc{} || !unit.empty() || !(value * scale >= 1) || !(value * scale < 9e18))
    fail(Failure::Arguments, "{} {}: expected a size in bytes, such as 512M or 4G", option, text);
  return static_cast<std::uint64_t>(value * scale);
}

}  // namespace ballot
