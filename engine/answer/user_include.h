// Calls of a scene in shaders of a program's own: the text that it includes. Internal to engine/answer.
//
// The text is that of kernels of users (shaders/lib/called/scene.glsl), compiled for what the scene needs, after the
// preprocessor. So it has no #include and no macros, and says nothing of workgroups, specialisation constants and push
// constants, which are the program's. Names that are none of the calls, hooks and records begin with `ballot_`.
#pragma once

#include <string>

#include "engine/answer/user_text.h"
#include "engine/gpu/pipeline.h"

namespace ballot {

/// Returns the text of a kernel that declares what an include declares and does nothing: it has the include's bindings.
/// Throws Error(Arguments) if `user` names none of the calls, or what is neither call nor hook.
WholeText included_text(const UserText& user);

/// Returns the include for a device. `source` is that of the kernel.
std::string flat_include(const UserText& user, const KernelSource& source, const DeviceInfo& device);

}  // namespace ballot
