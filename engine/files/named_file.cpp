#include "engine/files/named_file.h"

#include <algorithm>
#include <cctype>

#include "engine/files/flaw.h"

namespace ballot {
namespace {

/// Returns the scheme of a name such as http://host/file, with "://"; "" if it has none. "file:" needs no slashes.
std::string_view scheme_of(std::string_view name) {
  const std::size_t end = name.find(':');
  if (end == std::string_view::npos || end < 2) return {};
  const auto fits = [](unsigned char c) { return std::isalnum(c) != 0 || c == '+' || c == '-' || c == '.'; };
  if (!std::ranges::all_of(name.substr(0, end), fits)) return {};
  const bool slashes = name.substr(end).starts_with("://");
  if (!slashes && name.substr(0, end) != "file") return {};
  return name.substr(0, end + (slashes ? 3 : 1));
}

/// Returns true if links lead from a name in a folder out of it.
bool leads_out(std::filesystem::path folder, const std::filesystem::path& name) {
  if (folder.empty()) folder = ".";
  std::error_code error;
  const std::filesystem::path within = std::filesystem::canonical(folder, error);
  const std::filesystem::path target = error ? within : std::filesystem::weakly_canonical(folder / name, error);
  return !error && std::ranges::mismatch(within, target).in1 != within.end();
}

}  // namespace

std::string decoded_uri(std::string_view uri) {
  const auto digit = [](char c) {
    return c >= '0' && c <= '9' ? c - '0' : (c | 32) >= 'a' && (c | 32) <= 'f' ? (c | 32) - 'a' + 10 : -1;
  };
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '%' && i + 2 < uri.size() && digit(uri[i + 1]) >= 0 && digit(uri[i + 2]) >= 0) {
      text.push_back(static_cast<char>(digit(uri[i + 1]) * 16 + digit(uri[i + 2])));
      i += 2;
    } else {
      text.push_back(uri[i]);
    }
  }
  return text;
}

std::string why_refused(const std::filesystem::path& scene, std::string_view name, bool allow_outside) {
  if (name.find('\0') != std::string_view::npos) return "holds a zero byte; expected the name of a file";
  if (const std::string_view scheme = scheme_of(name); !scheme.empty())
    return fmt::format("has the scheme {}; Ballot reads files alone: put the file beside the scene and name it there",
                       scheme);
  if (allow_outside) return {};
  const std::filesystem::path path = std::filesystem::path(name).lexically_normal();
  if (path.is_absolute()) return "is an absolute path; expected a file in the scene's folder; --allow-outside reads it";
  if (!path.empty() && *path.begin() == "..")
    return "lies outside of the scene's folder; expected a file in it; --allow-outside reads it";
  if (leads_out(scene.parent_path(), name))
    return "is a link that leads out of the scene's folder; expected a file in it; --allow-outside reads it";
  return {};
}

std::filesystem::path named_file(const std::filesystem::path& scene, std::string_view name, bool allow_outside,
                                 std::string_view what) {
  if (const std::string reason = why_refused(scene, name, allow_outside); !reason.empty())
    refuse("{} names '{}', which {}", what, name.substr(0, 300), reason);
  return scene.parent_path() / name;
}

}  // namespace ballot
