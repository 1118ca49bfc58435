// Waves of rays: traced, let through what is transparent, scattered, and connected to lights; every pass a dispatch over a
// buffer, and the rays of the next wave one behind the other. How many they are stays on the device, which calls the next
// passes itself; the host records some depths ahead and looks back whether there was anything left.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/render/film/film.h"
#include "engine/render/film/parts.h"
#include "engine/render/path/integrators.h"
#include "engine/trace/tracer.h"

namespace ballot {

/// What one kind of pass took so far.
struct PassTime {
  std::string name;
  double ms = 0;  // device time
  std::uint64_t rays = 0, dispatches = 0;
};

/// Sums by name, in the order of first use. Passes over no rays are named only if others of their name had some.
class PassTimes {
 public:
  void add(std::string_view name, double ms, std::uint64_t rays, std::uint64_t dispatches);
  void add(std::string_view name, double ms, std::uint64_t rays) { add(name, ms, rays, rays > 0); }
  void add(const PassTimes& others);
  const std::vector<PassTime>& all() const { return times_; }
  double ms(std::string_view name) const;  // of all whose name begins so

 private:
  std::vector<PassTime> times_;
};

/// How waves are made of a view.
struct WaveSettings {
  const Integrator* integrator = nullptr;
  PrimaryPush camera{};          // with the picture's samples in sample_count, and its seed
  std::uint32_t most_paths = 0;  // under way at once, at most capacity()
  std::uint32_t last_depth = 0;
  float ao_radius = 0;  // scene units
  Query query{};
  SceneFeatures features{};  // what kernels are made for: the scene's, or more
  Sky::Kind sky = Sky::Kind::None;
};

class Waves {
 public:
  /// Keeps references to all of them.
  Waves(Context& gpu, Tracer& tracer, SceneData& scene);
  ~Waves();

  /// Paths that are under way at once at most, of so many in all.
  std::uint32_t capacity(const Integrator& integrator, const SceneFeatures& features, std::uint32_t last_depth,
                         std::uint64_t paths) const;

  /// Adds samples [first, first + count) of the listed pixels (`places` of them) to the film, and to the moments if there are any.
  /// Sums do not depend on how pixels and samples are dealt out over calls.
  void add_samples(const WaveSettings& settings, const Buffer<std::uint32_t>& listed, std::uint32_t places,
                   std::uint32_t first, std::uint32_t count, Buffer<FilmPixel>& film, Buffer<glm::vec3>* moments,
                   PassTimes& times, const Progress& progress);

  /// Lets the rays of hits on what is transparent go on, until they hit what is not or nothing. Nothing to do for a scene without
  /// alpha. query.want is Nearest.
  void pass_through(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query,
                    const SceneFeatures& features, PassTimes& times);

  /// Bytes of all buffers that are held.
  std::uint64_t bytes() const;

 private:
  struct Wave;
  struct Alpha;
  struct Asked;
  struct Awaiting;
  struct Batch;

  /// How many rays a queue held: an entry of indirect_ and reports_, and what the host knows of it.
  struct Count {
    std::uint32_t record = 0, queue = 0;
    std::uint32_t rays = 0;  // at most, until it is known
    bool known = false;
    std::uint32_t trace_args() const { return record * INDIRECT_RECORDS + queue; }
    std::uint32_t wave_args() const { return trace_args() + QUEUES; }
  };

  /// Of all buffers, for each path.
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

  static constexpr std::uint32_t kRecords = 1024;  // more than three submissions can ask for

  Context& gpu_;
  Tracer& tracer_;
  SceneData& scene_;
  std::uint32_t room_ = 0;
  std::unique_ptr<Wave> waves_[2];                // one is traced and scattered, the other filled
  std::unique_ptr<Buffer<PrimaryPush>> cameras_;  // of each part
  std::unique_ptr<Buffer<Path>> paths_;
  std::unique_ptr<Buffer<Ray>> shadow_rays_, deferred_rays_;
  std::unique_ptr<Buffer<Hit>> shadow_hits_;
  std::unique_ptr<Buffer<ShadowPayload>> shadow_payload_;
  std::unique_ptr<Buffer<Carried>> deferred_carried_;
  std::unique_ptr<Buffer<Deferred>> deferred_;
  std::unique_ptr<Alpha> alpha_;
  std::unique_ptr<Buffer<Queues>> queues_;
  std::unique_ptr<Buffer<IndirectArgs>> indirect_;
  std::unique_ptr<Buffer<std::uint32_t>> reports_;  // of every queue of every record, in the host's memory
  std::uint32_t record_ = 0;
  std::uint32_t depths_together_ = 4;  // in one submission
  std::uint64_t paced_ = 0;            // the submission whose time decided that
  std::unique_ptr<Asked> shown_;       // of the last pass_through() that is no batch's
  std::map<std::string, std::unique_ptr<Kernel>> kernels_;
  Kernel* indirect_kernel_ = nullptr;  // one of them
};

}  // namespace ballot
