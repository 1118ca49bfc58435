// Waves of rays. A wave is traced, passed through transparent surfaces, scattered, and connected to the lights. Every
// pass is a dispatch over a buffer; the rays of the next wave are stored consecutively. Their number stays on the
// device, which dispatches the next passes by indirect arguments. The host records some depths ahead and later checks
// whether any rays were left.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/answer/tracer.h"
#include "engine/render/data/parts.h"
#include "engine/render/path/integrators.h"

namespace ballot {

/// The sums of all passes of one name.
struct PassTime {
  std::string name;
  double ms = 0;  // device time
  std::uint64_t rays = 0, dispatches = 0;
};

/// The times of passes, summed by name, in the order of first use. A name is listed once a pass of that name had rays.
class PassTimes {
 public:
  void add(std::string_view name, double ms, std::uint64_t rays, std::uint64_t dispatches);
  void add(std::string_view name, double ms, std::uint64_t rays) { add(name, ms, rays, rays > 0); }
  void add(const PassTimes& others);
  const std::vector<PassTime>& all() const { return times_; }
  /// Returns the sum over all names that begin with `name`.
  double ms(std::string_view name) const;

 private:
  std::vector<PassTime> times_;
};

/// The settings of the waves of a picture.
struct WaveSettings {
  const Integrator* integrator = nullptr;
  PrimaryPush camera{};          // sample_count: the samples of the picture; seed: its seed
  std::uint32_t most_paths = 0;  // paths in flight at once, at most capacity()
  std::uint32_t last_depth = 0;  // last path depth
  float ao_radius = 0;           // scene units
  float clamp = 0;               // RenderOptions::clamp
  Query query{};
  SceneFeatures features{};  // features that the kernels are compiled for: the scene's, or more
  Sky::Kind sky = Sky::Kind::None;
  std::uint32_t first_place = 0;  // of the first listed pixel that is meant
};

/// Runs integrators. Keeps its kernels and buffers from call to call. Belongs to one thread.
class Waves {
 public:
  /// Keeps references to all arguments.
  Waves(Context& gpu, Tracer& tracer, SceneData& scene);
  ~Waves();

  /// Returns the largest number of paths in flight at once, given the number of all paths of the picture.
  std::uint32_t capacity(const Integrator& integrator, const SceneFeatures& features, std::uint32_t last_depth,
                         std::uint64_t paths) const;

  /// Returns about the bytes of all buffers on the device for that many paths in flight.
  std::uint64_t bytes_for(const Integrator& integrator, const SceneFeatures& features, std::uint32_t last_depth,
                          std::uint64_t paths) const;

  /// Adds the samples [first, first + count) of `places` listed pixels, from settings.first_place on, to the film, and
  /// to the moments if not null. The sums do not depend on how pixels and samples are split over calls. Throws
  /// Error(Work) if the device fails or has not enough memory.
  void add_samples(const WaveSettings& settings, const Buffer<std::uint32_t>& listed, std::uint32_t places,
                   std::uint32_t first, std::uint32_t count, Buffer<FilmPixel>& film, Buffer<glm::vec3>* moments,
                   PassTimes& times, const Progress& progress);

  /// Continues rays [0, count) that hit a transparent surface until they hit an opaque one or nothing, and updates
  /// their hits. Does nothing for a scene without alpha. query.want must be Nearest.
  void pass_through(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query,
                    const SceneFeatures& features, PassTimes& times);

  /// Returns the bytes of all buffers on the device.
  std::uint64_t bytes() const;

 private:
  struct Wave;
  struct Alpha;
  struct Asked;
  struct Awaiting;
  struct Batch;

  /// The ray count of a queue: the index of its entries in indirect_ and reports_, and what the host knows of it.
  struct Count {
    std::uint32_t record = 0, queue = 0;
    std::uint32_t rays = 0;  // the count if `known`, else an upper bound
    bool known = false;      // by the host
    std::uint32_t trace_args() const { return record * INDIRECT_RECORDS + queue; }
    std::uint32_t wave_args() const { return trace_args() + QUEUES; }
  };

