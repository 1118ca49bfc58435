// Waves of rays: traced, let through what is transparent, scattered, and connected to lights; every pass a dispatch over a
// buffer, and the rays of the next wave one behind the other.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/render/film.h"
#include "engine/render/integrators.h"
#include "engine/trace/tracer.h"

namespace ballot {

/// What one kind of pass took so far.
struct PassTime {
  std::string name;
  double ms = 0;  // device time
  std::uint64_t rays = 0, dispatches = 0;
};

/// Sums by name, in the order of first use.
class PassTimes {
 public:
  void add(std::string_view name, double ms, std::uint64_t rays);
  const std::vector<PassTime>& all() const { return times_; }
  double ms(std::string_view name) const;  // of all whose name begins so

 private:
  std::vector<PassTime> times_;
};

/// How waves are made of a view.
struct WaveSettings {
  const Integrator* integrator = nullptr;
  PrimaryPush camera{};  // with the picture's samples in sample_count
  std::uint32_t last_depth = 0;
  float ao_radius = 0;  // scene units
  std::uint32_t seed = 0;
  Query query{};
  SceneFeatures features{};  // what kernels are made for: the scene's, or more
  Sky::Kind sky = Sky::Kind::None;
};

class Waves {
 public:
  /// Keeps references to all of them.
  Waves(Context& gpu, Tracer& tracer, SceneData& scene);
  ~Waves();

  /// Paths that are under way at once at most.
  std::uint32_t capacity(const Integrator& integrator) const;

  /// Adds samples [first, first + count) of the listed pixels (`places` of them, at most capacity()) to the film, and to the
  /// moments if there are any. Sums do not depend on how pixels and samples are dealt out over calls.
  void add_samples(const WaveSettings& settings, const Buffer<std::uint32_t>& numbers, std::uint32_t places,
                   std::uint32_t first, std::uint32_t count, Buffer<FilmPixel>& film, Buffer<glm::vec3>* moments,
                   PassTimes& times);

  /// Lets the rays of hits on what is transparent go on, until they hit what is not or nothing. Nothing to do for a scene without
  /// alpha. query.want is Nearest.
  void pass_through(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query,
                    const SceneFeatures& features, PassTimes& times);

  /// Bytes of all buffers that are held.
  std::uint64_t bytes() const;

 private:
  struct Wave;
  struct Alpha;
  using WavePtr = std::unique_ptr<Wave>;

  WavePtr acquire(std::uint32_t room);
  void release(WavePtr wave);
  Kernel& kernel(const KernelSource& source);
  void run(Kernel& kernel, std::uint32_t count, const void* push, std::uint32_t push_bytes, std::string_view name,
           PassTimes& times, bool clear_queues = false);
  void trace(Wave& wave, std::string_view kind, const WaveSettings& settings, PassTimes& times);
  void run_wave(WavePtr wave, std::uint32_t depth, std::string_view kind, const WaveSettings& settings,
                Buffer<FilmPixel>& film, PassTimes& times);
  void bind_wave(Kernel& scatter, Wave& wave, Wave* next, Wave* second, Buffer<FilmPixel>& film);
  void connect(std::uint32_t count, const WaveSettings& settings, PassTimes& times);

  Context& gpu_;
  Tracer& tracer_;
  SceneData& scene_;
  std::uint32_t room_ = 0;
  std::vector<WavePtr> pool_;
  std::unique_ptr<Buffer<Path>> paths_;
  std::unique_ptr<Buffer<Ray>> shadow_rays_;
  std::unique_ptr<Buffer<Hit>> shadow_hits_;
  std::unique_ptr<Buffer<Awaited>> shadow_light_;
  std::unique_ptr<Alpha> alpha_;
  std::unique_ptr<Buffer<Queues>> queues_;
  std::uint64_t wave_bytes_ = 0;
  std::map<std::string, std::unique_ptr<Kernel>> kernels_;
};

}  // namespace ballot
