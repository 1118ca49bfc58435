// The text of a kernel that a user writes, and the whole text around it. Internal to engine/answer.
#pragma once

#include <string>

#include "engine/answer/user_kernel.h"
#include "engine/gpu/shader.h"

namespace ballot {

/// What a text asks of a scene.
struct UserCalls {
  bool nearest = false, any = false, count = false, closest = false;
  bool accepts = false, intersects = false;  // it has accept(), intersect()
};

/// A text as it is compiled.
struct WholeText {
  std::string text;
  UserCalls calls;
  Defines defines;  // CALLS_... and CALLED_ACCEPT (shaders/lib/called/scene.glsl)
};

/// Returns the bytes of a type of GLSL that arrays and numbers of users may have, by the rules of scalar layout; 0 if
/// there is no such type.
std::uint32_t bytes_of_type(std::string_view type);

/// Returns the whole text of a kernel: the library, what the user declares, his text by his own file and lines, and a
/// main() that calls his. What the library declares is out of the way of his names.
/// Throws Error(Arguments) if names or types are wrong, or the text has no `void main(uint index)`.
WholeText whole_text(const UserText& user);

}  // namespace ballot
