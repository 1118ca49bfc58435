// Views in a JSON file: what `ballot view` writes, and --views-file reads.
//
//   {"views": [{"name": "door", "position": [x, y, z], "orientation": [x, y, z, w], "yfov": 1.05}]}
//
// orientation is the unit quaternion that turns the camera's frame, which looks along -z with +y up, into the scene's;
// yfov is the full vertical angle in radians. An orthographic view has "ymag", half its height, instead of yfov.
#pragma once

#include <filesystem>
#include <glm/gtc/quaternion.hpp>
#include <vector>

#include "engine/ballot.h"

namespace ballot::cli {

/// The rigid frame of a camera: the one way from pose to matrix, so that equal poses give equal pictures.
glm::dmat4 frame_of(const glm::dvec3& position, const glm::dquat& orientation);

/// The view as it is read back from a file: equal to the given one but for roundings of the matrix.
View as_written(const View& view);

/// Throws Error(Work) that names the file and what is wrong in it.
std::vector<View> read_views(const std::filesystem::path& path);

/// Replaces the file. Throws Error(Work).
void write_views(const std::filesystem::path& path, const std::vector<View>& views);

/// Adds a view to the end of a file, which need not exist. A name that is taken is an Error(Work).
void append_view(const std::filesystem::path& path, const View& view);

}  // namespace ballot::cli
