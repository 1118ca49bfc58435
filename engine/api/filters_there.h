// Words of questions that filters read, in arrays on the device.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/api/arrays.h"
#include "engine/api/state.h"

namespace ballot::api {

/// The words of a call's questions on the device, and the masks of the triangles.
class FiltersThere {
 public:
  /// Throws Refused if some are no words of the scene's device, or not as many as questions, nor one.
  FiltersThere(SceneState& scene, const BallotQuery& query, std::uint64_t count, const char* call) {
    for (std::size_t f = 0; f < FILTERS; ++f)
      if (const FilterArray array = filter_array(query, f); array.words) take(scene, f, array, count, call);
    if (query.masks) of_triangles_ = masks_of_triangles(scene);
  }
  const DeviceFilters& words() const { return words_; }
  std::span<const std::uint32_t> of_triangles() const { return of_triangles_; }

 private:
  void take(SceneState& scene, std::size_t filter, const FilterArray& array, std::uint64_t count, const char* call) {
    std::shared_ptr<BufferState>& given = given_[filter];
    given = use(array.words);
    Buffer<std::uint32_t>& words = array_beside<std::uint32_t>(*given, scene, count, call, array.name);
    words_.of[filter] = &words;
    if (given->records > 1 || count <= 1) return;
    std::uint32_t word = 0;
    words.download({&word, 1});
    Context& gpu = *scene.device->gpu;
    filled_[filter].emplace(gpu, std::size_t(count), Access::Storage, "one word for all");
    gpu.submit("one word for all", [&](Commands& cmd) { cmd.fill(*filled_[filter], word); });
    words_.of[filter] = &*filled_[filter];
  }

  std::array<std::shared_ptr<BufferState>, FILTERS> given_;
  std::array<std::optional<Buffer<std::uint32_t>>, FILTERS> filled_;
  DeviceFilters words_;
  std::vector<std::uint32_t> of_triangles_;
};

}  // namespace ballot::api
