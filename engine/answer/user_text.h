// The text of a kernel that a user writes, and the whole text around it. Internal to engine/answer.
#pragma once

#include <string>
#include <string_view>

#include "engine/answer/user_kernel.h"
#include "engine/gpu/shader.h"

namespace ballot {

/// What a text asks of a scene.
struct UserCalls {
  bool nearest = false, any = false, count = false, closest = false, corner = false, place = false;
  bool accepts = false, intersects = false, is_shape = false;  // it has accept(), intersect(), is_shape()
};

/// What a kernel includes to make calls.
inline constexpr const char* kCalledScene = "lib/called/scene.glsl";

/// Returns true if a name means the same in the library and in a user's text: of calls, hooks, records, their members.
bool is_shared_name(std::string_view name);

/// Returns the defines of what a text asks. Throws Error(Arguments) if calls, hooks and numeric mode do not go
/// together.
Defines defines_of(const UserText& user, const UserCalls& calls);

/// A text as it is compiled.
struct WholeText {
  std::string text;
  UserCalls calls;
  Defines defines;                // CALLS_... and CALLED_ACCEPT (shaders/lib/called/scene.glsl)
  std::vector<UserArray> arrays;  // in the order of their bindings; their bytes are not known
  std::vector<UserNumber> numbers;
};

/// Returns the whole text of a kernel: the library, the user's text by his own file and lines, and a main() that calls
/// his. What the library declares is out of the way of his names. Of a text with include_set: included_text().
/// Throws Error(Arguments) if names or types are wrong, or the text has no `void main(uint index)`.
WholeText whole_text(const UserText& user);

}  // namespace ballot
