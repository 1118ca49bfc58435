// The public interface of Ballot, and nothing else is public: load a scene, open a device, trace rays, render views.
//
//   ballot::Engine engine(ballot::load_scene("scenes/cornell.gltf"));
//   std::vector<ballot::Hit> hits(rays.size());
//   engine.trace(rays, hits, {.method = "packet"});
//   ballot::Image image = engine.render(engine.scene().views[0], {.width = 512, .height = 512});
//   ballot::write_exr("cornell.exr", image);
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "engine/bvh/bvh.h"
#include "engine/core/error.h"
#include "engine/core/file.h"
#include "engine/core/image.h"
#include "engine/core/image_error.h"
#include "engine/core/image_merge.h"
#include "engine/core/json_depth.h"
#include "engine/core/npy.h"
#include "engine/core/progress.h"
#include "engine/present/presenter.h"
#include "engine/render/batch/batch.h"
#include "engine/render/batch/check.h"
#include "engine/render/batch/origins.h"
#include "engine/render/batch/ray_kinds.h"
#include "engine/render/film/film.h"
#include "engine/render/film/film_file.h"
#include "engine/render/film/renderer.h"
#include "engine/render/live/live.h"
#include "engine/render/path/integrators.h"
#include "engine/scene/light.h"
#include "engine/scene/scene.h"
#include "engine/trace/methods.h"
#include "engine/trace/numeric.h"
#include "engine/trace/tracer.h"
#include "engine/vk/context.h"

namespace ballot {

struct EngineOptions {
  std::string device;     // "": best GPU, else CPU; an index, part of a name, "gpu", "cpu"
  bool validate = false;  // Vulkan validation with synchronization checks; messages() collects what it says
  /// The device of an engine that is gone or idle, to be used again: opening one takes time, and drivers that are opened
  /// and closed many times in a process may refuse at last. `device` and `validate` are then as that engine had them.
  std::shared_ptr<Context> context = {};
  BuildSettings build = {};
  bool use_cache = true;                  // BVHs and choices of method auto on disk, in cache_folder()
  const WindowSurface* window = nullptr;  // pictures are to be shown there; the device must be able to
  bool statistics = false;                // ContextOptions::statistics
  std::vector<Query> queries = {};        // refused before the BVH is built if the device cannot follow their knobs
};

/// Seconds that each step of making an Engine took.
struct StartTimes {
  double device_s = 0, bvh_s = 0;
};

/// A scene on a device. Belongs to one thread; one lives at a time, but for engines that share a context.
class Engine {
 public:
  /// Opens the device, then builds or loads the BVH. Throws Error(Device) if no device is usable, Error(Work) if the
  /// scene cannot be built.
  explicit Engine(Scene scene, const EngineOptions& options = {}, const Progress& progress = {});
  ~Engine();

  const Scene& scene() const { return scene_; }
  const Bvh& bvh() const { return bvh_; }
  /// What kernels are made for.
  const SceneFeatures& features() const { return features_; }
  const DeviceInfo& device() const { return gpu_->info(); }
  const std::shared_ptr<Context>& context() const { return gpu_; }
  const StartTimes& start_times() const { return times_; }
  Tracer& tracer() { return *tracer_; }
  const Tracer& tracer() const { return *tracer_; }

  /// Traces a batch of rays and writes, at the same index, what each one hits.
  ///
  /// rays    n >= 0 rays; read before return. Origins in scene units; dir need not be of unit length, t counts
  ///         multiples of it. Dead rays (layout.h) are misses. Neighbours in the buffer share a subgroup: order them
  ///         for coherence.
  /// hits    exactly n records, overwritten. On a miss prim is NO_HIT, t is the ray's t_max (0 for a dead ray), and
  ///         u = v = 0.
  /// query   nearest: the smallest t in [t_min, t_max], among equal t the smallest prim (in `plain` and `fast`, whose boxes are not
  ///         padded, perhaps another one at that t); any: some hit.
  /// Throws  Error(Arguments) if the sizes differ or a name is unknown, Error(Work) if the device fails.
  /// Blocks until the results are in `hits`.
  TraceTimes trace(std::span<const Ray> rays, std::span<Hit> hits, const Query& query = {},
                   const Progress& progress = {}) {
    return tracer_->trace(rays, hits, query, progress);
  }

