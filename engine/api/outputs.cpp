#include "engine/api/outputs.h"

#include <algorithm>

#include "engine/api/arrays.h"
#include "engine/api/mesh_attributes.h"
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
                                {"inside", COLUMN_FLAGS},        {"positions", COLUMN_POSITIONS},
                                {"front", COLUMN_FRONT},         {"materials", COLUMN_MATERIALS},
                                {"colors", COLUMN_COLORS},       {"shading_normals", COLUMN_SHADING_NORMALS}};

template <class T>
bool holds(const BufferState& array) {
  return std::holds_alternative<Buffer<T>>(array.array);
}

/// Returns whether an array holds records of some float32.
bool holds_floats(const BufferState& array, std::size_t numbers) {
  switch (numbers) {
    case 1:
      return holds<float>(array);
    case 2:
      return holds<glm::vec2>(array);
    case 3:
      return holds<glm::vec3>(array);
    default:
      return holds<glm::vec4>(array);
  }
}

const char* floats_name(std::size_t numbers) {
  constexpr const char* kNames[] = {"float32", "float32x2", "float32x3", "float32x4"};
  return kNames[numbers - 1];
}

bool fits(const door::Row& row, const BufferState& array) {
  switch (row.type) {
    case door::Type::Hits:
      return holds<Hit>(array);
    case door::Type::Nearests:
      return holds<Nearest>(array);
    case door::Type::Floats:
      return holds_floats(array, row.count);
    case door::Type::UInt32s:
      return holds<std::uint32_t>(array);
    case door::Type::Sums:
      return holds<double>(array);
    default:
      return holds<std::uint8_t>(array) || holds<std::uint32_t>(array);
  }
}

/// Writes the columns of records that need double by the host.
void write_in_double(SceneState& scene, const ColumnRecords& from, const ColumnBuffers& to) {
  std::vector<Hit> found(from.count);
  if (from.points) {
    std::vector<Nearest> nearest(from.count);
    from.found.download(0, nearest.data(), nearest.size() * sizeof(Nearest));
    for (std::size_t i = 0; i < found.size(); ++i) found[i] = {0, nearest[i].prim, nearest[i].u, nearest[i].v};
  } else {
    from.found.download(0, found.data(), found.size() * sizeof(Hit));
  }
  std::vector<Ray> rays(from.rays ? from.count / from.row : 0);
  if (from.rays) from.rays->download(0, rays.data(), rays.size() * sizeof(Ray));
  const RayArray asked(ballot_rays(reinterpret_cast<const BallotRay*>(rays.data()), rays.size()));
  std::vector<glm::vec3> normals(to[COLUMN_NORMALS] ? from.count : 0);
  std::vector<glm::vec3> positions(to[COLUMN_POSITIONS] ? from.count : 0);
  std::vector<std::uint8_t> front(to[COLUMN_FRONT] || to[COLUMN_FRONT_WORDS] ? from.count : 0);
  auto columns = BALLOT_INIT(BallotHits);
  if (!normals.empty()) columns.normals = &normals.data()->x;
  if (!positions.empty()) columns.positions = &positions.data()->x;
  if (!front.empty()) columns.front = front.data();
  HitArrays(columns, {}, scene, RowOrder(), found.size(), {&asked, from.row}).write(0, found);
  const auto upload = [&](std::uint32_t column, const auto& all) {
    if (to[column]) to[column]->upload(from.to * sizeof(all[0]), all.data(), all.size() * sizeof(all[0]));
  };
  upload(COLUMN_NORMALS, normals);
  upload(COLUMN_POSITIONS, positions);
  upload(COLUMN_FRONT, front);
  upload(COLUMN_FRONT_WORDS, std::vector<std::uint32_t>(front.begin(), front.end()));
}

/// Records the writing of those of the columns that ColumnWriter knows.
void record_geometry(SceneState& scene, const ColumnRecords& from, ColumnBuffers to, const Context::Done& done) {
  const auto in_double = [&](std::uint32_t column) { return to[column] != nullptr; };
  if (from.count && !ColumnWriter::has_double(scene.device->gpu->info()) &&
      std::ranges::any_of(ColumnWriter::kInDouble, in_double)) {
    write_in_double(scene, from, to);
    for (const std::uint32_t column : ColumnWriter::kInDouble) to[column] = nullptr;
  }
  if (std::any_of(to.begin(), to.begin() + COLUMNS, [](const RawBuffer* one) { return one != nullptr; }))
    answers_there(scene).columns.record(scene.world->tracer().tree(), from, to, done);
}

