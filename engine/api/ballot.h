// The C++ interface of Ballot: fast, correct ray queries by Vulkan compute, on any Vulkan 1.2 device, such as a GPU
// without ray tracing hardware or, through Mesa lavapipe, a plain CPU. C++20; needs the standard library alone.
//
//   ballot::Device device;                                    // the best GPU, else a CPU device
//   ballot::Scene scene(device, {ballot::mesh(vertices, triangles)});
//   std::vector<ballot::Hit> hits(rays.size());
//   scene.trace(rays, hits);                                  // nearest hits, watertight
//   std::vector<std::uint8_t> blocked(rays.size());
//   scene.trace(rays, {.occluded = blocked.data()}, {.any = true});
//
// Errors    Every failure throws ballot::Error: a code, and a text of one line that says what, where, found, expected,
//           and what to do. A call with wrong arguments writes nothing to its outputs; one that fails later, or is
//           interrupted, may have written a part. A failed call leaves scenes
//           as they were.
// Threads   Every function may be called from any thread. Calls on one device, its scenes and its arrays run one after
//           another; devices are independent of each other. A device does not survive fork().
// Lifetime  Scenes, arrays and jobs keep their device open, so objects may be destroyed in any order.
// Units     Lengths are in scene units, angles in radians. t counts multiples of a ray's direction, which need not be
//           of unit length.
// Numerics  "watertight" (the default): no ray slips between triangles that share an edge; hits are equal bit for bit
//           for every method on one device. "exact": every answer is that of arithmetic without rounding, on every
//           device. "double": watertight in float64, of vertices and rays in double. "plain" and "fast": the usual
//           float32, without promises. The guide, engine/api/README.md, says which to choose.
//
// Link with find_package(Ballot 1 CONFIG) and Ballot::ballot, or with pkg-config ballot. The layer is header-only, over
// the C interface of ballot_c.h, so that the library's binary interface does not depend on the compiler.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include "ballot_device.h"
#include "ballot_kernel.h"
#include "ballot_scene_facts.h"
#include "ballot_views.h"

