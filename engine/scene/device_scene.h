// A scene on a device. Tools and tests see this header and no other: load a scene, open a device, trace rays, render.
//
//   ballot::DeviceScene world(ballot::load_scene("scenes/cornell.gltf"));
//   std::vector<ballot::Hit> hits(rays.size());
//   world.trace(rays, hits, {.method = "packet"});
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>

#include "engine/answer/covering.h"
#include "engine/answer/methods.h"
#include "engine/answer/numeric.h"
#include "engine/answer/point_queries.h"
#include "engine/answer/query_judge.h"
#include "engine/answer/ray_queries.h"
#include "engine/answer/tracer.h"
#include "engine/answer/user_kernel.h"
#include "engine/core/cache_file.h"
#include "engine/core/error.h"
#include "engine/core/failure_text.h"
#include "engine/core/file.h"
#include "engine/core/file_id.h"
#include "engine/core/json_limits.h"
#include "engine/core/json_text.h"
#include "engine/core/memory.h"
#include "engine/core/parallel.h"
#include "engine/core/progress.h"
#include "engine/core/registry.h"
#include "engine/core/say.h"
#include "engine/core/shown.h"
#include "engine/core/standard_output.h"
#include "engine/core/stopwatch.h"
#include "engine/files/denoise.h"
#include "engine/files/image.h"
#include "engine/files/image_error.h"
#include "engine/files/image_merge.h"
#include "engine/files/load.h"
#include "engine/files/make_sky.h"
#include "engine/files/npy.h"
#include "engine/files/npy_points.h"
#include "engine/files/text_mark.h"
#include "engine/gpu/context.h"
#include "engine/model/animation.h"
#include "engine/model/instances.h"
#include "engine/model/light.h"
#include "engine/model/pose.h"
#include "engine/model/scene.h"
#include "engine/oracle/in_double.h"
#include "engine/oracle/self_crossings.h"
#include "engine/present/presenter.h"
#include "engine/render/batch/batch.h"
#include "engine/render/batch/check.h"
#include "engine/render/batch/origins.h"
#include "engine/render/batch/ray_kinds.h"
#include "engine/render/data/surface_columns.h"
#include "engine/render/film/film.h"
#include "engine/render/film/film_file.h"
#include "engine/render/film/renderer.h"
#include "engine/render/live/live.h"
#include "engine/render/path/integrators.h"
#include "engine/scene/scene_change.h"
#include "engine/tree/device/posed_triangles.h"
#include "engine/tree/host/bvh.h"
#include "engine/tree/host/forest.h"
#include "engine/tree/host/refit_policy.h"
#include "engine/tree/host/topology.h"

namespace ballot {

struct SceneTree;  // scene_tree.h

struct DeviceSceneOptions {
  std::string device;     // "": best GPU, else CPU; an index, part of a name, "gpu", "cpu"
  bool validate = false;  // Vulkan validation with synchronization checks; messages() collects the reports
  /// A device that is open already, so that several scenes share it; opening one takes time. `device`, `validate`,
  /// `window` and `statistics` are then ignored: they are as the device was opened with.
  std::shared_ptr<Context> context = {};
  BuildSettings build = {};
  std::optional<double> expected_rays = {};        // that will be traced in all: a hint for builder `auto`
  bool use_cache = true;                           // keeps BVHs on disk, in cache_folder()
  const WindowSurface* window = nullptr;           // shows pictures; the device must be able to present to it
  bool statistics = false;                         // ContextOptions::statistics
  std::shared_ptr<TrianglesThere> triangles = {};  // on `context`; are taken. The scene has room for them, and bounds
  std::vector<Query> queries = {};  // checked before the BVH is built: throws if the device cannot follow their knobs
};

/// The seconds that each step of making a DeviceScene took.
struct StartTimes {
  double device_s = 0, bvh_s = 0;
};

/// A scene on a device: its tree, its tracer, and what renders it. DeviceScenes that share a device belong to one
/// thread at a time; those with devices of their own are independent.
class DeviceScene {
 public:
  /// Opens the device unless options.context has one, then builds the BVH or loads it from the cache. Throws
  /// Error(Device) if no device is usable, Error(Work) if the scene cannot be built.
  explicit DeviceScene(Scene scene, const DeviceSceneOptions& options = {}, const Progress& progress = {});
  ~DeviceScene();

  /// Opens the device that options name, for their `context`. Throws Error(Device) if no device is usable.
  static std::shared_ptr<Context> open_device(const DeviceSceneOptions& options);

