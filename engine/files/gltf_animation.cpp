#include "engine/files/gltf_animation.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "engine/files/gltf_accessor.h"
#include "engine/files/gltf_nodes.h"
#include "engine/files/loaders.h"

namespace ballot {
namespace {

/// Where a channel is in the file, for errors.
struct ChannelPlace {
  std::size_t animation, channel;
  std::string text;  // "animation 0 ('walk') channel 3"
};

std::optional<ChannelPath> path_of(const std::string& name) {
  if (name == "translation") return ChannelPath::Translation;
  if (name == "rotation") return ChannelPath::Rotation;
  if (name == "scale") return ChannelPath::Scale;
  if (name == "weights") return ChannelPath::Weights;
  return std::nullopt;
}

Interpolation interpolation_of(const std::string& name, const std::string& place) {
  if (name == "LINEAR" || name.empty()) return Interpolation::Linear;
  if (name == "STEP") return Interpolation::Step;
  if (name == "CUBICSPLINE") return Interpolation::CubicSpline;
  refuse("{} has the interpolation '{}'; expected LINEAR, STEP or CUBICSPLINE", place, name);
}

std::vector<float> read_times(const GltfFile& file, int accessor, const std::string& place) {
  const AccessorView view = open_times(file, accessor, place + " input");
  if (view.size() == 0) refuse("{} has no key frame; expected one at least", place);
  std::vector<float> times(view.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    times[i] = static_cast<float>(view.component(i, 0));
    if (!std::isfinite(times[i]) || times[i] < 0)
      refuse("{} has key frame {} at {} s; expected a finite number, not below 0", place, i, times[i]);
    if (i > 0 && !(times[i] > times[i - 1]))
      refuse("{} has key frame {} at {} s, behind {} s; expected increasing times", place, i, times[i], times[i - 1]);
  }
  return times;
}

AccessorView open_output(const GltfFile& file, int accessor, ChannelPath path, const std::string& place) {
  if (path == ChannelPath::Rotation) return open_rotations(file, accessor, place);
  if (path == ChannelPath::Weights) return open_numbers(file, accessor, place);
  return open_positions(file, accessor, place);
}

void check_rotations(const Keys& keys, const std::string& place) {
  const std::size_t parts = keys.interpolation == Interpolation::CubicSpline ? 3 : 1;
  for (std::size_t i = 0; i < keys.times.size(); ++i) {
    const float* q = &keys.values[(i * parts + parts / 2) * 4];
    if (q[0] == 0 && q[1] == 0 && q[2] == 0 && q[3] == 0)
      refuse("{} has the rotation (0, 0, 0, 0) in key frame {}; expected a unit quaternion", place, i);
  }
}

/// Reads key frames of values of `width` numbers.
Keys read_keys(const GltfFile& file, const tinygltf::AnimationSampler& from, ChannelPath path, std::size_t width,
               const std::string& place) {
  Keys keys{.interpolation = interpolation_of(from.interpolation, place), .width = width};
  keys.times = read_times(file, from.input, place);
  const AccessorView view = open_output(file, from.output, path, place + " output");
  const std::size_t parts = keys.interpolation == Interpolation::CubicSpline ? 3 : 1;
  const std::size_t components = path == ChannelPath::Weights ? 1 : width;
  const std::size_t expected = keys.times.size() * parts * (width / components);
  if (view.size() != expected)
    refuse("{} has {} key frames and {} outputs; expected {}", place, keys.times.size(), view.size(), expected);
  keys.values.reserve(expected * components);
  for (std::size_t i = 0; i < expected; ++i)
    for (std::size_t c = 0; c < components; ++c) {
      keys.values.push_back(static_cast<float>(view.component(i, c)));
      if (!std::isfinite(keys.values.back()))
        refuse("{} has the output {} in element {}; expected finite numbers", place, keys.values.back(), i);
    }
  if (path == ChannelPath::Rotation) check_rotations(keys, place);
  return keys;
}

/// Reads a channel and its key frames. Returns nothing, with a note, for what it does not know.
std::optional<AnimationChannel> read_channel(GltfFile& file, const ChannelPlace& place, const Animation& to,
                                             std::vector<Keys>& samplers) {
  const tinygltf::Animation& owner = file.model.animations[place.animation];
  const tinygltf::AnimationChannel& from = owner.channels[place.channel];
  if (from.target_path == "pointer" || from.target_node == -1) {
    file.notes.push_back(fmt::format("{} moves no node and was ignored.", place.text));
    return std::nullopt;
  }
  const std::size_t node = checked_node(file, from.target_node, place.text);
  const auto path = path_of(from.target_path);
  if (!path)
    refuse("{} has the path '{}'; expected translation, rotation, scale or weights", place.text, from.target_path);
  if (from.sampler < 0 || static_cast<std::size_t>(from.sampler) >= owner.samplers.size())
    refuse("{} names sampler {}, but the animation has {}", place.text, from.sampler, owner.samplers.size());
  const std::string target = label("node", node, file.model.nodes[node].name);
  if (*path != ChannelPath::Weights && to.nodes[node].rest.matrix)
    refuse("{} moves {}, which has a matrix; expected translation, rotation and scale", place.text, target);
  std::size_t width = *path == ChannelPath::Rotation ? 4 : 3;
  if (*path == ChannelPath::Weights) width = to.nodes[node].weights.size();
  if (width == 0) refuse("{} moves weights of {}, whose mesh has no morph targets", place.text, target);
  samplers.push_back(read_keys(file, owner.samplers[static_cast<std::size_t>(from.sampler)], *path, width, place.text));
  return AnimationChannel{static_cast<std::uint32_t>(node), static_cast<std::uint32_t>(samplers.size() - 1), *path};
}

}  // namespace

void read_clips(GltfFile& file, Animation& to) {
  std::map<std::string, std::size_t> names;
  for (std::size_t a = 0; a < file.model.animations.size(); ++a) {
    const std::string name = file.model.animations[a].name;
    const std::string place = label("animation", a, name);
    AnimationClip clip{.name = name.empty() ? fmt::format("animation{}", a) : name};
    for (std::size_t c = 0; c < file.model.animations[a].channels.size(); ++c) {
      const ChannelPlace at{a, c, fmt::format("{} channel {}", place, c)};
      if (const auto channel = read_channel(file, at, to, clip.samplers)) clip.channels.push_back(*channel);
    }
    for (const Keys& keys : clip.samplers) clip.seconds = std::max(clip.seconds, double{keys.times.back()});
    if (clip.channels.empty()) file.notes.push_back(fmt::format("The {} has no channels and moves nothing.", place));
    if (const std::size_t n = ++names[clip.name]; n > 1) {
      clip.name = fmt::format("{}_{}", clip.name, n);
      file.notes.push_back(fmt::format("The {} was renamed to '{}', as another has its name.", place, clip.name));
    }
    to.clips.push_back(std::move(clip));
  }
}

}  // namespace ballot