  /// A picture of a view, with the attributes that write_exr stores. Throws as trace does.
  Image render(const View& view, const RenderOptions& options, RenderTimes* times = nullptr,
               const Progress& progress = {});

  /// The same in steps: a film without samples, any number of samples more for every pixel, and the picture of what there is,
  /// with its attributes. However the samples are dealt out, a film of as many has the same bits on one device; a film may be
  /// copied, stored, and gone on with by another process. Throws as trace does.
  Film start_film(const RenderOptions& options) const { return renderer_->start(options); }
  void advance(Film& film, const View& view, const RenderOptions& options, std::uint32_t samples, RenderTimes& times,
               const Progress& progress = {}) {
    renderer_->advance(film, view, options, samples, times, progress);
  }
  /// Steps that need not see the sums between them: they may stay on the device until collect(). Till then the film is not to be
  /// read or copied, and no other one rendered; Error(Work) says so where sums are gone.
  void advance_there(Film& film, const View& view, const RenderOptions& options, std::uint32_t samples,
                     RenderTimes& times, const Progress& progress = {}) {
    renderer_->advance(film, view, options, samples, times, progress, Sums::OnDevice);
  }
  void collect(Film& film, RenderTimes& times) { renderer_->collect(film, times); }
  Image picture(const Film& film, const View& view, const RenderOptions& options, RenderTimes& times);

  /// What decides the bits of a film, a line each: scene, view, options, arithmetic, device, commit. Two films of equal words are
  /// equal; write_film() stores them with a film.
  std::string made_of(const View& view, const RenderOptions& options) const;

  /// Bytes on the device of what pictures read of the scene, besides its tree, and of what renders them.
  std::uint64_t render_bytes() const { return scene_data_->bytes() + renderer_->bytes(); }

  /// The rays of one kind (ray_kinds.h) for a view of width x height pixels, 1 to 16384 each, on the device. Kinds that
  /// start at primary hits start at those that the default query finds; a pixel that hits nothing starts no ray, so
  /// count() may be 0. Equal hits give equal rays on every device; a hit's u and v may round differently on two devices.
  /// Throws  Error(Arguments) on sizes or options out of range, Error(Work) if the device has not the memory.
  std::unique_ptr<RayBatch> make_batch(const View& view, const RayKind& kind, std::uint32_t width, std::uint32_t height,
                                       const RayKindOptions& options = {}) {
    return batches_->make(view, kind, width, height, options);
  }

  /// Foreign rays on the device: a batch without a frame. n >= 0 rays as trace() takes them, read before return.
  std::unique_ptr<RayBatch> make_batch(std::string name, std::span<const Ray> rays, Want want) {
    return batches_->make(std::move(name), rays, want);
  }

  /// What a query runs on a batch: its want is the batch's, and method auto becomes what auto chooses for such rays.
  Query resolve(const RayBatch& batch, Query query) { return batches_->resolve(batch, std::move(query)); }

  /// Traces a batch; its hits stay on the device. query.want is taken from the batch. Throws as trace() above does.
  TraceTimes trace(RayBatch& batch, Query query) { return batches_->trace(batch, std::move(query)); }

  /// A whole frame: primary rays, their trace, this kind's rays, their trace, and the shading of every hit into a film.
  /// Makes and traces the very rays of the batch: what the primary trace finds takes its time, but rays start at the hits
  /// that the batch was made with. The paper's frames per second are 1000 / total_ms(). Throws as trace() does, and
  /// Error(Arguments) if the batch has no frame.
  FrameTimes frame(RayBatch& batch, Query query) { return batches_->frame(batch, std::move(query)); }