  /// Returns the scene. What has moved on the device, or with its instances, is brought back first, which takes time:
  /// scene_facts() is the same without it.
  const Scene& scene() const {
    late_.bring();
    return scene_;
  }
  /// Returns the scene, whose triangles, normals, placements and bounds may be those of an earlier time.
  const Scene& scene_facts() const { return scene_; }
  /// The same with the placements of now, as edits of a structure need them.
  const Scene& placed_scene();
  /// Returns of each mesh whether its triangles lie on the device alone. They may stay there if the structure changes.
  std::vector<bool> meshes_there();
  /// Returns how questions in double are asked: about the scene's origin, from within its bounds.
  Recentring recentring() const { return {scene_.origin, forest_ ? forest_->summary().bounds : scene_.bounds}; }
  /// Returns the meshes' trees and the instances of a scene that has some; null if it has none.
  const Forest* forest() const { return forest_.get(); }
  /// Returns the number of triangles, counted through the instances, and the triangle in the world that a hit names.
  std::uint64_t triangle_count() const;
  Triangle triangle(std::uint32_t prim) const;
  /// Returns the normal of a hit on a shape; none of one on a triangle.
  std::optional<glm::vec3> shape_normal(const Hit& hit) const;
  /// Returns the tree, which the first call reads back from the device. Of a scene with instances only bounds and
  /// statistics are there: those of all meshes together.
  const Bvh& bvh() {
    late_.bring();
    return forest_ ? forest_->summary() : tracer_->tree().whole_bvh();
  }
  const BvhStats& bvh_stats() const { return bvh_.stats; }
  /// Returns the features that kernels are compiled for.
  const SceneFeatures& features() const { return features_; }
  const DeviceInfo& device() const { return gpu_->info(); }
  const std::shared_ptr<Context>& context() const { return gpu_; }
  const StartTimes& start_times() const { return times_; }
  Tracer& tracer() { return *tracer_; }
  const Tracer& tracer() const { return *tracer_; }
  /// Return what answers point queries, ray queries for more than one hit, and columns of surfaces. Made on first use.
  /// They last until the scene gets other triangles, or other meshes.
  PointQueries& points();
  RayQueries& rays();
  SurfaceColumns& surface_columns();
  /// Returns a user's kernel over this scene, made on first use. It lasts until the scene gets other meshes, or
  /// drop_kernel(). `text` must stay where it is until then. Throws as UserKernel does.
  UserKernel& kernel(const UserText& text);
  void drop_kernel(const UserText& text) { kernels_.erase(&text); }
  /// Returns the topology of the scene's triangles; of a scene with instances that of their meshes, each by itself. It
  /// is found on first use, for which the caller is asked first (ask_interruption()).
  const Topology& topology();

  /// Traces a batch of rays and writes, at the same index, the hit of each.
  ///
  /// rays    n >= 0 rays, read before the call returns. Origins in scene units; dir need not be of unit length, t
  ///         counts multiples of it. Dead rays (shaders/shared/layout.h) are misses. Neighbours in the buffer share a
  ///         subgroup: order them for coherence.
  /// hits    exactly n records, overwritten. On a miss prim is NO_HIT, t infinity, and u = v = 0.
  /// query   nearest: the smallest t in [t_min, t_max], among equal t the smallest prim. In `plain` and `fast`, whose
  ///         boxes are not padded, it may be another triangle at that t. any: some hit.
  /// Throws Error(Arguments) if the sizes differ or a name is unknown, Error(Work) if the device fails.
  /// Blocks until the results are in `hits`.
  TraceTimes trace(std::span<const Ray> rays, std::span<Hit> hits, const Query& query = {},
                   const Progress& progress = {}) {
    return tracer_->trace(rays, hits, query, progress);
  }

  /// Makes a change of meshes and placements true, all of it, or throws and leaves the scene as it was. Trees of meshes
  /// that have not changed stay, and what the device has of them. The trees of meshes that have moved follow as `mode`
  /// says; the tree over the placements is refitted, or built anew once refits have raised its cost by a quarter. Takes
  /// the structure. Throws Error(Arguments) if a vertex is not finite or beyond +-1e12, if kernels cannot read vertices
  /// on the device (check_there()), if a transform cannot be placed (place_instance()), or if triangles cannot be
  /// numbered; Error(Work) if there is no room or the device fails. Ends the use of batches, films and the checker of
  /// before. The scene must not be animated.
  void commit(SceneChange& change, UpdateMode mode = UpdateMode::Auto);
  void keep_flat() { build_.keeps_flat = true; }  // in trees that are built from now on
  /// Returns true if commit() takes transforms that lie on the device.
  bool reads_transforms_there() const;
  /// Returns true if commit() takes corners of a mesh that lie on the device.
  bool reads_vertices_there(std::size_t mesh) const;

