#include "engine/answer/user_text.h"

#include <algorithm>
#include <array>

#include "engine/answer/glsl_words.h"
#include "engine/answer/numeric.h"
#include "engine/answer/user_include.h"
#include "engine/core/error.h"
#include "shaders/shared/query.h"

namespace ballot {

namespace {

/// What begins so is the library's in every text.
constexpr std::string_view kOwnPrefix = "ballot_";

/// Names that mean the same in the library and in a user's text: what he calls, the records and their members, and
/// functions of GLSL, which he may write anew for himself.
const Names kShared{
    "nearest",  "any",   "count",   "closest",   "accept",   "intersect", "is_shape", "main",
    "Ray",      "Hit",   "Nearest", "NO_HIT",    "origin",   "t_min",     "dir",      "t_max",
    "t",        "prim",  "u",       "v",         "at",       "distance",  "behind",   "abs",
    "all",      "clamp", "cross",   "dot",       "equal",    "floor",     "fma",      "greaterThanEqual",
    "lessThan", "max",   "min",     "mix",       "sqrt",     "sign",      "length",   "x",
    "y",        "z",     "w",       "atomicAdd", "bitCount", "findLSB",   "xyz",      "corner",
    "place"};

/// Returns the bytes of a type of numbers, by the rules of scalar layout; 0 if there is no such type.
std::uint32_t bytes_of_number(std::string_view type) {
  if (type == "float" || type == "int" || type == "uint") return 4;
  if (type.starts_with('i') || type.starts_with('u')) type.remove_prefix(1);
  if (type.size() != 4 || !type.starts_with("vec") || type[3] < '2' || type[3] > '4') return 0;
  return 4 * std::uint32_t(type[3] - '0');
}

/// Returns true if a text calls a function, as far as its words tell: its name stands before a bracket or in a macro.
bool calls(const Words& words, const Names& declared, std::string_view name) {
  if (declared.contains(name)) return false;
  if (std::ranges::find(words.directives, name) != words.directives.end()) return true;
  for (std::size_t i = 0; i + 1 < words.code.size(); ++i)
    if (words.code[i] == name && words.code[i + 1] == "(") return true;
  return false;
}

void check_main(const UserText& user, const Words& words) {
  constexpr std::array<std::string_view, 5> kMain{"void", "main", "(", "uint", ""};
  for (std::size_t i = 0; i + 3 < words.code.size(); ++i)
    if (std::equal(kMain.begin(), kMain.begin() + 4, words.code.begin() + std::ptrdiff_t(i))) return;
  fail(Failure::Arguments, "kernel {}: {} has no main of one index; expected: void main(uint index) {{ ... }}",
       user.name, user.file);
}

void check_text(const UserText& user, const Words& words) {
  for (const std::string_view word : {"include", "version"})
    if (std::ranges::find(words.directives, word) != words.directives.end())
      fail(Failure::Arguments, "kernel {}: {} has #{}; give one text of GLSL 460 without it", user.name, user.file,
           word);
  for (const auto* some : {&words.code, &words.directives})
    for (const std::string_view word : *some)
      if (word.starts_with(kOwnPrefix))
        fail(Failure::Arguments, "kernel {}: {} has the name '{}'; names that begin with {} are the library's",
             user.name, user.file, word, kOwnPrefix);
  if (user.file.find_first_of("\"\\\n") != std::string::npos)
    fail(Failure::Arguments, "kernel {}: its file's name has a quote, a backslash or the end of a line", user.name);
  check_main(user, words);
}

void check_calls(const UserText& user, const UserCalls& calls) {
  if (find_numeric(user.numeric).needs_float64)
    fail(Failure::Arguments, "kernel {}: numeric mode {}; kernels of users take watertight, plain or fast", user.name,
         user.numeric);
  if (user.numeric != kDefaultNumeric && (calls.count || calls.closest || calls.intersects))
    fail(Failure::Arguments, "kernel {}: numeric mode {} with count(), closest() or intersect(), which take {}",
         user.name, user.numeric, kDefaultNumeric);
  if (calls.intersects && calls.closest)
    fail(Failure::Arguments, "kernel {}: {} has intersect() and calls closest(), which knows triangles alone",
         user.name, user.file);
}

/// Reads what a text declares for the whole of it: its arrays and numbers, and what has to change to compile them.
class Declarations {
 public:
  /// `words` are those of `bare`, the text without comments. Keeps references.
  Declarations(const UserText& user, const std::string& bare, const std::vector<std::string_view>& words)
      : user_(user), bare_(bare), words_(words), text(user.text) {
    int depth = 0;
    for (std::size_t i = 0; i < words_.size(); ++i) {
      const char c = words_[i][0];
      if (depth == 0 && words_[i] == "layout") refuse(i, "layout(...), which the library gives; leave it out");
      if (depth == 0 && words_[i] == "buffer") read_array(i);
      if (depth == 0 && words_[i] == "uniform") read_numbers(i);
      if (c == '(' || c == '[' || c == '{') ++depth;
      if (c == ')' || c == ']' || c == '}') --depth;
    }
    for (auto edit = inserted_.rbegin(); edit != inserted_.rend(); ++edit) text.insert(edit->first, edit->second);
  }

