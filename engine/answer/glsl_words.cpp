#include "engine/answer/glsl_words.h"

#include <algorithm>
#include <cctype>

namespace ballot {

namespace {

bool is_letter(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

void add_words(std::string_view text, std::vector<std::string_view>& to) {
  for (std::size_t i = 0; i < text.size();) {
    std::size_t end = i + 1;
    if (is_letter(text[i]))
      while (end < text.size() && is_letter(text[end])) ++end;
    if (!std::isspace(static_cast<unsigned char>(text[i]))) to.push_back(text.substr(i, end - i));
    i = end;
  }
}

}  // namespace

bool is_name(std::string_view word) {
  return !word.empty() && is_letter(word[0]) && !std::isdigit(static_cast<unsigned char>(word[0]));
}

std::string without_comments(std::string text) {
  for (std::size_t i = 0; i + 1 < text.size(); ++i) {
    if (text[i] != '/' || (text[i + 1] != '/' && text[i + 1] != '*')) continue;
    const bool line = text[i + 1] == '/';
    const std::size_t end = std::min(line ? text.find('\n', i) : text.find("*/", i + 2), text.size());
    const std::size_t past = line ? end : std::min(end + 2, text.size());
    for (; i < past; ++i)
      if (text[i] != '\n') text[i] = ' ';
    --i;
  }
  return text;
}

Words words_of(std::string_view text) {
  Words words;
  while (!text.empty()) {
    const std::size_t first = text.find_first_not_of(" \t");
    const bool directive = first != text.npos && text[first] == '#';
    std::size_t end = std::min(text.find('\n'), text.size());
    while (directive && end > 0 && end < text.size() && text[end - 1] == '\\')
      end = std::min(text.find('\n', end + 1), text.size());
    std::vector<std::string_view>& to = directive ? words.directives : words.code;
    const std::size_t before = to.size() + 1;
    add_words(directive ? text.substr(first + 1, end - first - 1) : text.substr(0, end), to);
    if (directive && before < to.size() && to[before - 1] == "define") words.macros.emplace(to[before]);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return words;
}

Names declared_by(const std::vector<std::string_view>& code) {
  Names names;
  int depth = 0;
  bool in_value = false;  // behind the '=' of a declaration
  for (std::size_t i = 0; i < code.size(); ++i) {
    const char c = code[i][0], next = i + 1 < code.size() ? code[i + 1][0] : ';';
    if (depth == 0 && !in_value && is_name(code[i]) && std::string_view("([=,;{").find(next) != std::string_view::npos)
      names.emplace(code[i]);
    if (c == '(' || c == '[' || c == '{') ++depth;
    if (c == ')' || c == ']' || c == '}') --depth;
    if (depth == 0 && c == '=') in_value = true;
    if (depth == 0 && (c == ',' || c == ';' || c == '}')) in_value = false;
  }
  return names;
}

Names block_members_of(const std::vector<std::string_view>& code) {
  Names names;
  bool in_block = false;
  int depth = 0;
  for (std::size_t i = 0; i + 2 < code.size(); ++i) {
    const char c = code[i][0], next = code[i + 1][0];
    if (depth == 0 && (code[i] == "buffer" || code[i] == "uniform") && code[i + 2] == "{") in_block = true;
    if (c == '{') ++depth;
    if (c == '}' && --depth == 0) in_block = false;
    if (in_block && depth == 1 && is_name(code[i]) && (next == ';' || next == '[' || next == ','))
      names.emplace(code[i]);
  }
  return names;
}

}  // namespace ballot
