#include "engine/render/data/surface_columns.h"

namespace ballot {

namespace {

constexpr std::uint32_t bit(std::uint32_t column) { return 1u << column; }

/// Returns those of the features that columns depend on.
SceneFeatures features_for(std::uint32_t columns, const SceneFeatures& all) {
  const bool colors = columns & bit(COLUMN_COLORS), normals = columns & bit(COLUMN_SHADING_NORMALS);
  SceneFeatures seen = alpha_features(all);
  seen.vertex_colors &= colors, seen.base_texture &= colors;
  seen.shading_normals = normals && all.shading_normals;
  seen.normal_texture = normals && all.normal_texture;
  return seen;
}

KernelSource source_of(std::uint32_t columns, bool points, const SceneFeatures& all) {
  const SceneFeatures seen = features_for(columns, all);
  const bool materials = columns & bit(COLUMN_COLORS) || seen.normal_texture;
  KernelSource source{
      .file = "query/surfaces.comp", .defines = look_defines(seen, materials), .group_size = COLUMNS_GROUP};
  source.name =
      fmt::format("query.surfaces {} of {}{}", columns, points ? "points" : "hits", look_name(seen, materials));
  source.defines.emplace_back("BALLOT_COLUMNS", int(columns));
  source.defines.emplace_back("BALLOT_POINTS", points);
  return source;
}

}  // namespace

void SurfaceColumns::record(const ColumnRecords& from, const ColumnBuffers& to, const Context::Done& done) {
  std::uint32_t columns = 0;
  for (std::uint32_t i = COLUMN_MATERIALS; i < ALL_COLUMNS; ++i) columns |= to[i] ? bit(i) : 0;
  const SceneFeatures& features = scene_.features();
  if (!features.shading_normals && !features.normal_texture) columns &= ~bit(COLUMN_SHADING_NORMALS);
  if (!columns) return;
  const KernelSource source = source_of(columns, from.points, features);
  std::unique_ptr<Kernel>& kernel = kernels_[source.name];
  if (refresh(gpu_, kernel, source)) gpu_.save_pipeline_cache();
  scene_.bind(*kernel);
  kernel->bind(BIND_HITS, from.found);
  for (std::uint32_t i = COLUMN_MATERIALS; i < ALL_COLUMNS; ++i)
    if (columns & bit(i)) kernel->bind(BIND_COLUMNS + i, *to[i]);
  for_ranges(gpu_.info(), from, [&](const ColumnRange& range) {
    const SurfacesPush push{range.records, range.from, range.to};
    gpu_.pass(
        kernel->name(), [&](Commands& cmd) { kernel->dispatch(cmd, groups_of(range.records, COLUMNS_GROUP), push); },
        done);
  });
}

std::vector<KernelSource> surface_column_sources(const SceneFeatures& features) {
  constexpr std::uint32_t kAll = bit(COLUMN_MATERIALS) | bit(COLUMN_COLORS) | bit(COLUMN_SHADING_NORMALS);
  std::vector<KernelSource> sources;
  for (const bool points : {false, true})
    for (const std::uint32_t columns : {kAll, bit(COLUMN_MATERIALS), bit(COLUMN_COLORS), bit(COLUMN_SHADING_NORMALS)})
      sources.push_back(source_of(columns, points, features));
  return sources;
}

}  // namespace ballot