  /// Returns the bytes of all buffers per path.
  static std::uint64_t path_bytes(const WavePlan& plan, std::uint64_t deferred);
  Kernel& kernel(const KernelSource& source);
  Kernel& indirect_kernel();
  void make_buffers(std::uint32_t room, const WavePlan& plan, std::uint32_t last_depth, bool alpha);
  void make_alpha(std::uint32_t room);
  void drop_buffers();
  Part make_room_for(const WaveSettings& settings, const WavePlan& plan, std::uint32_t places, std::uint32_t count);
  Batch batch_of(const WaveSettings& settings, const Buffer<std::uint32_t>& listed, Buffer<FilmPixel>& film,
                 PassTimes& times);

  std::uint32_t next_record() { return record_++ % kRecords; }
  std::uint32_t reported(const Count& count) const;
  void look(Count& count);
  Count known_count(std::uint32_t rays, const Query& query);
  Context::Done told(std::string_view name, const Count& count, PassTimes& times) const;
  void run(Kernel& kernel, const Count& count, const void* push, std::uint32_t push_bytes, std::string_view name,
           PassTimes& times, const CallPush* then = nullptr);
  bool trace(const Buffer<Ray>& rays, Buffer<Hit>& hits, Count& count, Asked& asked, std::string_view name,
             PassTimes& times);
  void pass_through(const Buffer<Ray>& rays, Buffer<Hit>& hits, const Count& count, Asked& asked, Kernel& test,
                    std::deque<Awaiting>* leftovers, PassTimes& times);
  Count alpha_turn(const Buffer<Ray>& rays, Buffer<Hit>& hits, const Count& count, std::uint32_t turn,
                   const Asked& asked, Kernel& test, PassTimes& times);
  Count run_batch(Batch& batch, const PrimaryPush& camera);
  void begin(Batch& batch, const PrimaryPush& camera, const Count& paths);
  void run_waves(Batch& batch, const PrimaryPush& camera, Count count);
  bool trace(Batch& batch, const PrimaryPush& camera, Wave& wave, Count& count);
  bool trace(Batch& batch, const Buffer<Ray>& rays, Buffer<Hit>& hits, Count& count, Asked& asked);
  void hear(Batch& batch);
  bool has_ended(Batch& batch, const Count& count);
  void scatter(Batch& batch, Wave& wave, Wave& next, Count& count, Count& shadow);
  void connect(Batch& batch, Count& count);

  static constexpr std::uint32_t kRecords = 1024;  // more than three submissions can use

  Context& gpu_;
  Tracer& tracer_;
  SceneData& scene_;
  std::uint32_t room_ = 0;
  std::unique_ptr<Wave> waves_[2];                // one is traced and scattered, the other is filled
  std::unique_ptr<Buffer<PrimaryPush>> cameras_;  // one per part of a picture
  std::unique_ptr<Buffer<Path>> paths_;
  std::unique_ptr<Buffer<Ray>> shadow_rays_, deferred_rays_;
  std::unique_ptr<Buffer<Hit>> shadow_hits_;
  std::unique_ptr<Buffer<ShadowPayload>> shadow_payload_;
  std::unique_ptr<Buffer<Carried>> deferred_carried_;
  std::unique_ptr<Buffer<Deferred>> deferred_;
  std::unique_ptr<Alpha> alpha_;
  std::unique_ptr<Buffer<Queues>> queues_;
  std::unique_ptr<Buffer<IndirectArgs>> indirect_;
  std::unique_ptr<Buffer<std::uint32_t>> reports_;  // counts of every queue of every record, in host memory
  std::uint32_t record_ = 0;
  std::uint32_t depths_together_ = 4;                       // depths in one submission
  std::uint64_t paced_ = 0;                                 // the submission whose time last set depths_together_
  std::unique_ptr<Asked> shown_;                            // of the last call of the public pass_through()
  std::map<std::string, std::unique_ptr<Kernel>> kernels_;  // by name
  Kernel* indirect_kernel_ = nullptr;                       // points into kernels_
};

}  // namespace ballot