  /// Traces a batch by the instrumented variant of the query's kernel and sums up what it counted; the hits are as those
  /// of trace(). Throws as trace() does, and Error(Work) if the device has no room for the counters, 72 bytes a ray.
  Counters count(RayBatch& batch, Query query) { return batches_->count(batch, std::move(query)); }

  /// What the CPU oracle (engine/oracle/oracle.h) says of a batch's rays, in parallel.
  Truth truth(const RayBatch& batch) { return checker().truth(batch); }

  /// Traces a batch into hits that were filled with a pattern and holds every record to the oracle. `of_batch` is what
  /// truth() said of this batch. Throws as trace() does.
  HitCheck check(RayBatch& batch, const Truth& of_batch, const Query& query) {
    return checker().check(batch, of_batch, query);
  }

  /// What a batch's rays hit, decided without rounding (engine/oracle/exact.h), in parallel: tens of thousands of
  /// rays a second and core. progress is called with the share done, from one thread at a time.
  ExactTruth exact_truth(const RayBatch& batch, const Progress& progress = {}) {
    return checker().exact_truth(batch, progress);
  }

  /// Traces a batch into hits that were filled with a pattern and counts the errors of every record against the exact
  /// truth, `of_batch` being what exact_truth() said of this batch. An unwritten record counts as the wrong answer that
  /// the pattern is, and in `unwritten`. Describes the first max_cases errors. Throws as trace() does, and
  /// Error(Arguments) if of_batch is of another number of rays.
  ErrorFigures verify(RayBatch& batch, const ExactTruth& of_batch, const Query& query, std::size_t max_cases = 8) {
    return checker().verify(batch, of_batch, query, max_cases);
  }

  /// Whether each ray of a batch hits the triangle that it starts from, and whether its offset loses a contact (origins.h).
  /// Traces the rays for their nearest hits, whatever the batch wants; the batch's own hits stay. Contacts are found in
  /// double precision on the CPU, in parallel. Throws as trace() does, and Error(Arguments) if the rays start at no hits.
  std::vector<OriginCheck> check_origins(const RayBatch& batch, const Query& query = {});

  /// Holds answers to the exact oracle, as verify() does, without tracing. Throws Error(Arguments) if the sizes differ.
  ErrorFigures judge(std::span<const Ray> rays, std::span<const Hit> answers, const ExactTruth& truth,
                     const Query& query, std::size_t max_cases = 8) {
    return checker().judge(rays, answers, truth, query, max_cases);
  }

  /// A picture that stays on the device, for a window; one an Engine, made on first use.
  LiveImage& live();

  /// What shows pictures in the window of EngineOptions. The Engine must outlive it. Throws Error(Arguments) if there is
  /// no window, and as Presenter does.
  std::unique_ptr<Presenter> make_presenter(Pace pace);

  /// Kernels of traversal, render() and live() are compiled anew from the shader folder when they are used next. One that
  /// fails is kept as it was, and shader_error() says what the compiler said; empty: all is well.
  void reload_shaders() { gpu_->reload_shaders(); }
  const std::string& shader_error() const { return gpu_->shader_error(); }

  /// What the validation layers said, if asked for, since the device was opened.
  const std::vector<std::string>& messages() const { return gpu_->messages(); }

 private:
  Scene scene_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  StartTimes times_;
  std::shared_ptr<Context> gpu_;
  Bvh bvh_;
  SceneFeatures features_;
  std::unique_ptr<Tracer> tracer_;
  std::unique_ptr<SceneData> scene_data_;
  std::unique_ptr<Renderer> renderer_;
  std::unique_ptr<Batches> batches_;
  std::unique_ptr<LiveImage> live_;      // made on first use
  std::unique_ptr<HitChecker> checker_;  // made on first use

  HitChecker& checker();
};

/// The commit that this library was built from, or "unknown".
std::string commit();

}  // namespace ballot