  /// Replaces the triangles by as many others, for example vertices that have moved, and returns those of before.
  /// Materials, normals, texture coordinates, lights and views stay. Traces after it find hits in the new ones. The
  /// tree is refitted or built anew, as `mode` says; it is always built if a triangle gains or loses its area. Throws
  /// Error(Arguments) if the number differs or a vertex is not finite, Error(Work) if the tree cannot be built; the
  /// scene is then as it was. Ends the use of batches and films of before. Not of instances: Error(Arguments).
  UnsetVector<Triangle> move(UnsetVector<Triangle> triangles, UpdateMode mode = UpdateMode::Auto);

  /// Moves the scene to a time of a clip of its animation: triangles, normals, lights and views. Times outside
  /// [0, seconds of the clip] mean the nearest inside. Skins and morph targets are evaluated on the device, with the
  /// bits of set_pose(). The tree follows as move() says; in a scene with instances those move, and the trees of
  /// deformed meshes are built anew. Throws Error(Arguments) if there is no such clip or the time is not finite,
  /// Error(Work) as pose_at() and move() do; the scene is then as it was. A tree that was built on a device with
  /// float64 follows there, and so does what shading reads; the host's triangles follow once they are asked for.
  /// Batches and films of before end all the same.
  void set_time(std::size_t clip, double seconds, UpdateMode mode = UpdateMode::Auto);

  /// Builds the tree anew if queries since its last build have lost more time, because triangles have moved, than a
  /// build takes. To be asked before queries of a scene whose tree follows as UpdateMode::Auto says. Ends the use of
  /// batches, films and the checker of before if it builds; returns true then.
  bool rebuild_if_overdue();

  /// What the last move() or set_time() did.
  struct Update {
    bool refitted = false;  // false: the tree was built, or there was no move yet
    double seconds = 0;     // of the tree, and of what is made anew for rendering
    double ready_s = 0;     // the latter part of it
    double pose_s = 0;      // of set_time(): until the triangles were known
  };
  const Update& last_update() const { return update_; }
  /// Returns the tree's cost by the SAH over that at its build, and what builds and refits took; of each mesh of a
  /// scene with instances.
  const RefitPolicy& refit_policy(std::size_t mesh = 0) const { return policies_[mesh]; }

  /// Replaces the sky. Ends the use of batches, films and the checker of before.
  void set_sky(Sky sky);

  /// Renders a view. The image has the attributes that write_exr stores. Throws as trace() does.
  Image render(const View& view, const RenderOptions& options, RenderTimes* times = nullptr,
               const Progress& progress = {});

  /// Renders in steps: start_film() makes a film without samples, advance() adds samples to every pixel, picture()
  /// makes the image with its attributes. The bits of a film depend on the number of its samples, not on the steps, on
  /// one device. A film may be copied, stored, and continued by another process. Throws as trace() does.
  Film start_film(const RenderOptions& options) const { return renderer_->start(options); }
  /// The first sample of a scene far from the origin moves a copy of it there, with a tree of its own, in which paths
  /// start at points that are as fine as near the origin.
  void advance(Film& film, const View& view, const RenderOptions& options, std::uint32_t samples, RenderTimes& times,
               const Progress& progress = {});
  /// The same as advance(), but the sums may stay on the device until collect(). Until then the film must not be read
  /// or copied, and no other film rendered. Throws Error(Work) if another film was rendered since.
  void advance_there(Film& film, const View& view, const RenderOptions& options, std::uint32_t samples,
                     RenderTimes& times, const Progress& progress = {});
  void collect(Film& film, RenderTimes& times) { pictures().renderer_->collect(film, times); }
  Image picture(const Film& film, const View& view, const RenderOptions& options, RenderTimes& times);

  /// Returns everything that decides the bits of a film, one line each: scene, view, options, arithmetic, device,
  /// commit. Films with equal texts have equal bits. write_film() stores the text with the film.
  std::string made_of(const View& view, const RenderOptions& options) const;

  /// Returns a sentence if many triangles are so small beside the whole scene that pictures of them may be wrong: more
  /// than one in 100 is smaller than 1024 times what points of the scene are rounded to. Else an empty text.
  std::string picture_note() const;