 private:
  static constexpr std::string_view kQualifiers[] = {"readonly", "writeonly", "coherent", "restrict", "volatile"};
  static bool is_qualifier(std::string_view word) {
    return std::ranges::find(kQualifiers, word) != std::end(kQualifiers);
  }

  std::string_view at(std::size_t i) const { return i < words_.size() ? words_[i] : std::string_view(); }
  std::size_t place(std::size_t i) const { return std::size_t(at(i).data() - bare_.data()); }
  [[noreturn]] void refuse(std::size_t i, const std::string& what) const {
    const auto line = std::count(bare_.begin(), bare_.begin() + std::ptrdiff_t(place(i)), '\n');
    fail(Failure::Arguments, "kernel {}: {}:{}: {}", user_.name, user_.file, user_.first_line + std::uint32_t(line),
         what);
  }
  /// Checks the name and the type of what is declared.
  void check(std::size_t i, std::string_view what, std::string_view name, std::string_view type, bool known) {
    if (name.starts_with("gl_") || name.find("__") != name.npos || kShared.contains(name))
      refuse(i, fmt::format("{} '{}': the name has another meaning; take one that does not begin with gl_, has no two "
                            "underscores in a row, and is none of nearest, any, count, closest and the like",
                            what, name));
    if (!names.emplace(name).second) refuse(i, fmt::format("{} '{}': the name is declared twice", what, name));
    if (!known)
      refuse(i, fmt::format("{} '{}' is of type '{}'; expected float, int, uint, or a vector of them (vec3, ivec2, "
                            "uvec4){}",
                            what, name, type, what == "array" ? ", Ray, Hit, Nearest, or a struct of these" : ""));
  }

  bool is_element(std::string_view type) const {
    if (bytes_of_number(type) || type == "Ray" || type == "Hit" || type == "Nearest") return true;
    for (std::size_t i = 0; i + 1 < words_.size(); ++i)
      if (words_[i] == "struct" && words_[i + 1] == type) return true;
    return false;
  }

  /// buffer NAME { TYPE name[]; };
  void read_array(std::size_t i) {
    std::size_t first = i, type = i + 3;
    bool written = true;
    for (; first > 0 && is_qualifier(words_[first - 1]); --first) written = written && words_[first - 1] != "readonly";
    for (; is_qualifier(at(type)); ++type) written = written && at(type) != "readonly";
    constexpr std::string_view kEnd[] = {"[", "]", ";", "}", ";"};
    bool right = is_name(at(i + 1)) && at(i + 2) == "{" && is_name(at(type)) && is_name(at(type + 1));
    for (std::size_t k = 0; k < std::size(kEnd); ++k) right = right && at(type + 2 + k) == kEnd[k];
    if (!right)
      refuse(i,
             "an array is declared in another way than is known; expected: buffer NAME { TYPE name[]; }; with "
             "readonly before it if it is not written");
    check(type, "array", at(type + 1), at(type), is_element(at(type)));
    inserted_.emplace_back(place(first), fmt::format("layout(set = 0, binding = {}, scalar) ",
                                                     BIND_USER_ARRAYS + std::uint32_t(arrays.size())));
    arrays.push_back({std::string(at(type + 1)), std::string(at(type)), written});
  }

  /// uniform TYPE name, ...;
  void read_numbers(std::size_t i) {
    const std::string_view type = at(i + 1);
    std::size_t end = i + 2;
    while (is_name(at(end)) && at(end + 1) == ",") end += 2;
    if (!is_name(type) || !is_name(at(end)) || at(end + 1) != ";")
      refuse(i, "a number is declared in another way than is known; expected: uniform TYPE name;");
    for (std::size_t k = i + 2; k <= end; k += 2) {
      check(k, "number", at(k), type, bytes_of_number(type) != 0);
      numbers.push_back({std::string(at(k)), std::string(type), bytes_of_number(type)});
    }
    const auto past = text.begin() + std::ptrdiff_t(place(end + 1)) + 1;
    std::replace_if(
        text.begin() + std::ptrdiff_t(place(i)), past, [](char c) { return c != '\n'; }, ' ');
  }

