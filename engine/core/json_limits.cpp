#include "engine/core/json_limits.h"

#include <cstdint>

#include "engine/core/error.h"
#include "engine/core/memory.h"

namespace ballot {
namespace {

/// What is counted in a JSON text outside of its strings.
struct JsonCounts {
  std::uint64_t values = 1, containers = 0, members = 0, strings = 0;
  std::size_t too_deep = 0;  // the byte after the one that opens bracket kMaxJsonDepth + 1; 0: none does
};

/// Counts in one pass, without a parser.
JsonCounts counts_of(std::string_view json) {
  JsonCounts counts;
  int depth = 0;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (c == '"') {
      ++counts.strings;
      while (++i < json.size() && json[i] != '"')
        if (json[i] == '\\') ++i;
    }
    if (c == ',') ++counts.values;
    if (c == ':') ++counts.members;
    if (c == ']' || c == '}') --depth;
    if (c != '[' && c != '{') continue;
    ++counts.values, ++counts.containers;
    if (++depth > kMaxJsonDepth && counts.too_deep == 0) counts.too_deep = i + 1;
  }
  return counts;
}

/// A value takes 16 bytes, of arrays that double as they grow; the rest are pieces of the heap.
std::uint64_t bytes_of(const JsonCounts& counts, std::size_t text) {
  return 32 * counts.values + 64 * counts.containers + 96 * counts.members + 48 * counts.strings + text;
}

}  // namespace

void check_json(const std::filesystem::path& path, std::string_view json) {
  const JsonCounts counts = counts_of(json);
  if (counts.too_deep > 0)
    fail(Failure::Work, "{}: its JSON nests deeper than {} brackets at byte {}; expected at most that", path.string(),
         kMaxJsonDepth, counts.too_deep - 1);
  need_memory(bytes_of(counts, json.size()), fmt::format("{}: its JSON of {} bytes", path.string(), json.size()));
}

}  // namespace ballot
