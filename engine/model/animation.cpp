#include "engine/model/animation.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include "engine/core/error.h"

namespace ballot {
namespace {

glm::dquat quaternion(const float* xyzw) { return glm::normalize(glm::dquat{xyzw[3], xyzw[0], xyzw[1], xyzw[2]}); }

void slerp(const float* from, const float* to, double u, std::span<double> out) {
  const glm::dquat q = glm::slerp(quaternion(from), quaternion(to), u);
  out[0] = q.x;
  out[1] = q.y;
  out[2] = q.z;
  out[3] = q.w;
}

/// Sets what the channels of a clip move.
void apply(const AnimationClip& clip, double seconds, std::vector<NodeTransform>& local, NodePose& pose) {
  std::vector<double> value;
  for (const AnimationChannel& c : clip.channels) {
    const Keys& keys = clip.samplers[c.sampler];
    value.resize(keys.width);
    keys.sample(seconds, c.path == ChannelPath::Rotation, value);
    NodeTransform& to = local[c.node];
    if (c.path == ChannelPath::Translation) to.translation = {value[0], value[1], value[2]};
    if (c.path == ChannelPath::Rotation) to.rotation = {value[0], value[1], value[2], value[3]};
    if (c.path == ChannelPath::Scale) to.scale = {value[0], value[1], value[2]};
    if (c.path == ChannelPath::Weights)
      std::ranges::transform(value, pose.weights[c.node].begin(), [](double w) { return static_cast<float>(w); });
  }
}

}  // namespace

glm::dmat4 matrix_of(const NodeTransform& t) {
  if (t.matrix) return *t.matrix;
  const glm::dquat q{t.rotation.w, t.rotation.x, t.rotation.y, t.rotation.z};
  const double length = glm::length(q);
  glm::dmat4 m = length > 0 ? glm::mat4_cast(q / length) : glm::dmat4{1};
  for (int axis = 0; axis < 3; ++axis) m[axis] *= t.scale[axis];
  m[3] = {t.translation, 1};
  return m;
}

void Keys::sample(double seconds, bool rotation, std::span<double> out) const {
  const bool cubic = interpolation == Interpolation::CubicSpline;
  const std::size_t stride = cubic ? 3 * width : width;
  const auto value = [&](std::size_t key, std::size_t part) { return &values[key * stride + part * width]; };
  const auto hold = [&](std::size_t key) { std::copy_n(value(key, cubic ? 1 : 0), width, out.begin()); };
  const auto next = std::ranges::upper_bound(times, seconds, {}, [](float t) { return double{t}; });
  if (next == times.begin()) return hold(0);
  const auto i = static_cast<std::size_t>(next - times.begin()) - 1;
  if (next == times.end() || interpolation == Interpolation::Step) return hold(i);
  const double step = double{times[i + 1]} - times[i], u = (seconds - times[i]) / step;
  if (!cubic) {
    if (rotation) return slerp(value(i, 0), value(i + 1, 0), u, out);
    for (std::size_t k = 0; k < width; ++k) out[k] = (1 - u) * value(i, 0)[k] + u * value(i + 1, 0)[k];
    return;
  }
  const double u2 = u * u, u3 = u2 * u;
  for (std::size_t k = 0; k < width; ++k)
    out[k] = (2 * u3 - 3 * u2 + 1) * value(i, 1)[k] + step * (u3 - 2 * u2 + u) * value(i, 2)[k] +
             (3 * u2 - 2 * u3) * value(i + 1, 1)[k] + step * (u3 - u2) * value(i + 1, 0)[k];
}

NodePose pose_nodes(const Animation& animation, const AnimationClip* clip, double seconds) {
  NodePose pose;
  std::vector<NodeTransform> local;
  for (const MovingNode& node : animation.nodes) {
    local.push_back(node.rest);
    pose.weights.push_back(node.weights);
  }
  if (clip) apply(*clip, clamped_time(*clip, seconds), local, pose);
  pose.world_from_node.resize(local.size());
  for (const std::uint32_t i : animation.order) {
    const int parent = animation.nodes[i].parent;
    const glm::dmat4& above = parent < 0 ? glm::dmat4{1} : pose.world_from_node[static_cast<std::size_t>(parent)];
    pose.world_from_node[i] = above * matrix_of(local[i]);
  }
  return pose;
}

std::size_t find_clip(const Animation* animation, std::string_view name, std::string_view scene) {
  if (!animation || animation->clips.empty())
    fail(Failure::Arguments, "scene '{}' has no animation; expected one, as glTF files can have", scene);
  const auto& clips = animation->clips;
  std::string names;
  for (std::size_t i = 0; i < clips.size(); ++i) {
    if (clips[i].name == name) return i;
    names += fmt::format("{}{} {}", i ? ", " : "", i, clips[i].name);
  }
  std::size_t number = clips.size();
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (error == std::errc{} && end == name.data() + name.size() && number < clips.size()) return number;
  fail(Failure::Arguments, "scene '{}' has no animation '{}'; there are: {}", scene, name, names);
}

double clamped_time(const AnimationClip& clip, double seconds) {
  if (!std::isfinite(seconds))
    fail(Failure::Arguments, "animation '{}': the time is {} s; expected a finite number", clip.name, seconds);
  return std::clamp(seconds, 0.0, clip.seconds);
}

}  // namespace ballot
