// Animations of the C interface: those of scene files.
#include <algorithm>

#include "engine/api/meshes.h"
#include "engine/api/state.h"

using namespace ballot::api;

namespace {

std::span<const ballot::AnimationClip> clips_of(const SceneState& scene) {
  const ballot::Scene* loaded = scene.world ? &scene.world->scene_facts() : nullptr;
  if (!loaded || !loaded->animation) return {};
  return loaded->animation->clips;
}

}  // namespace

BallotStatus ballot_scene_animations(BallotScene* scene, BallotAnimationInfo* infos, size_t room, size_t* count) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(count, "ballot_scene_animations", "count");
    if (room) need(infos, "ballot_scene_animations", "infos");
    const auto clips = clips_of(*state);
    const std::size_t stride = room ? infos[0].size : 0;
    for (std::size_t i = 0; i < std::min(room, clips.size()); ++i) {
      auto* info = reinterpret_cast<BallotAnimationInfo*>(reinterpret_cast<char*>(infos) + i * stride);
      info->size = stride;
      BallotAnimationInfo to = BALLOT_INIT(BallotAnimationInfo);
      write_name(to.name, clips[i].name);
      to.seconds = clips[i].seconds;
      to.channels = clips[i].channels.size();
      write_struct(info, to, "BallotAnimationInfo");
    }
    *count = clips.size();
  });
}

BallotStatus ballot_scene_set_time(BallotScene* scene, size_t animation, double seconds) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    const DeviceUse use(*state->device);
    ballot::DeviceScene& world = *state->world;
    const std::size_t count = clips_of(*state).size();
    if (animation >= count)
      refuse(fmt::format("animation {} of a scene that has {}; expected a number below that", animation, count));
    world.set_time(animation, seconds, state->update);
    for (auto& [number, mesh] : state->meshes) mesh.bounds.reset();
    state->refits = world.last_update().refitted ? state->refits + 1 : 0;
  });
}