/// Returns what writes the values of attributes of a scene.
ValueWriter& value_writer(SceneState& scene) {
  std::unique_ptr<ValueWriter>& writer = answers_there(scene).values;
  if (writer) return *writer;
  std::vector<AttributedMesh> meshes;
  for (const MeshLabel& label : scene.world->scene_facts().instances.mesh_labels) {
    MeshState& mesh = scene.meshes.at(label.number);
    meshes.push_back({mesh.attributes, mesh.indices, mesh.indices_there.get(), mesh.heights});
  }
  writer = std::make_unique<ValueWriter>(*scene.device->gpu, scene.places->sum_table(), std::move(meshes));
  return *writer;
}

const char* record_of(const door::Row& row) {
  switch (row.type) {
    case door::Type::Hits:
      return "hits";
    case door::Type::Nearests:
      return "nearest";
    case door::Type::Floats:
      return floats_name(row.count);
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
    : call_(call), rows_(rows) {
  if (given.empty()) refuse(fmt::format("{}: no output; expected some of {}", call, names_of(rows)));
  std::vector<std::string> seen;
  for (const BallotOutput& output : given) {
    need(output.column, call, "column of an output");
    const std::string name = output.column.text;
    const door::Row* row = find_row(rows, name);
    const std::shared_ptr<BufferState> array = use(output.to);
    if (std::ranges::count(seen, name)) refuse(fmt::format("{}: output {} is given twice", call, name));
    if (std::ranges::count(arrays, array))
      refuse(fmt::format("{}: one array is given for {} and another output", call, name));
    if (array.get() == &asked) refuse(fmt::format("{}: the array of {} is what is asked", call, name));
    if (row && row->type == door::Type::Doubles)
      refuse(
          fmt::format("{}: {} goes to the host's memory alone, not to an array on the device; expected the output "
                      "in float32",
                      call, name));
    if (row && !fits(*row, *array))
      refuse(fmt::format("{}: the buffer of {} holds other records; expected {}", call, name, record_of(*row)));
    if (row)
      add(*row, *array);
    else
      to.values.push_back({name, &array->raw()});
    check_buffer(*array, scene, row && row->type == door::Type::Sums ? 1 : count, call, name.c_str());
    seen.push_back(name);
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
  } else if (std::string_view(row.name) == "windings") {
    windings = &std::get<Buffer<float>>(array.array);
  } else {
    std::uint32_t column = find_named(kWritten, row.name, "column on the device").column;
    if (column == COLUMN_FLAGS && holds<std::uint32_t>(array)) column = COLUMN_FLAG_WORDS;
    if (column == COLUMN_FRONT && holds<std::uint32_t>(array)) column = COLUMN_FRONT_WORDS;
    to.columns[column] = &array.raw();
  }
}

void Outputs::check_held(const SceneState& scene) const {
  for (const Targets::Values& v : to.values) {
    const MeshAttribute* attribute = find_attribute(scene, v.attribute);
    if (!attribute) find_named(rows_, v.attribute, "column or attribute");
    const auto array = std::ranges::find(arrays, v.to, [](const auto& a) { return &a->raw(); });
    if (!holds_floats(**array, attribute->components))
      refuse(fmt::format("{}: the buffer of {} holds other records; expected {}", call_, v.attribute,
                         floats_name(attribute->components)));
  }
  for (std::size_t by = 0; by < kSumsBy; ++by)
    if (sums[by]) need_entries(*scene.places, SumsBy(by), sums[by]->size(), call_);
}

AnswersThere& answers_there(SceneState& scene) {
  if (!scene.there) scene.there = std::make_unique<AnswersThere>(*scene.device->gpu, *scene.places);
  return *scene.there;
}

void record_columns(SceneState& scene, const ColumnRecords& from, const Targets& to, const Context::Done& done) {
  record_geometry(scene, from, to.columns, done);
  if (RawBuffer* const normals = to.columns[COLUMN_SHADING_NORMALS]) {  // which begin as those of the triangles
    ColumnBuffers flat{};
    flat[COLUMN_NORMALS] = normals;
    record_geometry(scene, from, flat, done);
  }
  if (to.any_of({COLUMN_MATERIALS, COLUMN_COLORS, COLUMN_SHADING_NORMALS}))
    scene.world->surface_columns().record(from, to.columns, done);
  for (const Targets::Values& v : to.values) value_writer(scene).record(v.attribute, from, *v.to, done);
}

}  // namespace ballot::api
