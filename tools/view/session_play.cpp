// The part of Session that plays animations.
#include <chrono>
#include <cmath>

#include "tools/view/session.h"

namespace ballot::view {

/// Moves the scene to the time that plays or was chosen. Returns true if it moved.
bool Session::play(double dt) {
  const Animation* animation = world_->scene_facts().animation.get();
  Playback& p = settings_.play;
  facts_.pose_ms = facts_.tree_ms = 0;
  if (!animation) return false;
  const AnimationClip& clip = animation->clips[p.clip];
  if (p.playing && clip.seconds > 0) p.seconds = std::fmod(p.seconds + dt * double(p.speed), clip.seconds);
  const std::pair now(p.clip, p.seconds);
  if (now == shown_time_) return false;
  shown_time_ = now;
  try {
    world_->set_time(p.clip, p.seconds, p.update);
  } catch (const Error& error) {
    p.playing = false;
    say(error.what(), true);
    return false;
  }
  const DeviceScene::Update& update = world_->last_update();
  facts_.pose_ms = 1e3 * update.pose_s;
  facts_.tree_ms = 1e3 * update.seconds;
  facts_.refitted = update.refitted;
  facts_.picked.reset();
  facts_.hovered.reset();
  facts_.counters.reset();
  for (std::size_t i = 0; i < world_->scene_facts().views.size(); ++i) views_[i] = world_->scene_facts().views[i];
  traced_ = {0, 0};  // what was traced is gone with the renderer
  dirty_ = true;
  return true;
}

void Session::toggle_play() {
  if (!world_->scene_facts().animation) return say("the scene has no animation", true);
  settings_.play.playing = !settings_.play.playing;
  const AnimationClip& clip = world_->scene_facts().animation->clips[settings_.play.clip];
  say(fmt::format("{} {} at {:.3f} s", settings_.play.playing ? "playing" : "paused", clip.name,
                  settings_.play.seconds));
}

}  // namespace ballot::view
