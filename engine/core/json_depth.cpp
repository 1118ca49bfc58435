#include "engine/core/json_depth.h"

#include "engine/core/error.h"

namespace ballot {

void check_json_depth(const std::filesystem::path& path, std::string_view json) {
  int depth = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (quoted) {
      if (c == '\\') ++i;
      if (c == '"') quoted = false;
      continue;
    }
    if (c == '"') quoted = true;
    if (c == ']' || c == '}') --depth;
    if ((c == '[' || c == '{') && ++depth > kMaxJsonDepth)
      fail(Failure::Work, "{}: its JSON nests deeper than {} brackets at byte {}; expected at most that", path.string(),
           kMaxJsonDepth, i);
  }
}

}  // namespace ballot
