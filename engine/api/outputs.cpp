#include "engine/api/outputs.h"

#include <algorithm>

#include "engine/api/arrays.h"
#include "engine/api/sums.h"
#include "engine/core/registry.h"

namespace ballot::api {

namespace {

/// What writes the columns of hits and points. Whole records are not written but found.
struct Written {
  std::string_view name;
  std::uint32_t column;  // COLUMN_...
};
constexpr Written kWritten[] = {{"t", COLUMN_DISTANCES},         {"prims", COLUMN_PRIMS},
                                {"mesh_ids", COLUMN_IDS},        {"uvs", COLUMN_UVS},
                                {"normals", COLUMN_NORMALS},     {"occluded", COLUMN_FLAGS},
                                {"instances", COLUMN_INSTANCES}, {"distances", COLUMN_DISTANCES},
                                {"points", COLUMN_POINTS},       {"signed_distances", COLUMN_SIGNED},
                                {"inside", COLUMN_FLAGS}};

template <class T>
bool holds(const BufferState& array) {
  return std::holds_alternative<Buffer<T>>(array.array);
}

bool fits(const door::Row& row, const BufferState& array) {
  switch (row.type) {
    case door::Type::Hits:
      return holds<Hit>(array);
    case door::Type::Nearests:
      return holds<Nearest>(array);
    case door::Type::Floats:
      return row.count == 1 ? holds<float>(array) : row.count == 2 ? holds<glm::vec2>(array) : holds<glm::vec3>(array);
    case door::Type::UInt32s:
      return holds<std::uint32_t>(array);
    case door::Type::Sums:
      return holds<double>(array);
    default:
      return holds<std::uint8_t>(array) || holds<std::uint32_t>(array);
  }
}

/// Writes the normals of records by the host.
void write_normals(SceneState& scene, const ColumnRecords& from, RawBuffer& to) {
  std::vector<Hit> found(from.count);
  if (from.points) {
    std::vector<Nearest> nearest(from.count);
    from.found.download(0, nearest.data(), nearest.size() * sizeof(Nearest));
    for (std::size_t i = 0; i < found.size(); ++i) found[i] = {0, nearest[i].prim, nearest[i].u, nearest[i].v};
  } else {
    from.found.download(0, found.data(), found.size() * sizeof(Hit));
  }
  std::vector<glm::vec3> normals(from.count);
  auto columns = BALLOT_INIT(BallotHits);
  columns.normals = &normals.data()->x;
  HitArrays(columns, scene, RowOrder(), found.size()).write(0, found);
  to.upload(from.to * sizeof(glm::vec3), normals.data(), normals.size() * sizeof(glm::vec3));
}

const char* record_of(const door::Row& row) {
  switch (row.type) {
    case door::Type::Hits:
      return "hits";
    case door::Type::Nearests:
      return "nearest";
    case door::Type::Floats:
      return row.count == 1 ? "float32" : row.count == 2 ? "float32x2" : "float32x3";
    case door::Type::UInt32s:
      return "uint32";
    case door::Type::Sums:
      return "float64";
    default:
      return "uint8 or uint32";
  }
}

}  // namespace

Outputs::Outputs(std::span<const BallotOutput> given, std::span<const door::Row> rows, const SceneState& scene,
                 const BufferState& asked, std::uint64_t count, const char* call)
    : call_(call) {
  if (given.empty()) refuse(fmt::format("{}: no output; expected some of {}", call, names_of(rows)));
  std::vector<const door::Row*> seen;
  for (const BallotOutput& output : given) {
    need(output.column, call, "column of an output");
    const door::Row& row = find_named(rows, output.column.text, "column");
    const std::shared_ptr<BufferState> array = use(output.to);
    if (std::ranges::count(seen, &row)) refuse(fmt::format("{}: output {} is given twice", call, row.name));
    if (std::ranges::count(arrays, array))
      refuse(fmt::format("{}: one array is given for {} and another output", call, row.name));
    if (array.get() == &asked) refuse(fmt::format("{}: the array of {} is what is asked", call, row.name));
    if (!fits(row, *array))
      refuse(fmt::format("{}: the buffer of {} holds other records; expected {}", call, row.name, record_of(row)));
    check_buffer(*array, scene, row.type == door::Type::Sums ? 1 : count, call, row.name);
    add(row, *array);
    seen.push_back(&row);
    arrays.push_back(array);
  }
}

void Outputs::add(const door::Row& row, BufferState& array) {
  if (row.type == door::Type::Hits) {
    hits = &std::get<Buffer<Hit>>(array.array);
  } else if (row.type == door::Type::Nearests) {
    nearest = &std::get<Buffer<Nearest>>(array.array);
  } else if (row.type == door::Type::Sums) {
    sums[std::size_t(std::ranges::find(kSums, row.name) - kSums.begin())] = &std::get<Buffer<double>>(array.array);
  } else {
    std::uint32_t column = find_named(kWritten, row.name, "column on the device").column;
    if (column == COLUMN_FLAGS && holds<std::uint32_t>(array)) column = COLUMN_FLAG_WORDS;
    to[column] = &array.raw();
  }
}

void Outputs::check_sums(const SceneState& scene) const {
  for (std::size_t by = 0; by < kSumsBy; ++by)
    if (sums[by]) need_entries(*scene.places, SumsBy(by), sums[by]->size(), call_);
}

AnswersThere& answers_there(SceneState& scene) {
  if (!scene.there) scene.there = std::make_unique<AnswersThere>(*scene.device->gpu, *scene.places);
  return *scene.there;
}

void record_columns(SceneState& scene, const ColumnRecords& from, const ColumnBuffers& to, const Context::Done& done) {
  ColumnBuffers there = to;
  if (to[COLUMN_NORMALS] && from.count && !ColumnWriter::has_normals(scene.device->gpu->info())) {
    write_normals(scene, from, *to[COLUMN_NORMALS]);
    there[COLUMN_NORMALS] = nullptr;
  }
  if (std::ranges::any_of(there, [](const RawBuffer* one) { return one != nullptr; }))
    answers_there(scene).columns.record(scene.world->tracer().tree(), from, there, done);
}

}  // namespace ballot::api
