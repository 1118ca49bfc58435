#include "engine/answer/user_include.h"

#include <algorithm>
#include <sstream>

#include "engine/answer/glsl_words.h"
#include "engine/core/error.h"

namespace ballot {

namespace {

/// A name that an include may be asked for.
struct Callable {
  const char* name;
  bool UserCalls::*is_asked;
  const char* hook;  // in the place of the program's; "" for a call
};
constexpr Callable kCallables[] = {
    {"nearest", &UserCalls::nearest, ""},
    {"any", &UserCalls::any, ""},
    {"count", &UserCalls::count, ""},
    {"closest", &UserCalls::closest, ""},
    {"corner", &UserCalls::corner, ""},
    {"place", &UserCalls::place, ""},
    {"accept", &UserCalls::accepts, "bool accept(Hit hit) { return true; }\n"},
    {"intersect", &UserCalls::intersects, "bool intersect(uint prim, Ray ray, inout Hit hit) { return false; }\n"},
    {"is_shape", &UserCalls::is_shape, "bool is_shape(uint prim) { return true; }\n"}};

std::string library() {
  return fmt::format("#version 460\n#extension GL_GOOGLE_include_directive : require\n#include \"../{}\"\n",
                     kCalledScene);
}

UserCalls calls_of(const UserText& user) {
  UserCalls calls;
  bool walks = false;
  std::istringstream names(user.text);
  for (std::string name; names >> name;) {
    const auto* found = std::ranges::find(kCallables, name, &Callable::name);
    if (found == std::end(kCallables))
      fail(Failure::Arguments,
           "{}: calls has '{}'; expected names of nearest, any, count, closest, corner, place, and of hooks: accept, "
           "intersect, is_shape",
           user.name, name);
    calls.*found->is_asked = true;
    walks = walks || !*found->hook;
  }
  if (!walks)
    fail(Failure::Arguments, "{}: calls is '{}'; expected at least one of nearest, any, count, closest, corner, place",
         user.name, user.text);
  return calls;
}

/// Returns true for a name that may stand behind a point: v.xyz.
bool is_swizzle(std::string_view name) {
  constexpr std::string_view kSets[] = {"xyzw", "rgba", "stpq"};
  return name.size() <= 4 &&
         std::ranges::any_of(kSets, [&](auto set) { return name.find_first_not_of(set) == name.npos; });
}

/// Returns a text without directives of lines and versions, and without empty lines and declarations.
std::string without_directives(const std::string& text) {
  std::string kept;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    if (line.find_first_not_of(" \t\r;") != line.npos && !line.starts_with("#line") && !line.starts_with("#version") &&
        line.find("GL_GOOGLE_include_directive") == line.npos)
      kept += line + '\n';
  return kept;
}

}  // namespace

WholeText included_text(const UserText& user) {
  WholeText whole;
  whole.calls = calls_of(user);
  whole.defines = defines_of(user, whole.calls);
  whole.defines.emplace_back("CALLED_INCLUDED", 1);
  whole.text = library();
  for (const Callable& c : kCallables)
    if (whole.calls.*c.is_asked) whole.text += c.hook;
  whole.text += "layout(local_size_x = 1) in;\nvoid main() {}\n";
  return whole;
}

std::string flat_include(const UserText& user, const KernelSource& source, const DeviceInfo& device) {
  const std::string text = without_directives(
      preprocessed_shader(source.file, defines_of(source, device), {library(), "the include of a scene"}));
  const std::vector<std::string_view> code = words_of(text).code;
  Names own = declared_by(code);
  own.merge(block_members_of(code));
  own.erase("layout");
  std::string flat = fmt::format("// Made by Ballot for a scene, set {}, calls: {}.\n", *user.include_set, user.text);
  std::size_t done = 0;
  for (std::size_t i = 0; i < code.size(); ++i) {
    const std::string_view word = code[i];
    const auto at = std::size_t(word.data() - text.data());
    flat.append(text, done, at - done);
    done = at + word.size();
    const bool is_set = word == "0" && i >= 4 && code[i - 2] == "set" && code[i - 4] == "layout";
    if (own.contains(word) && !is_shared_name(word) && !is_swizzle(word) && !word.starts_with("ballot_"))
      flat += "ballot_";
    flat += is_set ? std::to_string(*user.include_set) : std::string(word);
  }
  flat.append(text, done);
  return flat + fmt::format("const uint NO_HIT = {:#x}u;\n", NO_HIT);
}

}  // namespace ballot
