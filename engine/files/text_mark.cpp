#include "engine/files/text_mark.h"

#include "engine/core/error.h"

namespace ballot {

std::string_view without_mark(const std::filesystem::path& path, std::string_view text) {
  using namespace std::string_view_literals;
  if (text.starts_with("\xEF\xBB\xBF"sv)) return text.substr(3);
  const bool wide = text.starts_with("\xFF\xFE\0\0"sv) || text.starts_with("\0\0\xFE\xFF"sv);
  if (wide || text.starts_with("\xFF\xFE"sv) || text.starts_with("\xFE\xFF"sv))
    fail(Failure::Work, "{}: is text in {}, as its byte order mark says; expected UTF-8; save it as that",
         path.string(), wide ? "UTF-32" : "UTF-16");
  return text;
}

}  // namespace ballot
