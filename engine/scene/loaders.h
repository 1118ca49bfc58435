// Declarations that the scene loaders share. Internal to engine/scene.
#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "engine/core/error.h"
#include "engine/scene/scene.h"

namespace ballot {

Scene load_gltf(const std::filesystem::path& path);  // .gltf or .glb, as the content says
Scene load_obj(const std::filesystem::path& path);

/// The most triangles of a scene. A limit is needed because instancing lets a small file ask for any number. A triangle
/// with normals takes 72 bytes, and 24 more with texture coordinates.
inline constexpr std::size_t kMaxTriangles = std::size_t{1} << 28;

/// Throws Error(Work) "PATH: text".
template <class... Args>
[[noreturn]] void fail_in(const std::filesystem::path& path, fmt::format_string<Args...> text, Args&&... args) {
  throw Error(Failure::Work, path.string() + ": " + fmt::format(text, std::forward<Args>(args)...));
}

}  // namespace ballot
