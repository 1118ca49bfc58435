// Scenes that are animated: a DeviceScene at a time of a clip.
#include <algorithm>

#include "engine/core/stopwatch.h"
#include "engine/scene/scene_tree.h"

namespace ballot {

void DeviceScene::set_time(std::size_t clip, double seconds, UpdateMode mode) {
  const std::size_t clips = scene_.animation ? scene_.animation->clips.size() : 0;
  if (clip >= clips)
    fail(Failure::Arguments, "scene '{}' has {} animations; expected a number below that, found {}", scene_.name, clips,
         clip);
  const AnimationClip& of = scene_.animation->clips[clip];
  if (!poses_there() || !set_time_there(of, seconds, mode)) set_time_here(of, seconds, mode);
}

/// Returns true if the device can move the triangles and their tree.
bool DeviceScene::poses_there() const {
  return tracer_->tree().built() && PosedTriangles::runs_on(gpu_->info()) && !scene_.animation->parts.empty();
}

Pose DeviceScene::pose(const AnimationClip& clip, double seconds) {
  const Animation& animation = *scene_.animation;
  Pose room = std::exchange(spare_pose_, {});
  if (animation.posed_vertices == 0) return pose_at(scene_, &clip, seconds, {}, std::move(room));
  if (!poser_) poser_ = std::make_unique<DevicePoser>(*gpu_, animation);
  return pose_at(
      scene_, &clip, seconds, [&](const PoseInput& input, std::span<PosedVertex> posed) { poser_->pose(input, posed); },
      std::move(room));
}

void DeviceScene::set_time_here(const AnimationClip& clip, double seconds, UpdateMode mode) {
  const Timer timer;
  late_.bring();
  Pose pose = this->pose(clip, seconds);
  const double pose_s = timer.seconds();
  if (forest_) return move_instances(std::move(pose), pose_s);
  const auto swap = [&] {
    if (pose.moves_triangles) scene_.normals.swap(pose.normals), turn_corners(scene_, pose.turned);
    scene_.lights.swap(pose.lights);
  };
  swap();
  try {
    if (pose.moves_triangles) {
      pose.triangles = move(std::move(pose.triangles), mode);
    } else {
      update_ = {};
      if (pose.moves_lights) gpu_->finish(), make_renderers();
    }
  } catch (...) {
    swap();
    throw;
  }
  std::ranges::copy(pose.views, scene_.views.begin());
  update_.pose_s = pose_s;
  spare_pose_ = std::move(pose);
}

/// Makes what moves triangles on the device, from the scene as it is.
void DeviceScene::make_posed() {
  late_.bring();
  if (!poser_) poser_ = std::make_unique<DevicePoser>(*gpu_, *scene_.animation);
  posed_ = std::make_unique<PosedTriangles>(*gpu_, scene_, *poser_, tracer_->tree().built()->triangles());
}

/// Moves the scene on the device. Returns false, and leaves the scene as it was, if a vertex has no place there: the
/// host tells which.
bool DeviceScene::set_time_there(const AnimationClip& clip, double seconds, UpdateMode mode) {
  const Timer timer;
  const NodePose nodes = pose_nodes(*scene_.animation, &clip, seconds);
  PosedCarried carried = pose_carried(scene_, nodes);
  gpu_->finish();
  if (!posed_) make_posed();
  const std::optional<Bounds> bounds = posed_->pose(nodes);
  if (!bounds) return false;
  const double pose_s = timer.seconds();
  begin_update();
  follow_posed(posed_->triangles(), *bounds, mode);
  const double tree_s = timer.seconds() - pose_s;
  scene_.bounds = *bounds;
  scene_.lights = std::move(carried.lights);
  std::ranges::copy(carried.views, scene_.views.begin());
  late_.is_elsewhere([this, &clip, seconds] { bring_back(clip, seconds); });
  checker_.reset();
  std::vector<bool> turned = turned_parts(*scene_.animation, nodes);
  const bool turns = turn_corners(scene_, turned);  // what follows is in buffers that no kernel moves
  if (features_.emits || turns) {
    make_renderers();
  } else {
    scene_data_->follow(*posed_);
    if (carried.moves_lights) scene_data_->follow_lights();
    gpu_->finish();
  }
  update_.pose_s = pose_s;
  update_.seconds = timer.seconds() - pose_s;
  update_.ready_s = update_.seconds - tree_s;
  return true;
}

/// Brings the triangles and normals of a time to the host, where they have the bits that the device has.
void DeviceScene::bring_back(const AnimationClip& clip, double seconds) {
  Pose pose = this->pose(clip, seconds);
  std::ranges::copy(pose.triangles, scene_.triangles.begin());  // in place: trees keep references to them
  scene_.normals = std::move(pose.normals);
}

}  // namespace ballot
