#include "engine/files/gltf_instances.h"

#include <glm/gtc/quaternion.hpp>

#include "engine/files/loaders.h"

namespace ballot {

namespace {

constexpr const char* kExtension = "EXT_mesh_gpu_instancing";

AccessorView open_attribute(const GltfFile& file, const std::string& name, int accessor, const std::string& place) {
  if (name == "TRANSLATION" || name == "SCALE") return open_positions(file, accessor, place);
  if (name == "ROTATION") return open_rotations(file, accessor, place);
  return open_accessor(file, accessor, place);  // one of the file's own, which says how many there are
}

}  // namespace

glm::dmat4 NodeInstances::matrix(std::size_t i) const {
  glm::dmat4 m{1};
  if (rotations_) {
    const glm::dvec4 q = rotations_->vec4(i);
    const double length = glm::length(q);
    if (length > 0) m = glm::mat4_cast(glm::dquat{q.w / length, q.x / length, q.y / length, q.z / length});
  }
  if (scales_)
    for (int axis = 0; axis < 3; ++axis) m[axis] *= scales_->vec3(i)[axis];
  if (translations_) m[3] = glm::dvec4(translations_->vec3(i), 1);
  return m;
}

std::optional<NodeInstances> open_instances(const GltfFile& file, std::size_t node) {
  const tinygltf::Node& owner = file.model.nodes[node];
  const auto found = owner.extensions.find(kExtension);
  if (found == owner.extensions.end()) return {};
  const std::string place = fmt::format("{}, {}", label("node", node, owner.name), kExtension);
  if (!found->second.IsObject() || !found->second.Get("attributes").IsObject())
    refuse("{}: it has no attributes; expected an object of accessors", place);
  const tinygltf::Value& attributes = found->second.Get("attributes");
  NodeInstances instances;
  std::string first;
  for (const std::string& name : attributes.Keys()) {
    const tinygltf::Value& index = attributes.Get(name);
    if (!index.IsInt()) refuse("{}: attribute {} is no number; expected the index of an accessor", place, name);
    AccessorView view = open_attribute(file, name, index_in(index), place);
    if (first.empty()) instances.count_ = view.size();
    if (view.size() != instances.count_)
      refuse("{}: attribute {} has {} elements, but {} has {}; expected as many", place, name, view.size(), first,
             instances.count_);
    first = name;
    if (name == "TRANSLATION")
      instances.translations_ = std::move(view);
    else if (name == "ROTATION")
      instances.rotations_ = std::move(view);
    else if (name == "SCALE")
      instances.scales_ = std::move(view);
  }
  if (first.empty()) refuse("{}: it has no attribute; expected one at least", place);
  return instances;
}

}  // namespace ballot
