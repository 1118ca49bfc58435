// JSON as text.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace ballot {

/// Returns a JSON file's text. Names of files may be any bytes, but JSON is UTF-8: a byte that is not becomes U+FFFD.
inline std::string json_text(const nlohmann::json& json, int indent = 1) {
  return json.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace ballot
