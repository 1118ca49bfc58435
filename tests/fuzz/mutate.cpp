#include "tests/fuzz/mutate.h"

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

namespace ballot::fuzz {

namespace {

using Json = nlohmann::json;

std::size_t below(Random& random, std::size_t count) { return count == 0 ? 0 : random() % count; }

/// Lists all values of a document. Nothing may be changed while the list is in use, but for one of them.
void list_values(Json& value, std::vector<Json*>& all) {
  all.push_back(&value);
  if (value.is_structured())
    for (Json& each : value) list_values(each, all);
}

Json number_of_the_edges(Random& random) {
  static const Json kNumbers = {0,
                                1,
                                -1,
                                2,
                                3,
                                4,
                                127,
                                255,
                                256,
                                65535,
                                2147483647,
                                2147483648,
                                4294967295,
                                4294967296,
                                -2147483648LL,
                                1e308,
                                -1e308,
                                1e-308,
                                0.5,
                                1e19,
                                9007199254740993LL,
                                9223372036854775807LL,
                                18446744073709551615ULL};
  return kNumbers[below(random, kNumbers.size())];
}

/// Words of dictionaries are written as they stand in a file, so names of members come in quotes.
std::string without_quotes(std::string word) {
  if (word.size() > 1 && word.front() == '"' && word.back() == '"') word = word.substr(1, word.size() - 2);
  return std::ranges::all_of(word, [](unsigned char c) { return c >= 32 && c < 127; }) ? word : "";
}

std::string some_word(const std::vector<std::string>& words, Random& random) {
  return words.empty() ? "" : without_quotes(words[below(random, words.size())]);
}

void replace_value(Json& value, const std::vector<Json*>& all, const std::vector<std::string>& words, Random& random) {
  switch (below(random, 6)) {
    case 0:
      value = number_of_the_edges(random);
      return;
    case 1:
      value = value.is_number() ? Json(value.get<double>() * 2) : Json(nullptr);
      return;
    case 2:
      value = some_word(words, random);
      return;
    case 3:
      value = below(random, 2) ? Json::array() : Json::object();
      return;
    default: {
      const Json copy = *all[below(random, all.size())];  // of itself or of a value around it, too
      value = copy;
    }
  }
}

void change_members(Json& value, const std::vector<std::string>& words, Random& random) {
  if (value.is_array()) {
    const std::size_t at = below(random, value.size());
    if (value.empty() || below(random, 2)) {
      const Json copy = value.empty() ? number_of_the_edges(random) : value[at];
      for (std::size_t i = 0, count = 1 + below(random, 4); i < count; ++i) value.push_back(copy);
    } else {
      value.erase(at);
    }
    return;
  }
  if (value.empty() || below(random, 3) == 0) {
    value[some_word(words, random)] = number_of_the_edges(random);
    return;
  }
  auto member = value.begin();
  std::advance(member, static_cast<std::ptrdiff_t>(below(random, value.size())));
  const Json content = member.value();
  if (below(random, 2)) value[some_word(words, random)] = content;
  value.erase(member.key());
}

bool change_json(std::string& text, const std::vector<std::string>& words, std::size_t most, Random& random) {
  Json json = Json::parse(text, nullptr, false);
  if (json.is_discarded()) return false;
  for (std::size_t i = 0, changes = 1 + below(random, 3); i < changes; ++i) {
    std::vector<Json*> all;
    list_values(json, all);
    Json& value = *all[below(random, all.size())];
    if (value.is_structured() && below(random, 4))
      change_members(value, words, random);
    else
      replace_value(value, all, words, random);
  }
  std::string changed = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (changed.size() > most) return false;
  text = std::move(changed);
  return true;
}

std::uint32_t word_at(const std::string& bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, sizeof word);
  return word;
}

void append_chunk(std::string& bytes, const char* kind, const std::string& content) {
  const auto size = static_cast<std::uint32_t>(content.size());
  bytes.append(reinterpret_cast<const char*>(&size), sizeof size).append(kind, 4).append(content);
}

/// Changes the JSON or the buffer of a binary glTF file and puts it together again, so that its sizes agree.
bool change_gltf(std::string& input, const std::vector<std::string>& words, std::size_t most, Random& random,
                 const BytesChange& change) {
  if (!input.starts_with("glTF")) return change_json(input, words, most, random);
  if (input.size() < 20 || word_at(input, 12) > input.size() - 20) return false;
  const std::size_t end = 20 + word_at(input, 12);
  std::string json = input.substr(20, end - 20), buffer = input.size() >= end + 8 ? input.substr(end + 8) : "";
  if (json.size() + buffer.size() + 64 > most) return false;
  const std::size_t room = most - json.size() - buffer.size() - 64;
  if (below(random, 4) == 0)
    change(buffer, buffer.size() + room);
  else if (!change_json(json, words, json.size() + room, random))
    return false;
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string whole("glTF\2\0\0\0\0\0\0\0", 12);
  append_chunk(whole, "JSON", json);
  if (!buffer.empty()) append_chunk(whole, "BIN\0", buffer);
  const auto size = static_cast<std::uint32_t>(whole.size());
  std::memcpy(whole.data() + 8, &size, sizeof size);
  input = std::move(whole);
  return true;
}

void write_number(std::string& bytes, std::size_t at, Random& random) {
  static constexpr std::uint64_t kNumbers[] = {
      0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x7FC00000, 0x7F800000, ~0ull};
  const std::uint64_t number = kNumbers[below(random, std::size(kNumbers))];
  std::memcpy(bytes.data() + at, &number, std::min<std::size_t>(std::size_t{1} << below(random, 4), bytes.size() - at));
}

void change_bytes(std::string& bytes, std::size_t most, const std::vector<std::string>& words, Random& random) {
  const std::size_t at = below(random, bytes.size()), length = 1 + below(random, 16);
  switch (bytes.empty() ? 4 : below(random, 7)) {
    case 0:
      bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(random, 8)));
      break;
    case 1:
      bytes[at] = static_cast<char>(random());
      break;
    case 2:
      write_number(bytes, at, random);
      break;
    case 3:
      bytes.erase(at, below(random, 8) ? length : bytes.size());
      break;
    case 4:
      if (!words.empty()) bytes.insert(at, words[below(random, words.size())]);
      break;
    case 5:
      bytes.insert(below(random, bytes.size()), bytes.substr(at, length));
      break;
    default:
      bytes.replace(at, length, bytes.substr(below(random, bytes.size()), length));
  }
  if (bytes.size() > most) bytes.resize(most);
}

}  // namespace

BytesChange simple_change(Random& random, const std::vector<std::string>& words) {
  return [&](std::string& bytes, std::size_t most) {
    for (std::size_t i = 0, changes = 1 + below(random, 4); i < changes; ++i) change_bytes(bytes, most, words, random);
  };
}

void mutate(std::string& input, const Target& target, std::size_t most, Random& random, const BytesChange& change) {
  if (below(random, 4) == 0 || target.form == Form::Bytes) return change(input, most);
  const bool done = target.form == Form::Gltf ? change_gltf(input, target.words, most, random, change)
                                              : change_json(input, target.words, most, random);
  if (!done) change(input, most);
}

}  // namespace ballot::fuzz
