#include "engine/answer/attributes.h"

#include <algorithm>

namespace ballot {

namespace {

KernelSource source_of(std::uint32_t components, bool points) {
  KernelSource source{.file = "query/values.comp",
                      .defines = {{"BALLOT_POINTS", points}, {"BALLOT_COMPONENTS", int(components)}},
                      .group_size = COLUMNS_GROUP};
  source.name = fmt::format("query.values {} of {}", components, points ? "points" : "hits");
  return source;
}

bool is_of_vertices(const MeshAttribute& a) { return a.of == ValuesOf::Vertices || a.of == ValuesOf::NearVertex; }

MeshAttribute* find(std::vector<MeshAttribute>& all, const std::string& name) {
  const auto found = std::ranges::find(all, name, &MeshAttribute::name);
  return found == all.end() ? nullptr : &*found;
}

}  // namespace

/// Returns the buffer that the values of several meshes lie in, where they are moved to unless they share one.
std::shared_ptr<Buffer<float>> ValueWriter::join_values(const std::vector<MeshAttribute*>& of) {
  if (std::ranges::all_of(of, [&](const MeshAttribute* a) { return a->values == of[0]->values; })) return of[0]->values;
  std::size_t numbers = 0;
  for (const MeshAttribute* a : of) numbers += a->numbers();
  auto all = std::make_shared<Buffer<float>>(gpu_, numbers, Access::Storage, "attribute '" + of[0]->name + "'");
  std::size_t first = 0;
  for (const MeshAttribute* a : of) {
    all->copy_from(*a->values, a->first, first, a->numbers());
    first += a->numbers();
  }
  first = 0;
  for (MeshAttribute* a : of) {
    a->values = all, a->first = first;
    first += a->numbers();
  }
  return all;
}

/// Puts the vertices of triangles on the device, of meshes with attributes of vertices. Returns where those of each
/// mesh begin; NO_HIT: they come in turn.
std::vector<std::uint32_t> ValueWriter::place_corners() {
  std::vector<std::uint32_t> first;
  std::size_t count = 0;
  for (const AttributedMesh& m : meshes_) {
    const std::size_t own = m.heights         ? 3 * m.heights->triangles()
                            : m.indices_there ? m.indices_there->size()
                                              : m.indices.size();
    const bool any = own && std::ranges::any_of(m.attributes, is_of_vertices);
    first.push_back(any ? std::uint32_t(count) : NO_HIT);
    count += any ? own : 0;
  }
  corners_ = std::make_unique<Buffer<std::uint32_t>>(gpu_, count, Access::Storage, "corners of attributes");
  for (std::size_t m = 0; m < meshes_.size(); ++m) {
    if (first[m] == NO_HIT) continue;
    if (const Buffer<std::uint32_t>* there = meshes_[m].indices_there)
      corners_->copy_from(*there, 0, first[m], there->size());
    else if (meshes_[m].heights)
      corners_->upload(corners_of(*meshes_[m].heights), first[m]);
    else
      corners_->upload(meshes_[m].indices, first[m]);
  }
  return first;
}

/// Makes the table, and what it tells of.
void ValueWriter::join() {
  std::map<std::string, std::vector<MeshAttribute*>> all;
  for (const AttributedMesh& m : meshes_)
    for (MeshAttribute& a : m.attributes) all[a.name].push_back(&a);
  std::vector<std::uint32_t> words = places_.firsts;
  words.insert(words.end(), places_.meshes.begin(), places_.meshes.end());
  const std::vector<std::uint32_t> corners = place_corners();
  std::map<std::string, Joined> joined;
  for (const auto& [name, of] : all) {
    joined[name] = {of[0]->components, join_values(of), words.size()};
    for (std::size_t m = 0; m < meshes_.size(); ++m) {
      const MeshAttribute* a = find(meshes_[m].attributes, name);
      words.insert(words.end(), {a ? std::uint32_t(a->of) : VALUES_NONE, a ? std::uint32_t(a->first) : 0u, corners[m]});
    }
  }
  table_ = std::make_unique<Buffer<std::uint32_t>>(gpu_, words.size(), Access::Storage, "table of attributes");
  table_->upload(words);
  joined_ = std::move(joined);
}

void ValueWriter::record(const std::string& name, const ColumnRecords& from, const RawBuffer& to,
                         const Context::Done& done) {
  if (joined_.empty()) join();
  const Joined& attribute = joined_.at(name);
  const KernelSource source = source_of(attribute.components, from.points);
  std::unique_ptr<Kernel>& kernel = kernels_[source.name];
  if (refresh(gpu_, kernel, source)) gpu_.save_pipeline_cache();
  kernel->bind(BIND_HITS, from.found);
  kernel->bind(BIND_VALUE_TABLE, *table_);
  kernel->bind(BIND_VALUES, *attribute.values);
  kernel->bind(BIND_VALUE_CORNERS, *corners_);
  kernel->bind(BIND_COLUMNS, to);
  for_ranges(gpu_.info(), from, [&](const ColumnRange& range) {
    const ValuesPush push{range.records, range.from, range.to, std::uint32_t(places_.firsts.size()),
                          std::uint32_t(attribute.table)};
    gpu_.pass(
        kernel->name(), [&](Commands& cmd) { kernel->dispatch(cmd, groups_of(range.records, COLUMNS_GROUP), push); },
        done);
  });
}

std::vector<KernelSource> value_sources() {
  std::vector<KernelSource> sources;
  for (const bool points : {false, true})
    for (std::uint32_t components = 1; components <= 4; ++components) sources.push_back(source_of(components, points));
  return sources;
}

}  // namespace ballot