  /// Returns about the bytes that rendering such a picture will take on the device, without the scene and its tree.
  std::uint64_t render_bytes_for(const View& view, const RenderOptions& options) const {
    return renderer_->bytes_for(view, options);
  }
  /// Returns the bytes that rendering takes on the device, without the tree.
  std::uint64_t render_bytes();
  /// Returns the tracer of pictures: tracer(), but for scenes far from zero.
  Tracer& picture_tracer() { return *pictures().tracer_; }

  /// Makes the rays of one kind (ray_kinds.h) for a view of width x height pixels, 1 to 16384 each, on the device.
  /// Kinds that start at primary hits start at those that the default query finds. A pixel that hits nothing starts no
  /// ray, so count() may be 0. Equal hits give equal rays on every device; their u and v may round differently. Throws
  /// Error(Arguments) on sizes or options out of range, Error(Work) if the device has too little memory.
  std::unique_ptr<RayBatch> make_batch(const View& view, const RayKind& kind, std::uint32_t width, std::uint32_t height,
                                       const RayKindOptions& options = {}) {
    return batches_->make(view, kind, width, height, options);
  }

  /// Puts the caller's own rays on the device, as a batch without a frame. Rays are as for trace().
  std::unique_ptr<RayBatch> make_batch(std::string name, std::span<const Ray> rays, Want want) {
    return batches_->make(std::move(name), rays, want);
  }

  /// Returns the query that runs on a batch: `want` is the batch's, and method auto becomes the one that it chooses.
  Query resolve(const RayBatch& batch, Query query) { return batches_->resolve(batch, std::move(query)); }

  /// Traces a batch; its hits stay on the device. query.want is taken from the batch. Throws as trace() above does.
  TraceTimes trace(RayBatch& batch, Query query) { return batches_->trace(batch, std::move(query)); }

  /// Runs a whole frame: primary rays, their trace, the rays of this kind, their trace, and the shading of every hit
  /// into a film. The rays are those of the batch: the primary trace is timed, but they start at the hits that it was
  /// made with. Frames per second are 1000 / total_ms(). Throws as trace(), and Error(Arguments) without a frame.
  FrameTimes frame(RayBatch& batch, Query query) { return batches_->frame(batch, std::move(query)); }

  /// Traces a batch by the instrumented variant of the query's kernel and sums up its counters; the hits are those of
  /// trace(). Throws as trace() does, and Error(Work) if the device has no room for the counters, 72 bytes a ray.
  Counters count(RayBatch& batch, Query query) { return batches_->count(batch, std::move(query)); }

  /// Returns the checker of batches, with the CPU oracles of this scene. It is made on first use.
  HitChecker& checker();

  /// Finds, for each ray of a batch, whether it hits the triangle that it starts from, and whether its origin offset
  /// loses a contact (origins.h). Traces the rays for their nearest hits; the batch's own hits stay. Contacts are found
  /// in double on the CPU. Throws as trace(), and Error(Arguments) if rays start at no hits or there are instances.
  std::vector<OriginCheck> check_origins(const RayBatch& batch, const Query& query = {});

  /// Returns the picture for a window, which stays on the device. A DeviceScene has one, made on first use.
  LiveImage& live();

  /// Makes the presenter for the window of DeviceSceneOptions. The DeviceScene must outlive it. Throws Error(Arguments)
  /// if there is no window, and as Presenter does.
  std::unique_ptr<Presenter> make_presenter();

  /// Compiles the kernels of traversal, render() and live() anew from the shader folder when they are used next. If a
  /// kernel fails to compile, the old one stays in use and shader_error() has the compiler's message, else none.
  void reload_shaders() { gpu_->reload_shaders(); }
  const std::string& shader_error() const { return gpu_->shader_error(); }

  /// Returns the reports of the validation layers so far; none unless DeviceSceneOptions::validate is set.
  const std::vector<std::string>& messages() const { return gpu_->messages(); }

