// Declarations that the scene loaders share. Internal to engine/files.
#pragma once

#include <filesystem>

#include "engine/files/flaw.h"
#include "engine/files/load.h"

namespace ballot {

// They throw Flaw, or Error(Work) of another file.
Scene load_gltf(const std::filesystem::path& path, const LoadOptions& options);  // .gltf or .glb, as the content says
Scene load_obj(const std::filesystem::path& path, const LoadOptions& options);
Scene load_ply(const std::filesystem::path& path, const LoadOptions& options);
Scene load_stl(const std::filesystem::path& path, const LoadOptions& options);
Scene load_npy(const std::filesystem::path& path, const LoadOptions& options);  // an array of triangles or shapes
Scene load_npz(const std::filesystem::path& path, const LoadOptions& options);

/// Gives every triangle of a file without materials the default one. Throws Flaw if a vertex is not finite.
void complete_mesh(Scene& scene);

/// Appends shapes to a scene, and the triangles that stand in for them. `vertices` has those of each shape in turn.
/// Throws Flaw, which names the vertex, for a position that is not finite, and as make_shapes() does.
void append_shapes(ShapeKind kind, const ShapeVertices& vertices, Scene& scene);

/// Makes one mesh of all shapes of a scene, which has nothing else. Its material is the default one.
void complete_shapes(ShapeKind kind, Scene& scene);

/// The most triangles of a scene. A limit is needed because instancing lets a small file ask for any number. A triangle
/// with normals takes 72 bytes, and 24 more with texture coordinates.
inline constexpr std::size_t kMaxTriangles = std::size_t{1} << 28;

}  // namespace ballot
