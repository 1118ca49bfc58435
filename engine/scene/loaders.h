// Declarations that the scene loaders share. Internal to engine/scene.
#pragma once

#include <filesystem>
#include <string>
#include <utility>

#include "engine/core/error.h"
#include "engine/scene/scene.h"

namespace ballot {

Scene load_gltf(const std::filesystem::path& path, const LoadOptions& options);  // .gltf or .glb, as the content says
Scene load_obj(const std::filesystem::path& path, const LoadOptions& options);
Scene load_ply(const std::filesystem::path& path, const LoadOptions& options);
Scene load_stl(const std::filesystem::path& path, const LoadOptions& options);
Scene load_npy(const std::filesystem::path& path, const LoadOptions& options);  // an array of triangles
Scene load_npz(const std::filesystem::path& path, const LoadOptions& options);

/// Gives every triangle of a file without materials the default one. Throws Error(Work), which names the file and the
/// triangle, if a vertex is not finite.
void complete_mesh(const std::filesystem::path& path, Scene& scene);

/// The most triangles of a scene. A limit is needed because instancing lets a small file ask for any number. A triangle
/// with normals takes 72 bytes, and 24 more with texture coordinates.
inline constexpr std::size_t kMaxTriangles = std::size_t{1} << 28;

/// Throws Error(Work) "PATH: text".
template <class... Args>
[[noreturn]] void fail_in(const std::filesystem::path& path, fmt::format_string<Args...> text, Args&&... args) {
  throw Error(Failure::Work, path.string() + ": " + fmt::format(text, std::forward<Args>(args)...));
}

}  // namespace ballot
