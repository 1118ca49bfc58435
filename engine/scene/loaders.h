// What the scene loaders share. Internal to engine/scene.
#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "engine/core/error.h"
#include "engine/scene/scene.h"

namespace ballot {

Scene load_gltf(const std::filesystem::path& path);  // .gltf and .glb; which one, the content says
Scene load_obj(const std::filesystem::path& path);

/// Triangles that one scene may hold: instancing lets a small file ask for any number. 72 bytes each with normals, 24 more
/// for texture coordinates.
inline constexpr std::size_t kMaxTriangles = std::size_t{1} << 28;

/// Throws Error(Work) "PATH: text".
template <class... Args>
[[noreturn]] void fail_in(const std::filesystem::path& path, fmt::format_string<Args...> text, Args&&... args) {
  throw Error(Failure::Work, path.string() + ": " + fmt::format(text, std::forward<Args>(args)...));
}

/// Unit normal of a triangle, counter-clockwise; (0, 1, 0) if it has no area.
glm::vec3 geometric_normal(const Triangle& triangle);

}  // namespace ballot
