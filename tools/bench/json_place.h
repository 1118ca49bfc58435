// A value of a JSON file together with its place in the file, so that error messages can name both.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/ballot.h"

namespace ballot::bench {

class JsonPlace {
 public:
  /// Keeps a reference to `value`. `advice` ends error messages: what to do about a wrong file.
  JsonPlace(const nlohmann::json& value, std::string file, const char* advice, std::string place = {})
      : value_(&value), file_(std::move(file)), advice_(advice), place_(std::move(place)) {}

  // All functions below except is_null() throw as wrong() does if the value has another type or range.

  std::optional<JsonPlace> find(const std::string& key) const {
    if (!value_->is_object()) wrong("an object");
    const auto found = value_->find(key);
    if (found == value_->end()) return std::nullopt;
    return JsonPlace(*found, file_, advice_, place_.empty() ? key : place_ + "." + key);
  }
  JsonPlace at(const std::string& key) const {
    if (const auto found = find(key)) return *found;
    wrong("an object with '" + key + "'");
  }
  std::vector<JsonPlace> items() const {
    if (!value_->is_array()) wrong("a list");
    std::vector<JsonPlace> all;
    for (std::size_t i = 0; i < value_->size(); ++i)
      all.emplace_back((*value_)[i], file_, advice_, fmt::format("{}[{}]", place_, i));
    return all;
  }
  std::vector<std::pair<std::string, JsonPlace>> members() const {
    if (!value_->is_object()) wrong("an object");
    std::vector<std::pair<std::string, JsonPlace>> all;
    for (const auto& [key, value] : value_->items())
      all.emplace_back(key, JsonPlace(value, file_, advice_, place_ + "." + key));
    return all;
  }

  bool is_null() const { return value_->is_null(); }
  std::string text() const {
    if (!value_->is_string()) wrong("a text");
    return value_->get<std::string>();
  }
  double number() const {
    if (!value_->is_number()) wrong("a number");
    return value_->get<double>();
  }
  double positive() const {
    const double n = number();
    if (!(n > 0) || !std::isfinite(n)) wrong("a number above 0");
    return n;
  }
  std::uint64_t count() const {
    if (!value_->is_number_unsigned()) wrong("a whole number of 0 or more");
    return value_->get<std::uint64_t>();
  }
  std::uint32_t small_count() const {
    const std::uint64_t n = count();
    if (n > 0xFFFFFFFFu) wrong("a whole number below 2^32");
    return std::uint32_t(n);
  }
  bool truth() const {
    if (!value_->is_boolean()) wrong("true or false");
    return value_->get<bool>();
  }

  /// Throws Error(Work) that names file and place, the value found, shortened to 40 characters, and the one expected.
  [[noreturn]] void wrong(const std::string& expected) const {
    std::string found = value_->dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    if (found.size() > 40) found = found.substr(0, 40) + "...";
    fail(Failure::Work, "{}: {}: expected {}, found {}; {}", file_, place_.empty() ? "top level" : place_, expected,
         found, advice_);
  }

 private:
  const nlohmann::json* value_;
  std::string file_;
  const char* advice_;
  std::string place_;
};

/// Parses the bytes of a JSON file. `expected` and `advice` are for error messages, as in JsonPlace.
/// Throws Error(Work) that names the file and the byte at which it stops being JSON, or nests too deep.
inline nlohmann::json parse_json(const std::filesystem::path& path, std::span<const std::byte> bytes,
                                 const std::string& expected, const char* advice) {
  const std::string_view text = without_mark(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  check_json(path, text);
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    fail(Failure::Work, "{}: expected {}, found something else at byte {} of {}; {}", path.string(), expected,
         error.byte, text.size(), advice);
  } catch (const nlohmann::json::out_of_range&) {  // such as 1e999
    fail(Failure::Work, "{}: expected {}, found a number that no double can hold; {}", path.string(), expected, advice);
  }
}

/// Parses a JSON file that the user names, as above. Throws Error(Work) also if it cannot be read.
inline nlohmann::json parse_json(const std::filesystem::path& path, const std::string& expected, const char* advice) {
  return parse_json(path, read_argument(path), expected, advice);
}

}  // namespace ballot::bench
