#include "engine/answer/columns.h"

#include <algorithm>
#include <bit>

#include "engine/tree/host/forest.h"

namespace ballot {

namespace {

constexpr std::uint32_t bit(std::uint32_t column) { return 1u << column; }
constexpr std::uint32_t kOfTable = bit(COLUMN_PRIMS) | bit(COLUMN_IDS) | bit(COLUMN_INSTANCES);
constexpr std::uint32_t kOfRays = bit(COLUMN_POSITIONS) | bit(COLUMN_FRONT) | bit(COLUMN_FRONT_WORDS);
constexpr std::uint32_t kOfCorners = bit(COLUMN_NORMALS) | kOfRays;
constexpr std::uint32_t kOfSides = bit(COLUMN_FLAGS) | bit(COLUMN_FLAG_WORDS) | bit(COLUMN_SIGNED);

/// The configuration of a kernel.
struct Config {
  std::uint32_t columns = 0;  // bits
  bool points = false, parity = false, ranges = false, moved = false, shapes = false;
};

KernelSource source_of(const Config& c) {
  KernelSource source{.file = "query/columns.comp",
                      .defines = {{"BALLOT_COLUMNS", int(c.columns)},
                                  {"BALLOT_POINTS", c.points},
                                  {"BALLOT_PARITY", c.parity && c.columns & kOfSides},
                                  {"BALLOT_RANGES", c.ranges && c.columns & bit(COLUMN_IDS)},
                                  {"BALLOT_MOVED", c.moved && c.columns & kOfCorners},
                                  {"BALLOT_SHAPES", c.shapes && c.columns & kOfRays}},
                      .group_size = COLUMNS_GROUP};
  source.name = "query.columns";
  for (const auto& [define, value] : source.defines) source.name += fmt::format(" {}={}", define, value);
  return source;
}

std::uint32_t bits_of(const ColumnBuffers& to) {
  std::uint32_t bits = 0;
  for (std::uint32_t i = 0; i < COLUMNS; ++i) bits |= to[i] ? bit(i) : 0;
  return bits;
}

/// Returns the words of BIND_CORNER_TABLE; `first_of`: of each mesh, its first triangle among the corners.
std::vector<std::uint32_t> corner_words(const Forest& forest, const std::vector<std::uint32_t>& first_of) {
  std::vector<std::uint32_t> words(CORNER_WORDS * forest.size());
  for (std::size_t i = 0; i < forest.size(); ++i) {
    words[i] = forest.first_of(i);
    std::uint32_t* to = &words[forest.size() + (CORNER_WORDS - 1) * i];
    const bool has_corners = forest.meshes()[forest.mesh_of(i)].kind == ShapeKind::Triangles;
    *to++ = has_corners ? first_of[forest.mesh_of(i)] : NO_HIT;
    for (const auto& row : forest.transforms()[i].m)
      for (const float x : row) *to++ = std::bit_cast<std::uint32_t>(x);
  }
  return words;
}

/// Returns a buffer of `count` records, which may be another one than before.
template <class T>
Buffer<T>& sized(std::optional<Buffer<T>>& buffer, Context& gpu, std::size_t count, const char* name) {
  if (buffer && buffer->size() == count) return *buffer;
  buffer.reset();
  return buffer.emplace(gpu, count, Access::Storage, name);
}

/// Returns the first triangle of each mesh among those of all.
std::vector<std::uint32_t> firsts_of(const Forest& forest) {
  std::vector<std::uint32_t> firsts;
  std::uint32_t first = 0;
  for (const MeshTree& mesh : forest.meshes()) {
    firsts.push_back(first);
    first += std::uint32_t(mesh.triangles.size());
  }
  firsts.push_back(first);
  return firsts;
}

}  // namespace

/// Gathers the triangles of all trees.
void ColumnWriter::gather(DeviceTree& tree) {
  const std::vector<std::uint32_t> firsts =
      tree.forest() ? firsts_of(*tree.forest()) : std::vector{0u, std::uint32_t(tree.triangles().size())};
  Buffer<Triangle>& all = sized(corners_.own, gpu_, firsts.back(), "corners of triangles");
  UnsetVector<Triangle> here;  // of meshes side by side that the host has
  const auto send = [&](std::size_t mesh) {
    if (!here.empty()) all.upload(here, firsts[mesh] - here.size());
    here.clear();
  };
  for (std::size_t m = 0; m + 1 < firsts.size(); ++m) {
    if (const auto& built = tree.built(m)) {
      send(m);
      all.copy_from(built->triangles(), 0, firsts[m], built->triangles().size());
    } else {
      const std::span<const Triangle> triangles = tree.triangles(m);
      here.insert(here.end(), triangles.begin(), triangles.end());
    }
  }
  send(firsts.size() - 1);
}

const RawBuffer& ColumnWriter::corners_of(DeviceTree& tree) {
  const Forest* forest = tree.forest();
  if (!forest && tree.built()) return tree.built()->triangles();
  const std::uint64_t of_tree = forest ? 0 : tree.generation(), of_forest = forest ? forest->exchanges() : 0;
  if (corners_.own && corners_.of_tree == of_tree && corners_.of_forest == of_forest) return *corners_.own;
  corners_.of_tree = corners_.of_forest = 0;
  gather(tree);
  corners_.of_tree = of_tree, corners_.of_forest = of_forest;
  return *corners_.own;
}

const RawBuffer& ColumnWriter::corner_table_of(const DeviceTree& tree) {
  if (corners_.table && corners_.generation == tree.generation()) return *corners_.table;
  const std::vector<std::uint32_t> words = corner_words(*tree.forest(), firsts_of(*tree.forest()));
  corners_.generation = 0;
  sized(corners_.table, gpu_, words.size(), "instances of corners").upload(words);
  corners_.generation = tree.generation();
  return *corners_.table;
}

void ColumnWriter::bind(Kernel& kernel, DeviceTree& tree, const ColumnRecords& from, const ColumnBuffers& to) {
  if (kernel.wants(BIND_HITS)) kernel.bind(BIND_HITS, from.found);
  for (std::uint32_t i = 0; i < COLUMNS; ++i)
    if (to[i]) kernel.bind(BIND_COLUMNS + i, *to[i]);
  if (kernel.wants(BIND_RAYS)) kernel.bind(BIND_RAYS, *from.rays);
  if (kernel.wants(BIND_CROSSINGS)) kernel.bind(BIND_CROSSINGS, *from.inside);
  if (kernel.wants(BIND_CORNERS)) kernel.bind(BIND_CORNERS, corners_of(tree));
  if (kernel.wants(BIND_CORNER_TABLE)) kernel.bind(BIND_CORNER_TABLE, corner_table_of(tree));
  if (!kernel.wants(BIND_PRIM_TABLE)) return;
  if (!table_there_) {
    table_there_.emplace(gpu_, table_.words.size(), Access::Storage, "meshes and instances of triangles");
    table_there_->upload(table_.words);
  }
  kernel.bind(BIND_PRIM_TABLE, *table_there_);
}

void ColumnWriter::record(DeviceTree& tree, const ColumnRecords& from, const ColumnBuffers& to,
                          const Context::Done& done) {
  const Forest* forest = tree.forest();
  const KernelSource source = source_of({bits_of(to), from.points, from.inside != nullptr, table_.ranges != 0,
                                         forest != nullptr, forest && forest->facts().shapes != 0});
  std::unique_ptr<Kernel>& kernel = kernels_[source.name];
  if (refresh(gpu_, kernel, source)) gpu_.save_pipeline_cache();
  bind(*kernel, tree, from, to);
  for_ranges(gpu_.info(), from, [&](const ColumnRange& range) {
    const ColumnsPush push{range.records,     range.from,    range.to,
                           table_.placements, table_.ranges, std::uint32_t(forest ? forest->size() : 0),
                           from.row};
    gpu_.pass(
        kernel->name(), [&](Commands& cmd) { kernel->dispatch(cmd, groups_of(range.records, COLUMNS_GROUP), push); },
        done);
  });
}

std::vector<KernelSource> column_sources() {
  constexpr std::uint32_t kOfHits = (bit(COLUMN_POINTS) - 1) | kOfRays;
  constexpr std::uint32_t kOfPoints = (bit(COLUMNS) - 1) & ~(bit(COLUMN_INSTANCES) | kOfRays);
  std::vector<KernelSource> sources;
  const auto add = [&](std::uint32_t all, const Config& how) {
    Config one = how;
    one.columns = all;
    sources.push_back(source_of(one));
    for (one.columns = 1; one.columns <= all; one.columns <<= 1)
      if (all & one.columns) sources.push_back(source_of(one));
  };
  for (const bool other : {false, true}) {
    add(kOfPoints, {.points = true, .parity = other, .ranges = other, .moved = other});
    for (const bool shapes : {false, other}) add(kOfHits, {.ranges = other, .moved = other, .shapes = shapes});
  }
  return sources;
}

}  // namespace ballot