  const UserText& user_;
  const std::string& bare_;
  const std::vector<std::string_view>& words_;
  std::vector<std::pair<std::size_t, std::string>> inserted_;

 public:
  std::string text;  // with layouts, and without numbers
  std::vector<UserArray> arrays;
  std::vector<UserNumber> numbers;
  Names names;  // of both
};

/// Returns the declaration of numbers.
std::string block_of(const std::vector<UserNumber>& numbers) {
  if (numbers.empty()) return {};
  std::string text = fmt::format("layout(set = 0, binding = {}, scalar) uniform ballot_Numbers {{", BIND_USER_NUMBERS);
  for (const UserNumber& n : numbers) text += fmt::format(" {} {};", n.type, n.name);
  return text + " };\n";
}

/// The library, and what stands before and behind it so that its names are out of the way: those that the user declares
/// have another name in it, and its macros end with it.
std::string library_without(const Names& declared, const Names& macros) {
  static const Names own_macros = words_of(without_comments(texts_of(kCalledScene))).macros;
  std::string before, behind;
  for (const std::string& name : declared) {
    if (kShared.contains(name) || own_macros.contains(name)) continue;
    before += fmt::format("#define {} ballot_{}\n", name, name);
    behind += fmt::format("#undef {}\n", name);
  }
  for (const std::string& name : own_macros)
    if (!kShared.contains(name) || macros.contains(name)) behind += fmt::format("#undef {}\n", name);
  return fmt::format("{}#include \"../{}\"\n{}", before, kCalledScene, behind);
}

}  // namespace

bool is_shared_name(std::string_view name) { return kShared.contains(name); }

Defines defines_of(const UserText& user, const UserCalls& c) {
  check_calls(user, c);
  Defines defines = {{"CALLS_NEAREST", c.nearest},
                     {"CALLS_ANY", c.any},
                     {"CALLS_COUNT", c.count},
                     {"CALLS_CLOSEST", c.closest},
                     {"CALLS_CORNER", c.corner},
                     {"CALLS_PLACE", c.place},
                     {"BALLOT_WIDE", 0},
                     {"BALLOT_FIRST", 0},
                     {"BALLOT_ANY", 0},
                     {"BALLOT_LISTS", 0},
                     {"BALLOT_EXACT", 0},
                     {"BALLOT_FILTERS", 0},
                     {"BALLOT_CULL", 0},
                     {"BALLOT_ALPHA", 0},
                     {"BALLOT_SIDES", 0},
                     {"BALLOT_LAST", 0}};
  if (c.accepts) defines.emplace_back("CALLED_ACCEPT", 1);
  if (c.intersects) defines.emplace_back("CALLED_INTERSECT", 1);
  if (c.intersects && c.is_shape) defines.emplace_back("CALLED_IS_SHAPE", 1);
  return defines;
}

WholeText whole_text(const UserText& user) {
  if (user.include_set) return included_text(user);
  const std::string bare = without_comments(user.text);
  const Words words = words_of(bare);
  check_text(user, words);
  Names declared = declared_by(words.code);
  WholeText whole;
  whole.calls = {calls(words, declared, "nearest"), calls(words, declared, "any"),    calls(words, declared, "count"),
                 calls(words, declared, "closest"), calls(words, declared, "corner"), calls(words, declared, "place"),
                 declared.contains("accept"),       declared.contains("intersect"),   declared.contains("is_shape")};
  Declarations own(user, bare, words.code);
  declared.insert(own.names.begin(), own.names.end());
  whole.defines = defines_of(user, whole.calls);
  whole.text = fmt::format(
      "#version 460\n#extension GL_GOOGLE_include_directive : require\n{}{}#define main ballot_main\n"
      "#line {} \"{}\"\n{}\n#line 1 \"the end of {}\"\n#undef main\n"
      "void main() {{\n  uint ballot_index;\n  if (ballot_begin(ballot_index)) {{\n    ballot_main(ballot_index);\n"
      "    ballot_end();\n  }}\n}}\n",
      library_without(declared, words.macros), block_of(own.numbers), user.first_line, user.file, own.text, user.file);
  whole.arrays = std::move(own.arrays);
  whole.numbers = std::move(own.numbers);
  return whole;
}

}  // namespace ballot
