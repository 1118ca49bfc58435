// The JSON file of views that `ballot view` writes and --views-file reads.
//
//   {"views": [{"name": "door", "position": [x, y, z], "orientation": [x, y, z, w], "yfov": 1.05}]}
//
// position is in scene units. orientation is the unit quaternion that rotates the camera's frame, which looks along -z
// with +y up, into the scene's frame. yfov is the full vertical angle in radians. An orthographic view has "ymag", half
// its height in scene units, instead of yfov.
#pragma once

#include <filesystem>
#include <glm/gtc/quaternion.hpp>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/device_scene.h"

namespace ballot::cli {

/// Returns the matrix, camera to world, of a camera with this pose. All code calls this function, so equal poses give
/// equal pictures.
glm::dmat4 frame_of(const glm::dvec3& position, const glm::dquat& orientation);

/// Returns the view as it would be read back from a file: equal to the given one up to rounding errors of the matrix.
View as_written(const View& view);

/// Reads the views of a file; at least one. Throws Error(Work) that names the file and what is wrong in it.
std::vector<View> read_views(const std::filesystem::path& path);

/// Returns the views in the bytes of a file that was read already. Throws as read_views().
std::vector<View> views_in(const std::filesystem::path& path, std::span<const std::byte> bytes);

/// Returns the text of a file of views.
std::string views_text(const std::vector<View>& views);

/// Writes the views to a file and replaces it. Throws Error(Work).
void write_views(const std::filesystem::path& path, const std::vector<View>& views, Links links = Links::Follow);

/// Appends a view to a file, which need not exist. Throws Error(Work), also if the file has a view of that name.
void append_view(const std::filesystem::path& path, const View& view, Links links = Links::Follow);

}  // namespace ballot::cli
