// The text of a kernel that a user writes, and the whole text around it. Internal to engine/answer.
#pragma once

#include <string>

#include "engine/answer/user_kernel.h"
#include "engine/gpu/shader.h"

namespace ballot {

/// What a text asks of a scene.
struct UserCalls {
  bool nearest = false, any = false, count = false, closest = false, corner = false, place = false;
  bool accepts = false, intersects = false;  // it has accept(), intersect()
};

/// A text as it is compiled.
struct WholeText {
  std::string text;
  UserCalls calls;
  Defines defines;                // CALLS_... and CALLED_ACCEPT (shaders/lib/called/scene.glsl)
  std::vector<UserArray> arrays;  // in the order of their bindings; their bytes are not known
  std::vector<UserNumber> numbers;
};

/// Returns the whole text of a kernel: the library, the user's text by his own file and lines, and a main() that calls
/// his. What the library declares is out of the way of his names.
/// Throws Error(Arguments) if names or types are wrong, or the text has no `void main(uint index)`.
WholeText whole_text(const UserText& user);

}  // namespace ballot
