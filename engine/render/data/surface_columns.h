// Columns of answers that materials, textures, colours and normals of vertices give.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/answer/columns.h"
#include "engine/render/data/scene_data.h"

namespace ballot {

/// Writes the columns from COLUMN_MATERIALS on, all of a call by one dispatch. Belongs to the thread of its Context.
class SurfaceColumns {
 public:
  /// Keeps references.
  SurfaceColumns(Context& gpu, SceneData& scene) : gpu_(gpu), scene_(scene) {}

  /// Records the writing behind all earlier passes. What goes to COLUMN_SHADING_NORMALS is the normals of triangles and
  /// shapes before (COLUMN_NORMALS); misses stay. `done` is given the device milliseconds of each pass. Throws
  /// Error(Work) if the device has no room, Error(Arguments) as SceneData::bind() does.
  void record(const ColumnRecords& from, const ColumnBuffers& to, const Context::Done& done);

 private:
  Context& gpu_;
  SceneData& scene_;
  std::map<std::string, std::unique_ptr<Kernel>> kernels_;  // by name
};

/// Returns the sources of kernels that together write every such column of scenes with these features.
std::vector<KernelSource> surface_column_sources(const SceneFeatures& features);

}  // namespace ballot