 private:
  DeviceScene& pictures();
  glm::vec3 picture_origin() const;
  SceneFeatures features_with(const TreeFacts& tree) const;
  void drop_renderers();
  void make_renderers();
  void make_forest(bool use_cache, TrianglesThere* there, const Progress& progress);
  void triangles_are_there(std::size_t tree);
  void move_instances(Pose pose, double pose_s);
  void follow_transforms();
  void refuse_instances(const char* what) const;
  bool refit(std::span<const Triangle> triangles, const Bounds& bounds);
  void adopt(SceneTree&& built);
  void try_to_rebuild();
  void count_walks();
  void begin_update();
  void forget_shape();
  void end_update(const Timer& timer);
  bool rebuild_meshes();
  void move_flat(std::span<const MovedVertices> meshes, UpdateMode mode);
  void move_all(const SceneChange& change, UpdateMode mode);
  void restructure(SceneChange& change);
  void replant(const std::vector<std::optional<std::uint32_t>>& from, const TrianglesOfMeshes& there);
  void plant_flat(const TrianglesOfMeshes& there);
  MeshTree whole_tree(std::span<const Triangle> triangles);
  glm::vec3 largest_there() const;
  void bring_placements();
  bool builds_there(const TreeLayout& layout, std::size_t mesh) const;
  std::vector<bool> bring_apart(SceneChange&, const TreeLayout&, const std::vector<std::optional<std::uint32_t>>&);
  void drop_queries();
  void watch_lateness();
  std::size_t tree_with(std::size_t triangle) const;
  std::size_t first_of(std::size_t tree) const;
  bool takes_vertices(std::size_t tree) const;
  std::vector<MovedVertices> unknown_in(std::size_t tree, std::span<const MovedVertices> moved) const;
  struct TreeMove;
  TreeMove prepare_move(std::size_t tree, std::span<const MovedVertices> meshes);
  void take_here(TreeMove& move);
  void take_found(TreeMove& move);
  bool refit_there(TreeMove& move);
  void follow_there(TreeMove& move, UpdateMode mode);
  void follow_here(TreeMove& move, UpdateMode mode);
  void take_moves(std::span<TreeMove> moves, const MovedTransforms& transforms);
  void apply_moves(std::span<TreeMove> moves, const MovedTransforms& transforms, UpdateMode mode);
  void end_moves(std::span<TreeMove> moves);
  void rebuild(std::size_t tree);
  Pose pose(const AnimationClip& clip, double seconds);
  void set_time_here(const AnimationClip& clip, double seconds, UpdateMode mode);
  bool set_time_there(const AnimationClip& clip, double seconds, UpdateMode mode);
  bool poses_there() const;
  void make_posed();
  void follow_posed(Buffer<Triangle>& triangles, const Bounds& bounds, UpdateMode mode);
  void bring_back(const AnimationClip& clip, double seconds);

  Scene scene_;
  HostCopy late_;  // of a forest with its trees by themselves
  BuildSettings build_;
  bool use_cache_ = true;
  Timer opened_;
  StartTimes times_;
  std::shared_ptr<Context> gpu_;
  Bvh bvh_;
  std::unique_ptr<Forest> forest_;     // null: the scene is flat
  std::vector<RefitPolicy> policies_;  // of each mesh; of a flat scene one
  double walked_s_ = 0;                // Tracer::walked_s() when the policies were last told
  Update update_;
  SceneFeatures features_;
  std::unique_ptr<Tracer> tracer_;
  std::unique_ptr<SceneData> scene_data_;
  std::unique_ptr<Renderer> renderer_;
  std::unique_ptr<Batches> batches_;
  std::unique_ptr<SurfaceColumns> surface_columns_;  // made on first use
  std::unique_ptr<PointQueries> points_;             // made on first use
  std::unique_ptr<RayQueries> rays_;
  std::map<const UserText*, std::pair<bool, UserKernel>> kernels_;  // first: SceneFeatures::stored when it was made
  std::unique_ptr<Topology> topology_;
  std::unique_ptr<DevicePoser> poser_;               // made on first use
  UnsetVector<Triangle> spare_triangles_;            // the same of a commit
  Pose spare_pose_;                                  // of the last set_time() on the host, whose memory serves again
  std::unique_ptr<PosedTriangles> posed_;            // made on first use; null after triangles have moved otherwise
  std::map<std::size_t, IndexedTriangles> indexed_;  // of trees; made when a mesh first moves
  // Of meshes that share a tree, once one of them has moved; by their first triangles.
  std::map<std::size_t, MeshExtents> mesh_extents_;
  std::unique_ptr<DeviceScene> near_zero_;  // renders a scene far from the origin; made on first use
  std::unique_ptr<LiveImage> live_;         // made on first use
  std::unique_ptr<HitChecker> checker_;     // made on first use
};

/// Returns the commit that this library was built from, or "unknown".
std::string commit();

}  // namespace ballot