namespace ballot {
inline namespace v1 {

/// A scene on a device.
class Scene : public SceneFacts {
 public:
  /// Makes a scene of meshes, each of which lies in the world, once. Meshes and their instances are numbered from 0,
  /// and triangles through the instances. Triangles without area keep their number and are never hit. Throws
  /// Error(BALLOT_ERROR_ARGUMENT), which names mesh and vertex or index, if a number is not finite, an index is out of
  /// range, a mesh is empty, or there are more than 2^31 - 1 triangles.
  Scene(const Device& device, std::span<const Mesh> meshes, const SceneOptions& options = {})
      : Scene(device, meshes, nullptr, options) {}
  /// The same for meshes in braces.
  Scene(const Device& device, std::initializer_list<Mesh> meshes, const SceneOptions& options = {})
      : Scene(device, std::span(meshes.begin(), meshes.size()), nullptr, options) {}

  /// Makes a scene of instances: the tree of each mesh is built once, and a tree over the instances lies above. Method
  /// "packet-wide" does not trace it. ballot_scene_create() says what an instance's hits are, and which transforms are
  /// refused with Error(BALLOT_ERROR_ARGUMENT).
  Scene(const Device& device, std::span<const Mesh> meshes, const Instances& instances,
        const SceneOptions& options = {})
      : Scene(device, meshes, &instances, options) {}
  /// The same for meshes in braces.
  Scene(const Device& device, std::initializer_list<Mesh> meshes, const Instances& instances,
        const SceneOptions& options = {})
      : Scene(device, std::span(meshes.begin(), meshes.size()), &instances, options) {}

  /// Loads a glTF 2.0 (.gltf, .glb), OBJ, PLY or STL file, with its cameras and materials: nodes of glTF and groups of
  /// OBJ are meshes() or instances(). Throws Error(BALLOT_ERROR_WORK), which names the place, if the file is wrong.
  static Scene load(const Device& device, const std::string& path, const SceneOptions& options = {.cache = 1}) {
    BallotScene* scene = nullptr;
    check(ballot_scene_load(device.handle(), path.c_str(), &options, &scene));
    return Scene(scene);
  }

  /// Edits gather until commit() makes all of them true at once, or throws: then the scene is as it was. The edits are
  /// gone either way. Until then answers are those of the scene as it was. Meshes and instances are named by numbers,
  /// which stay; each is given once. A call that throws adds nothing to the edits. Scenes with animations refuse them.
  ///
  /// add_mesh() returns the mesh's number; it has no instance yet. Throws as the constructor.
  std::uint32_t add_mesh(const Mesh& mesh) {
    std::uint32_t number = 0;
    check(ballot_scene_add_mesh(handle_.get(), &mesh, &number));
    return number;
  }
  /// Gives a mesh other triangles, any number of them. Throws as add_mesh().
  void replace_mesh(std::uint32_t mesh, const Mesh& with) {
    check(ballot_scene_replace_mesh(handle_.get(), mesh, &with));
  }
  /// Removes a mesh and its instances.
  void remove_mesh(std::uint32_t mesh) { check(ballot_scene_remove_mesh(handle_.get(), mesh)); }

  /// Moves the vertices of a mesh: as many positions as it was made with; of a mesh of a file three a triangle. They
  /// are read by commit(): keep them until then. SceneOptions::updates says how the tree follows.
  void set_vertices(std::uint32_t mesh, std::span<const float> positions, std::size_t stride = 0) {
    const Mesh to = ballot::mesh(positions, std::span<const std::uint32_t>(), stride);
    check(ballot_scene_set_vertices(handle_.get(), mesh, to.positions, to.vertex_count, stride));
  }
  /// The same in double, read by the call.
  void set_vertices(std::uint32_t mesh, std::span<const double> positions, std::size_t stride = 0) {
    const Mesh to = ballot::mesh(positions, {}, stride);
    check(ballot_scene_set_vertices_double(handle_.get(), mesh, to.positions_double, to.vertex_count, stride));
  }
  /// The same by the first records of an array on the device, which commit() reads there: keep what it holds until
  /// then. ballot_scene_set_vertex_buffer() tells when the host sees them.
  void set_vertices(std::uint32_t mesh, const Array<Vertex>& vertices) {
    check(ballot_scene_set_vertex_buffer(handle_.get(), mesh, vertices.handle()));
  }

  /// Moves a mesh of heights: as many as it was made with, read by the call.
  void set_heights(std::uint32_t mesh, std::span<const float> heights) {
    check(ballot_scene_set_heights(handle_.get(), mesh, heights.data(), heights.size(), 0));
  }

  /// Gives a mesh an attribute, in the place of one of this name that it has. No tree changes.
  void set_attribute(std::uint32_t mesh, const Attribute& attribute) {
    check(ballot_scene_set_attribute(handle_.get(), mesh, &attribute));
  }

  /// Adds instances of meshes and returns their numbers.
  std::vector<std::uint32_t> add_instances(const Instances& instances) {
    std::vector<std::uint32_t> numbers(instances.count);
    check(ballot_scene_add_instances(handle_.get(), &instances, numbers.data()));
    return numbers;
  }
  /// Removes instances, named by their numbers.
  void remove_instances(std::span<const std::uint32_t> instances) {
    check(ballot_scene_remove_instances(handle_.get(), instances.data(), instances.size()));
  }

  /// Moves all instances, in the order of their numbers: a matrix for each, which commit() reads: keep them until then.
  void set_transforms(std::span<const float> transforms, std::size_t stride = 0) {
    check(ballot_scene_set_transforms(handle_.get(), nullptr, transforms.data(), detail::matrices(transforms, stride),
                                      stride));
  }
  /// The same in double, read by the call.
  void set_transforms(std::span<const double> transforms, std::size_t stride = 0) {
    check(ballot_scene_set_transforms_double(handle_.get(), nullptr, transforms.data(),
                                             detail::matrices(transforms, stride), stride));
  }
  /// The same by the first records of an array on the device, which commit() reads there where the tree over the
  /// instances is: keep what it holds until then. ballot_scene_set_transform_buffer() tells when that is.
  void set_transforms(const Array<Matrix>& transforms) {
    check(ballot_scene_set_transform_buffer(handle_.get(), transforms.handle()));
  }
  /// Moves the instances that are named, a matrix for each.
  void set_transforms(std::span<const std::uint32_t> instances, std::span<const float> transforms,
                      std::size_t stride = 0) {
    detail::check_as_many("matrices", detail::matrices(transforms, stride), "numbers of instances", instances.size());
    if (instances.empty()) return;
    check(ballot_scene_set_transforms(handle_.get(), instances.data(), transforms.data(), instances.size(), stride));
  }

  /// The same in double, read by the call.
  void set_transforms(std::span<const std::uint32_t> instances, std::span<const double> transforms,
                      std::size_t stride = 0) {
    detail::check_as_many("matrices", detail::matrices(transforms, stride), "numbers of instances", instances.size());
    if (instances.empty()) return;
    check(ballot_scene_set_transforms_double(handle_.get(), instances.data(), transforms.data(), instances.size(),
                                             stride));
  }

  /// Sets the masks of instances (RayView::masks); one of mask 0 is met by nothing.
  void set_masks(std::span<const std::uint32_t> instances, std::span<const std::uint32_t> masks) {
    detail::check_as_many("masks", masks.size(), "numbers of instances", instances.size());
    check(ballot_scene_set_masks(handle_.get(), instances.data(), masks.data(), instances.size()));
  }
  /// Sets the groups of instances (RayView::groups); those of BALLOT_SHARED are met by rays and points of all groups.
  void set_groups(std::span<const std::uint32_t> instances, std::span<const std::uint32_t> groups) {
    detail::check_as_many("groups", groups.size(), "numbers of instances", instances.size());
    check(ballot_scene_set_groups(handle_.get(), instances.data(), groups.data(), instances.size()));
  }
  /// The masks of all instances, in the order of their numbers, by the first records of an array on the device.
  void set_masks(const Array<std::uint32_t>& masks) {
    check(ballot_scene_set_mask_buffer(handle_.get(), masks.handle()));
  }

  /// Makes the edits true. Throws Error(BALLOT_ERROR_ARGUMENT), which names mesh and vertex, or the instance, if
  /// something cannot be; Error(BALLOT_ERROR_WORK) if the device fails.
  void commit() { check(ballot_scene_commit(handle_.get())); }
  /// Drops the edits.
  void discard() { check(ballot_scene_discard(handle_.get())); }

  /// Moves the scene to a time of one of its animations. A time outside means the beginning or end.
  /// SceneOptions::updates says how the tree moves. Throws Error(BALLOT_ERROR_ARGUMENT) if there is no such animation
  /// or the time is not finite; the scene is then as it was.
  void set_time(std::size_t animation, double seconds) {
    check(ballot_scene_set_time(handle_.get(), animation, seconds));
  }

  /// Traces rays and returns when the results are written. Neighbours share a subgroup: order rays for coherence.
  Times trace(std::span<const Ray> rays, const Results& results, const Query& query = {}) const {
    return trace_c(detail::rays_of(rays), results, query);
  }
  /// The same for rays by their columns: any stride, float or double, numbers that stand for all. None is copied first.
  Times trace(const RayView& rays, const Results& results, const Query& query = {}) const {
    return trace_c(detail::rays_of(rays), results, query);
  }
  /// The same; `hits` must be as many as the rays.
  Times trace(std::span<const Ray> rays, std::span<Hit> hits, const Query& query = {}) const {
    if (rays.size() != hits.size())
      throw Error(BALLOT_ERROR_ARGUMENT, "trace: " + std::to_string(rays.size()) + " rays, but room for " +
                                             std::to_string(hits.size()) + " hits");
    return trace(rays, Results{.hits = hits.data()}, query);
  }
  /// The same for the first `count` rays of an array on the device, as trace(rays, {{"t", t}, {"uvs", uvs}}, n): each
  /// output is the name of a member of Results and the array that it goes to.
  Times trace(const Array<Ray>& rays, const std::vector<Output>& outputs, std::size_t count,
              const Query& query = {}) const {
    Times times;
    check(ballot_trace_buffers(handle_.get(), rays.handle(), count, outputs.data(), outputs.size(), &query, &times));
    return times;
  }
  /// The same for whole hits.
  Times trace(const Array<Ray>& rays, Array<Hit>& hits, std::size_t count, const Query& query = {}) const {
    return trace(rays, {{"hits", hits}}, count, query);
  }

  /// Begins a trace in the background. Jobs of a device run in their order. What the query refers to must outlive the
  /// job.
  Job submit(std::span<const Ray> rays, const Results& results, const Query& query = {}) const {
    return submit_c(detail::rays_of(rays), results, query);
  }
  /// The same for rays by their columns.
  Job submit(const RayView& rays, const Results& results, const Query& query = {}) const {
    return submit_c(detail::rays_of(rays), results, query);
  }
  /// The same for arrays on the device, so that one batch follows another without a gap. Two jobs are on their way to
  /// the device at once; those behind them are sent together by a later call, poll() or wait(). Keep scene and arrays
  /// as they are until the job has ended.
  Job submit(const Array<Ray>& rays, const std::vector<Output>& outputs, std::size_t count,
             const Query& query = {}) const {
    BallotJob* job = nullptr;
    check(ballot_submit_buffers(handle_.get(), rays.handle(), count, outputs.data(), outputs.size(), &query, &job));
    return Job(job);
  }
  /// The same for whole hits.
  Job submit(const Array<Ray>& rays, Array<Hit>& hits, std::size_t count, const Query& query = {}) const {
    return submit(rays, {{"hits", hits}}, count, query);
  }

  /// Finds the nearest point of the scene for each point: x y z, float or double, as a vector, a span or an array has
  /// them, or at any stride. Accuracy, ties and the inside test: ballot_query_points() in ballot_c.h. Throws
  /// Error(BALLOT_ERROR_ARGUMENT) if what is inside is asked for and the mesh is not closed, or its triangles not wound
  /// alike where query.sign is "pseudonormal".
  Times nearest(const Column& points, const NearestResults& results, const Query& query = {}) const {
    return nearest(PointView{points}, results, query);
  }
  /// The same for points by their columns.
  Times nearest(const PointView& points, const NearestResults& results, const Query& query = {}) const {
    const BallotPoints p = detail::points_of(points);
    Times times;
    check(ballot_query_points(handle_.get(), &p, &results, &query, &times));
    return times;
  }
  /// The same for the first `count` points of an array on the device, whose outputs are named as members of
  /// NearestResults. Points keep their order: put those that are near each other next to each other.
  Times nearest(const Array<Point>& points, const std::vector<Output>& outputs, std::size_t count,
                const Query& query = {}) const {
    Times times;
    check(ballot_query_point_buffers(handle_.get(), points.handle(), count, outputs.data(), outputs.size(), &query,
                                     &times));
    return times;
  }
  /// Lists the triangles within the limit of each point, the nearest first: ballot_list_within() says what hits are.
  Lists within(const PointView& points, const Query& query = {}) const {
    const BallotPoints p = detail::points_of(points);
    detail::Listing listing(detail::count_of(p.shape));
    return listing.end(ballot_list_within(handle_.get(), &p, &listing.to, &query, nullptr));
  }
  /// Lists the triangles that have a point in common with each box, by prim: ballot_list_overlapping() says more.
  Lists overlapping(const BoxView& boxes, const Query& query = {}) const {
    const BallotBoxes b = detail::boxes_of(boxes);
    detail::Listing listing(detail::count_of(b.shape));
    return listing.end(ballot_list_overlapping(handle_.get(), &b, &listing.to, &query, nullptr));
  }
  /// Counts them.
  std::vector<std::int64_t> count_overlapping(const BoxView& boxes, const Query& query = {}) const {
    const BallotBoxes b = detail::boxes_of(boxes);
    auto counts = detail::room_for<std::int64_t>(detail::count_of(b.shape));
    const BallotLists to{.counts = counts.data()};
    check(ballot_list_overlapping(handle_.get(), &b, &to, &query, nullptr));
    return counts;
  }
  /// Finds the smallest distance from another scene of the device, wherever poses place that: ballot_clearance().
  Times clearance(const Scene& other, const ClearanceResults& results, const PoseView& poses = {},
                  const Query& query = {}) const {
    const BallotPoses p = detail::poses_of(poses);
    Times times;
    check(ballot_clearance(handle_.get(), other.handle_.get(), &p, &results, &query, &times));
    return times;
  }

  /// Counts all triangles that each ray crosses with t in [t_min, t_max]: ballot_list_crossings() says more.
  std::vector<std::int64_t> count_crossings(std::span<const Ray> rays, const Query& query = {}) const {
    return count_c(detail::rays_of(rays), query);
  }
  /// The same for rays by their columns.
  std::vector<std::int64_t> count_crossings(const RayView& rays, const Query& query = {}) const {
    return count_c(detail::rays_of(rays), query);
  }
  /// Lists the crossings that count_crossings() counts, or the first of each ray (Query::first).
  Lists crossings(std::span<const Ray> rays, const Query& query = {}) const {
    return list_c(detail::rays_of(rays), query);
  }
  /// The same for rays by their columns.
  Lists crossings(const RayView& rays, const Query& query = {}) const { return list_c(detail::rays_of(rays), query); }

  /// Lists the crossings of the first `count` rays of an array on the device, with the bits of crossings(), and returns
  /// the number of all; ballot_list_buffers() in ballot_c.h says more. Without to.hits they are only counted, which
  /// tells how many records it needs. Throws Error(BALLOT_ERROR_ARGUMENT) if it has fewer.
  std::uint64_t crossings(const Array<Ray>& rays, const ListArrays& to, std::size_t count,
                          const Query& query = {}) const {
    return list_there(rays.handle(), to, count, query);
  }
  /// The same for the triangles within the limits of points.
  std::uint64_t within(const Array<Point>& points, const ListArrays& to, std::size_t count,
                       const Query& query = {}) const {
    return list_there(points.handle(), to, count, query);
  }
  /// Copies those of the first `count` hits on the device that are no misses to `alone`, in their order, and the number
  /// of the ray of each to `rays`, both with room for `count`. Returns how many there are. `first`: hits of a ray.
  std::uint64_t compact(const Array<Hit>& hits, Array<Hit>& alone, Array<std::uint32_t>& rays, std::size_t count,
                        std::uint32_t first = 1) const {
    std::uint64_t found = 0;
    check(ballot_compact_hits(handle_.get(), hits.handle(), count, first, alone.handle(), rays.handle(), &found));
    return found;
  }

  /// Makes the rays of a kind (`ballot methods`: "primary", "shadow", "ao", ...) for a view.
  std::vector<Ray> make_rays(const View& view, const std::string& kind, std::uint32_t width,
                             std::uint32_t height) const {
    return detail::made<Ray>(width, height, [&](Ray* rays, std::size_t room, std::size_t* count) {
      check(ballot_make_rays(handle_.get(), &view, kind.c_str(), width, height, rays, room, count));
    });
  }
  /// The same in double, of scenes with an origin too.
  std::vector<RayDouble> make_rays_double(const View& view, const std::string& kind, std::uint32_t width,
                                          std::uint32_t height) const {
    return detail::made<RayDouble>(width, height, [&](RayDouble* rays, std::size_t room, std::size_t* count) {
      check(ballot_make_rays_double(handle_.get(), &view, kind.c_str(), width, height, rays->data(), room, count));
    });
  }

  /// Renders a view, 512 x 512 unless the picture says otherwise: width * height * 4 floats, linear Rec.709 and
  /// coverage, rows from the top.
  std::vector<float> render(const View& view, const Picture& picture, const Query& query = {}) const {
    Picture p = picture;
    if (!p.width) p.width = 512;
    if (!p.height) p.height = 512;
    detail::check_size(p.width, p.height);
    auto rgba = detail::room_for<float>(std::size_t{4} * p.width * p.height);
    p.rgba = rgba.data();
    check(ballot_render(handle_.get(), &view, &p, &query, nullptr));
    return rgba;
  }

 private:
  explicit Scene(BallotScene* scene) { handle_ = Owner(scene); }
  Scene(const Device& device, std::span<const Mesh> meshes, const Instances* instances, const SceneOptions& options) {
    BallotScene* scene = nullptr;
    check(ballot_scene_create(device.handle(), meshes.data(), meshes.size(), instances, &options, &scene));
    handle_ = Owner(scene);
  }

  Times trace_c(const BallotRays& rays, const Results& results, const Query& query) const {
    Times times;
    check(ballot_trace(handle_.get(), &rays, &results, &query, &times));
    return times;
  }
  Job submit_c(const BallotRays& rays, const Results& results, const Query& query) const {
    BallotJob* job = nullptr;
    check(ballot_submit(handle_.get(), &rays, &results, &query, &job));
    return Job(job);
  }
  std::vector<std::int64_t> count_c(const BallotRays& rays, const Query& query) const {
    auto counts = detail::room_for<std::int64_t>(detail::count_of(rays.shape));
    const BallotLists lists{.counts = counts.data()};
    check(ballot_list_crossings(handle_.get(), &rays, &lists, &query, nullptr));
    return counts;
  }
  std::uint64_t list_there(BallotBuffer* asked, const ListArrays& to, std::size_t count, const Query& query) const {
    std::uint64_t total = 0;
    check(ballot_list_buffers(handle_.get(), asked, count, &to, &query, &total, nullptr));
    return total;
  }
  Lists list_c(const BallotRays& rays, const Query& query) const {
    detail::Listing listing(detail::count_of(rays.shape));
    return listing.end(ballot_list_crossings(handle_.get(), &rays, &listing.to, &query, nullptr));
  }
};

inline Times Kernel::run(const Scene& scene, std::size_t count, std::span<const Input> inputs,
                         const Query& query) const {
  Times times;
  check(ballot_kernel_run(handle_.get(), scene.handle(), count, inputs.data(), inputs.size(), &query, &times));
  return times;
}

}  // namespace v1
}  // namespace ballot
