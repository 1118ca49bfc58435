// How the types of ballot_types.h become those of the C interface. Not for use outside of ballot.h.
#pragma once

#include <algorithm>
#include <type_traits>
#include <utility>
#include <vector>

#include "ballot_types.h"

namespace ballot {
inline namespace v1 {
namespace detail {

inline DeviceInfo info_of(const BallotDeviceInfo& i) {
  return {i.name, i.driver, i.refusal, i.is_cpu != 0, i.subgroup_size, i.exports != 0};
}

/// Owns a handle of the C interface.
template <class T, void (*kClose)(T*)>
class Handle {
 public:
  Handle() = default;
  explicit Handle(T* handle) : handle_(handle) {}
  ~Handle() { kClose(handle_); }
  Handle(Handle&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  T* get() const { return handle_; }

 private:
  T* handle_ = nullptr;
};

/// Gives a struct of the C interface a progress function. Refers to the function.
template <class To>
void set_progress(To& to, const std::function<bool(double)>& progress) {
  if (!progress) return;
  to.user = const_cast<void*>(static_cast<const void*>(&progress));
  to.progress = [](void* user, double done) {
    return int(!(*static_cast<const std::function<bool(double)>*>(user))(done));
  };
}

/// Returns an array of zeros. Throws Error(Memory) if there is no room for it.
template <class T>
std::vector<T> room_for(std::size_t count) {
  try {
    return std::vector<T>(count);
  } catch (const std::exception&) {  // bad_alloc, or more than a vector holds
    throw Error(Code::Memory, "the host has too little memory for " + std::to_string(count) + " results of " +
                                  std::to_string(sizeof(T)) + " bytes; ask for less at a time");
  }
}

/// A query in the form of the C interface. Refers to the query.
class QueryArgument {
 public:
  explicit QueryArgument(const Query& q) : c_(BALLOT_INIT(BallotQuery)) {
    c_.any = q.any;
    c_.method = q.method.c_str();
    c_.numeric = q.numeric.c_str();
    for (const auto& [name, value] : q.knobs) knobs_.push_back({name.c_str(), value.c_str()});
    c_.knobs = knobs_.data();
    c_.knob_count = knobs_.size();
    if (!q.ray_class.empty()) c_.ray_class = q.ray_class.c_str();
    set_progress(c_, q.progress);
  }
  QueryArgument(const QueryArgument&) = delete;
  QueryArgument& operator=(const QueryArgument&) = delete;
  const BallotQuery* c() const { return &c_; }

 private:
  std::vector<BallotKnob> knobs_;
  BallotQuery c_;
};

/// The record of a type of array on the device.
template <class T>
struct RecordOf;
template <>
struct RecordOf<Ray> : std::integral_constant<BallotRecord, BALLOT_RECORD_RAY> {};
template <>
struct RecordOf<Hit> : std::integral_constant<BallotRecord, BALLOT_RECORD_HIT> {};
template <>
struct RecordOf<Point> : std::integral_constant<BallotRecord, BALLOT_RECORD_POINT> {};
template <>
struct RecordOf<NearestPoint> : std::integral_constant<BallotRecord, BALLOT_RECORD_NEAREST> {};
template <>
struct RecordOf<float> : std::integral_constant<BallotRecord, BALLOT_RECORD_SIGNED_DISTANCE> {};
template <>
struct RecordOf<std::uint32_t> : std::integral_constant<BallotRecord, BALLOT_RECORD_INSIDE> {};

inline BallotHits hits_of(const Results& r) {
  auto h = BALLOT_INIT(BallotHits);
  h.hits = r.hits, h.t = r.t, h.prims = r.prims, h.mesh_ids = r.mesh_ids, h.uvs = r.uvs, h.normals = r.normals;
  h.occluded = r.occluded, h.instances = r.instances;
  return h;
}

inline std::size_t count_of(const std::size_t (&shape)[BALLOT_AXES]) {
  std::size_t count = shape[0];
  for (std::size_t a = 1; a < BALLOT_AXES && shape[a]; ++a) count *= shape[a];
  return count;
}

/// The columns of a view, as the C interface has them. Refers to them.
class Table {
 public:
  Table(std::string what, const Shape& from, std::size_t (&shape)[BALLOT_AXES])
      : what_(std::move(what)), shape_(shape), has_shape_(from[0] != 0) {
    std::copy(from.begin(), from.end(), shape);
  }
  /// Fills a column whose entries have `width` numbers. The longest one says how many questions there are, if the view
  /// has no shape. Throws Error(Argument) if its numbers are no multiple.
  void add(const Column& from, std::size_t width, std::string name, BallotColumn& to) {
    if (from.kind == Column::Kind::None) return;
    to.data = from.kind == Column::Kind::Own ? from.own.data() : from.data;
    to.type = from.type, to.gap = from.gap;
    std::copy(from.strides.begin(), from.strides.end(), to.stride);
    if (from.kind == Column::Kind::Strided) return;
    if (from.numbers % width || (from.kind == Column::Kind::Own && from.numbers != width))
      throw Error(Code::Argument, what_ + ": " + name + " has " + std::to_string(from.numbers) + " numbers; expected " +
                                      std::to_string(width) + " of each");
    rows_.push_back({&to, from.numbers / width, width * (from.type == BALLOT_FLOAT64 ? 8 : 4), std::move(name)});
    if (!has_shape_ && (rows_.size() == 1 || shape_[0] == 1)) shape_[0] = rows_.back().entries;
  }
  /// Sets the strides of numbers that lie side by side. Throws Error(Argument) unless they are one for all or as many
  /// as the questions.
  void fit() {
    for (const Row& row : rows_) {
      if (row.entries == 1) continue;
      if (row.entries != count_of(shape_))
        throw Error(Code::Argument, what_ + ": " + row.name + " has " + std::to_string(row.entries) + " for " +
                                        std::to_string(count_of(shape_)) + " " + what_ +
                                        "; expected as many, or one for all");
      auto stride = std::ptrdiff_t(row.bytes);
      std::size_t axes = 1;
      while (axes < BALLOT_AXES && shape_[axes]) ++axes;
      for (std::size_t a = axes; a-- > 0; stride *= std::ptrdiff_t(shape_[a])) row.to->stride[a] = stride;
    }
  }

 private:
  struct Row {
    BallotColumn* to;
    std::size_t entries, bytes;
    std::string name;
  };
  std::string what_;
  std::size_t (&shape_)[BALLOT_AXES];
  bool has_shape_;
  std::vector<Row> rows_;
};

inline BallotRays rays_of(const RayView& rays) {
  auto r = BALLOT_INIT(BallotRays);
  Table table("rays", rays.shape, r.shape);
  table.add(rays.origins, 3, "origins", r.origin);
  table.add(rays.directions, 3, "directions", r.direction);
  table.add(rays.t_min, 1, "t_min", r.t_min);
  table.add(rays.t_max, 1, "t_max", r.t_max);
  table.fit();
  return r;
}
inline BallotRays rays_of(std::span<const Ray> rays) { return ballot_rays(rays.data(), rays.size()); }

inline BallotPoints points_of(const PointView& points, const PointQuery& query) {
  auto p = BALLOT_INIT(BallotPoints);
  Table table("points", points.shape, p.shape);
  table.add(points.at, 3, "at", p.at);
  table.add(query.limit, 1, "limit", p.limit);
  table.fit();
  return p;
}

inline BallotPointQuery point_query_of(const PointQuery& query) {
  auto q = BALLOT_INIT(BallotPointQuery);
  q.assume_closed = query.assume_closed;
  q.numeric = query.numeric.c_str();
  q.sign = std::uint32_t(query.sign);
  set_progress(q, query.progress);
  return q;
}

inline BallotNearest nearest_of(const NearestResults& r) {
  auto n = BALLOT_INIT(BallotNearest);
  n.distances = r.distances, n.points = r.points, n.prims = r.prims, n.mesh_ids = r.mesh_ids, n.uvs = r.uvs;
  n.normals = r.normals, n.signed_distances = r.signed_distances, n.inside = r.inside;
  return n;
}

inline BallotLists lists_of(const CrossingQuery& query, std::size_t rays) {
  if (!query.ray_masks.empty() && query.ray_masks.size() != rays)
    throw Error(Code::Argument, "crossings: " + std::to_string(query.ray_masks.size()) + " masks of rays, but " +
                                    std::to_string(rays) + " rays; expected as many");
  auto lists = BALLOT_INIT(BallotLists);
  lists.most = query.most;
  lists.numeric = query.numeric.c_str();
  lists.cull = std::uint32_t(query.cull);
  lists.alpha = query.alpha;
  lists.ray_masks = query.ray_masks.empty() ? nullptr : query.ray_masks.data();
  set_progress(lists, query.progress);
  return lists;
}

/// What a list of crossings goes to.
struct Listing {
  Crossings all;
  const std::function<bool(double)>& progress;
  bool full = false;  // there was no memory for more
};

/// Makes a call add what it lists.
inline void list_into(Listing& listing, BallotLists& lists) {
  lists.user = &listing;
  if (listing.progress)
    lists.progress = [](void* user, double done) { return int(!static_cast<Listing*>(user)->progress(done)); };
  lists.take = [](void* user, std::uint64_t, std::size_t rays, const std::uint32_t* counts, const BallotHit* hits) {
    auto& to = static_cast<Listing*>(user)->all;
    std::size_t total = 0;
    for (std::size_t i = 0; i < rays; ++i) total += counts[i];
    try {
      to.counts.insert(to.counts.end(), counts, counts + rays);
      to.hits.insert(to.hits.end(), hits, hits + total);
    } catch (...) {
      static_cast<Listing*>(user)->full = true;
      return 1;
    }
    return 0;
  };
}

/// Refuses sizes of pictures before memory is taken for them.
inline void check_size(std::uint32_t width, std::uint32_t height) {
  if (width < 1 || height < 1 || width > 16384 || height > 16384)
    throw Error(Code::Argument, "the picture is " + std::to_string(width) + " x " + std::to_string(height) +
                                    " pixels; expected 1 to 16384 each");
}

inline Times times_of(const BallotTimes& t) { return {t.seconds, t.device_ms, t.hits}; }

inline std::size_t vertices(std::span<const float> positions, std::size_t stride) {
  if (stride == 0) stride = 3 * sizeof(float);
  const std::size_t bytes = positions.size_bytes();
  return bytes < 3 * sizeof(float) ? 0 : (bytes - 3 * sizeof(float)) / stride + 1;
}
inline BallotMesh mesh_of(const Mesh& m) {
  auto mesh = BALLOT_INIT(BallotMesh);
  mesh.positions = m.positions.data();
  mesh.vertex_count = vertices(m.positions, m.stride);
  mesh.position_stride = m.stride;
  if (!m.indices.empty()) {
    mesh.indices = m.indices.data(), mesh.index_count = m.indices.size(), mesh.index_type = BALLOT_INDEX_U32;
  } else if (!m.indices16.empty()) {
    mesh.indices = m.indices16.data(), mesh.index_count = m.indices16.size(), mesh.index_type = BALLOT_INDEX_U16;
  }
  mesh.id = m.id;
  if (m.normals.empty()) return mesh;
  if (m.normals.size() < 3 * mesh.vertex_count)
    throw Error(Code::Argument, "mesh: " + std::to_string(m.normals.size()) + " numbers of normals, but " +
                                    std::to_string(mesh.vertex_count) + " vertices; expected three for each");
  mesh.normals = m.normals.data();
  return mesh;
}
inline std::size_t matrices(std::span<const float> transforms, std::size_t stride) {
  if (stride == 0) stride = 12 * sizeof(float);
  const std::size_t bytes = transforms.size_bytes();
  return bytes < 12 * sizeof(float) ? 0 : (bytes - 12 * sizeof(float)) / stride + 1;
}
inline BallotInstances instances_of(const Instances& i) {
  auto instances = BALLOT_INIT(BallotInstances);
  instances.count = matrices(i.transforms, i.stride);
  instances.transforms = i.transforms.data();
  instances.transform_stride = i.stride;
  if (!i.masks.empty() && i.masks.size() != instances.count)
    throw Error(Code::Argument, "instances: " + std::to_string(i.masks.size()) + " masks, but " +
                                    std::to_string(instances.count) + " matrices; expected as many");
  instances.masks = i.masks.empty() ? nullptr : i.masks.data();
  if (i.meshes.empty()) return instances;
  if (i.meshes.size() != instances.count)
    throw Error(Code::Argument, "instances: " + std::to_string(i.meshes.size()) + " numbers of meshes, but " +
                                    std::to_string(instances.count) + " matrices; expected as many");
  instances.meshes = i.meshes.data();
  return instances;
}
inline void check_as_many(const char* what, std::size_t found, std::size_t instances) {
  if (found != instances)
    throw Error(Code::Argument, "instances: " + std::to_string(found) + " " + what + ", but " +
                                    std::to_string(instances) + " numbers of instances; expected as many");
}
inline BallotSceneOptions options_of(const SceneOptions& options) {
  auto o = BALLOT_INIT(BallotSceneOptions);
  if (!options.builder.empty()) o.builder = options.builder.c_str();
  o.max_leaf = options.max_leaf;
  o.split_budget = options.split_budget > 0 ? options.split_budget : -1;
  o.cache = options.cache;
  o.update = options.update.c_str();
  o.expected_rays = options.expected_rays;
  o.allow_outside = options.allow_outside;
  o.instances = options.instances.c_str();
  if (!options.ids.empty()) o.ids = options.ids.c_str();
  o.layout = options.layout.c_str();
  set_progress(o, options.progress);
  return o;
}

inline SceneInfo scene_info_of(BallotScene* scene) {
  auto i = BALLOT_INIT(BallotSceneInfo);
  check(ballot_scene_info(scene, &i));
  SceneInfo info{i.triangles, i.degenerate, i.meshes, i.views,        {}, {}, i.nodes,
                 i.leaves,    i.depth,      i.sah,    i.build_seconds};
  info.decay = i.decay, info.update_seconds = i.update_seconds, info.refits = i.refits, info.trees = i.trees;
  info.instances = i.instances, info.instance_triangles = i.instance_triangles, info.top_seconds = i.top_seconds;
  for (int axis = 0; axis < 3; ++axis) info.lo[axis] = i.lo[axis], info.hi[axis] = i.hi[axis];
  return info;
}
inline MeshInfo mesh_info_of(BallotScene* scene, std::size_t mesh) {
  auto i = BALLOT_INIT(BallotMeshInfo);
  check(ballot_scene_mesh(scene, mesh, &i));
  MeshInfo info{i.name, i.id, i.first, i.triangles};
  info.mesh = i.mesh;
  for (int axis = 0; axis < 3; ++axis) info.lo[axis] = i.lo[axis], info.hi[axis] = i.hi[axis];
  return info;
}
inline InstanceInfo instance_info_of(BallotScene* scene, std::size_t instance) {
  auto i = BALLOT_INIT(BallotInstanceInfo);
  check(ballot_scene_instance(scene, instance, &i));
  InstanceInfo info{i.name, i.id, i.mesh, i.first, i.triangles};
  info.instance = i.instance, info.mask = i.mask;
  for (int k = 0; k < 12; ++k) info.transform[k] = i.transform[k];
  for (int axis = 0; axis < 3; ++axis) info.lo[axis] = i.lo[axis], info.hi[axis] = i.hi[axis];
  return info;
}

inline BallotView view_of(const View& view) {
  auto v = BALLOT_INIT(BallotView);
  if (!view.name.empty()) v.name = view.name.c_str();
  for (int axis = 0; axis < 3; ++axis)
    v.eye[axis] = view.eye[axis], v.target[axis] = view.target[axis], v.up[axis] = view.up[axis];
  v.yfov = view.yfov, v.ymag = view.ymag;
  return v;
}

}  // namespace detail
}  // namespace v1
}  // namespace ballot
