// Masks of questions in arrays on the device.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/api/arrays.h"
#include "engine/api/state.h"

namespace ballot::api {

/// The masks of a call's questions on the device, and those of the triangles.
class MasksThere {
 public:
  /// Throws Refused if they are no words of the scene's device, or not as many as questions, nor one.
  MasksThere(SceneState& scene, BallotBuffer* masks, std::uint64_t count, const char* call) {
    if (!masks) return;
    given_ = use(masks);
    Buffer<std::uint32_t>& words = array_beside<std::uint32_t>(*given_, scene, count, call, "masks");
    all_ = &words;
    if (given_->records == 1 && count > 1) fill(scene, words, count);
    of_triangles_ = masks_of_triangles(scene);
  }
  const Buffer<std::uint32_t>* all() const { return all_; }
  std::span<const std::uint32_t> of_triangles() const { return of_triangles_; }

 private:
  void fill(SceneState& scene, const Buffer<std::uint32_t>& one, std::uint64_t count) {
    std::uint32_t word = 0;
    one.download({&word, 1});
    Context& gpu = *scene.device->gpu;
    filled_.emplace(gpu, std::size_t(count), Access::Storage, "one mask for all");
    gpu.submit("one mask for all", [&](Commands& cmd) { cmd.fill(*filled_, word); });
    all_ = &*filled_;
  }

  std::shared_ptr<BufferState> given_;
  std::optional<Buffer<std::uint32_t>> filled_;
  const Buffer<std::uint32_t>* all_ = nullptr;
  std::vector<std::uint32_t> of_triangles_;
};

}  // namespace ballot::api
