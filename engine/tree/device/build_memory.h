// The working memory of the builder `device`, and the kernels of a refit. Internal to engine/tree/device.
#pragma once

#include "engine/tree/device/device_builder.h"

namespace ballot {

/// The working memory of a build of up to `most` triangles. Nodes of instances are not moved to places in another tree.
struct DeviceBuilder::Memory {
  std::uint32_t most;
  Buffer<BuildState> state;
  std::array<Buffer<std::uint32_t>, 2> keys, prims;
  Buffer<std::uint32_t> clusters, arrivals, needs;
  Buffer<glm::uvec4> nodes;
  Buffer<std::uint32_t> sums, starts;

  Memory(Context& gpu, std::uint32_t count, BuildOver over)
      : most(count),
        state(gpu, 1, Access::Storage, "state of the tree build"),
        keys{words(gpu, "keys", 2), words(gpu, "sorted keys", 2)},
        prims{words(gpu, "prims"), words(gpu, "sorted prims")},
        clusters(words(gpu, "clusters")),
        arrivals(words(gpu, "arrivals")),
        needs(words(gpu, "needs of nodes")),
        nodes(gpu, std::size_t(count) * BUILD_NODE_TEXELS, Access::Storage, "nodes of the tree build"),
        sums(gpu, std::size_t(groups_of(count, BUILD_BLOCK)) * 2, Access::Storage, "needs of blocks"),
        starts(words(gpu, "starts of nodes", over == BuildOver::Triangles ? 2 : 0)) {}

  Buffer<std::uint32_t> words(Context& gpu, const char* name, std::size_t each = 1) const {
    return {gpu, most * each, Access::Storage, name};
  }
};

/// The kernels of a refit.
struct DeviceBuilder::RefitKernels {
  Kernel parents, refit, end;

  RefitKernels(Context& gpu, BuildOver over)
      : parents(gpu, build_source("parents", gpu.info(), over_define(over))),
        refit(gpu, build_source("refit", gpu.info(), over_define(over))),
        end(gpu, build_source("refit_end", gpu.info(), over_define(over))) {}
};

}  // namespace ballot
