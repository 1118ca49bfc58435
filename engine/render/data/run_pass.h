// Records a pass with one ray or pixel per invocation.
#pragma once

#include "engine/gpu/kernel.h"
#include "shaders/shared/render.h"

namespace ballot {

constexpr std::uint32_t kPassGroup = PASS_GROUP;

/// Records a pass of `count` invocations. Its device milliseconds are added to `ms` when it has ended, so `ms` must
/// still exist then.
inline void run_pass(Context& gpu, Kernel& kernel, std::uint32_t count, const void* push, std::uint32_t push_bytes,
                     double& ms) {
  gpu.pass(
      kernel.name(), [&](Commands& cmd) { kernel.dispatch(cmd, groups_of(count, kPassGroup), push, push_bytes); },
      [&ms](double spent) { ms += spent; });
}

}  // namespace ballot
