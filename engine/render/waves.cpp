#include "engine/render/waves.h"

#include <algorithm>

#include "engine/core/error.h"
#include "engine/render/camera.h"
#include "engine/render/room.h"

namespace ballot {

namespace {

constexpr std::uint32_t kGroup = 64;  // of shaders/path/*.comp

}  // namespace

void PassTimes::add(std::string_view name, double ms, std::uint64_t rays) {
  auto found = std::ranges::find(times_, name, &PassTime::name);
  if (found == times_.end()) found = times_.insert(times_.end(), {.name = std::string(name)});
  found->ms += ms;
  found->rays += rays;
  ++found->dispatches;
}

double PassTimes::ms(std::string_view name) const {
  double sum = 0;
  for (const PassTime& t : times_)
    if (t.name.starts_with(name)) sum += t.ms;
  return sum;
}

/// Rays with what they carry, and room for their hits.
struct Waves::Wave {
  std::uint32_t room, count = 0;
  Buffer<Ray> rays;
  Buffer<Hit> hits;
  Buffer<Carried> carried;

  Wave(Context& gpu, std::uint32_t size)
      : room(size),
        rays(gpu, size, Access::Storage, "wave rays"),
        hits(gpu, size, Access::Storage, "wave hits"),
        carried(gpu, size, Access::Storage, "carried") {}
  std::uint64_t bytes() const { return rays.bytes() + hits.bytes() + carried.bytes(); }
};

/// Rays that went on, in two turns; only for scenes with alpha.
struct Waves::Alpha {
  struct Side {
    Buffer<Ray> rays;
    Buffer<Hit> hits;
    Buffer<std::uint32_t> ids;
    Side(Context& gpu, std::uint32_t size)
        : rays(gpu, size, Access::Storage, "rays that went on"),
          hits(gpu, size, Access::Storage, "hits of rays that went on"),
          ids(gpu, size, Access::Storage, "numbers of rays that went on") {}
  };
  std::uint32_t room;
  Side sides[2];
  Alpha(Context& gpu, std::uint32_t size) : room(size), sides{{gpu, size}, {gpu, size}} {}
  std::uint64_t bytes() const {
    std::uint64_t sum = 0;
    for (const Side& s : sides) sum += s.rays.bytes() + s.hits.bytes() + s.ids.bytes();
    return sum;
  }
};

Waves::Waves(Context& gpu, Tracer& tracer, SceneData& scene) : gpu_(gpu), tracer_(tracer), scene_(scene) {}

Waves::~Waves() = default;

// Whitted's rays part at every glass, and each depth keeps a wave.
std::uint32_t Waves::capacity(const Integrator& integrator) const {
  const bool parts = integrator.value == INTEGRATOR_WHITTED;
  const std::uint32_t most = gpu_.info().is_cpu() ? 1u << 18 : parts ? 1u << 20 : 1u << 22;
  return std::min(most, tracer_.chunk_rays()) / kGroup * kGroup;
}

Waves::WavePtr Waves::acquire(std::uint32_t room) {
  if (pool_.empty()) {
    auto wave = std::make_unique<Wave>(gpu_, room);
    wave_bytes_ += wave->bytes();
    return wave;
  }
  WavePtr wave = std::move(pool_.back());
  pool_.pop_back();
  return wave;
}

void Waves::release(WavePtr wave) { pool_.push_back(std::move(wave)); }

Kernel& Waves::kernel(const KernelSource& source) {
  auto& kernel = kernels_[source.name];
  if (refresh(gpu_, kernel, source)) {
    scene_.bind(*kernel);
    gpu_.save_pipeline_cache();
  }
  return *kernel;
}

void Waves::run(Kernel& kernel, std::uint32_t count, const void* push, std::uint32_t push_bytes, std::string_view name,
                PassTimes& times, bool clear_queues) {
  gpu_.submit(kernel.name(), [&](VkCommandBuffer cmd) {
    if (clear_queues) {
      vkCmdFillBuffer(cmd, queues_->handle(), 0, VK_WHOLE_SIZE, 0);
      memory_barrier(cmd);
    }
    kernel.dispatch(cmd, (count + kGroup - 1) / kGroup, push, push_bytes);
    memory_barrier(cmd);
  });
  times.add(name, gpu_.last_ms(), count);
}

void Waves::pass_through(const Buffer<Ray>& rays, Buffer<Hit>& hits, std::uint32_t count, const Query& query,
                         const SceneFeatures& features, PassTimes& times) {
  if (!features.alpha || count == 0) return;
  make_room(queues_, gpu_, 1, "queue counts");
  if (!alpha_ || alpha_->room < count) {
    alpha_.reset();
    alpha_ = std::make_unique<Alpha>(gpu_, count);
  }
  Kernel& test = kernel(alpha_source(features));
  test.bind(BIND_WAVE_HITS, hits);
  test.bind(BIND_QUEUES, *queues_);
  AlphaPush push{count, 1};
  for (std::uint32_t turn = 0; push.count > 0; ++turn) {
    Alpha::Side &from = alpha_->sides[turn % 2], &to = alpha_->sides[(turn + 1) % 2];
    test.bind(BIND_RAYS, push.first ? rays : from.rays);
    test.bind(BIND_HITS, push.first ? hits : from.hits);
    test.bind(BIND_NUMBERS, from.ids);
    test.bind(BIND_NEXT_RAYS, to.rays);
    test.bind(BIND_NEXT_IDS, to.ids);
    run(test, push.count, &push, sizeof push, "alpha", times, true);
    Queues queues{};
    queues_->download(std::span(&queues, 1));
    push = {queues.passed, 0};
    if (push.count > 0)
      times.add("trace behind", tracer_.trace(to.rays, to.hits, push.count, query).device_ms, push.count);
  }
}

void Waves::trace(Wave& wave, std::string_view kind, const WaveSettings& settings, PassTimes& times) {
  Query query = settings.query;
  query.want = Want::Nearest;
  query.rays = kind;
  times.add(fmt::format("trace {}", kind), tracer_.trace(wave.rays, wave.hits, wave.count, query).device_ms,
            wave.count);
  pass_through(wave.rays, wave.hits, wave.count, query, settings.features, times);
}

// Where the scene has alpha, the nearest hit is asked for, so that rays to lights see what all others see.
void Waves::connect(std::uint32_t count, const WaveSettings& settings, PassTimes& times) {
  if (count == 0) return;
  Query query = settings.query;
  query.want = settings.features.alpha ? Want::Nearest : Want::Any;
  query.rays = settings.integrator->value == INTEGRATOR_AO ? "ao" : "shadow";
  times.add("trace " + query.rays, tracer_.trace(*shadow_rays_, *shadow_hits_, count, query).device_ms, count);
  pass_through(*shadow_rays_, *shadow_hits_, count, query, settings.features, times);
  Kernel& connect = kernel(connect_source());
  connect.bind(BIND_HITS, *shadow_hits_);
  connect.bind(BIND_SHADOW_LIGHT, *shadow_light_);
  connect.bind(BIND_PATHS, *paths_);
  run(connect, count, &count, sizeof count, "connect", times);
}

void Waves::bind_wave(Kernel& scatter, Wave& wave, Wave* next, Wave* second, Buffer<FilmPixel>& film) {
  scatter.bind(BIND_RAYS, wave.rays);
  scatter.bind(BIND_HITS, wave.hits);
  scatter.bind(BIND_CARRIED, wave.carried);
  scatter.bind(BIND_PATHS, *paths_);
  scatter.bind(BIND_FILM, film);
  scatter.bind(BIND_QUEUES, *queues_);
  if (scatter.wants(BIND_SHADOW_RAYS)) {
    scatter.bind(BIND_SHADOW_RAYS, *shadow_rays_);
    scatter.bind(BIND_SHADOW_LIGHT, *shadow_light_);
  }
  if (next) {
    scatter.bind(BIND_NEXT_RAYS, next->rays);
    scatter.bind(BIND_NEXT_CARRIED, next->carried);
  }
  if (second) {
    scatter.bind(BIND_SECOND_RAYS, second->rays);
    scatter.bind(BIND_SECOND_CARRIED, second->carried);
  }
}

// Depth first: what a wave's mirrors reflect, with all that follows, then what its glass refracts. So few waves wait, and each
// holds at most one ray of a path.
void Waves::run_wave(WavePtr wave, std::uint32_t depth, std::string_view kind, const WaveSettings& settings,
                     Buffer<FilmPixel>& film, PassTimes& times) {
  const WavePlan plan = plan_of(*settings.integrator, settings.features);
  trace(*wave, kind, settings, times);
  Kernel& scatter = kernel(scatter_source(*settings.integrator, settings.features, settings.sky));
  WavePtr next = scatter.wants(BIND_NEXT_RAYS) ? acquire(room_) : nullptr;
  WavePtr second = scatter.wants(BIND_SECOND_RAYS) ? acquire(room_) : nullptr;
  bind_wave(scatter, *wave, next.get(), second.get(), film);
  WavePush push{wave->count, depth, settings.last_depth, settings.ao_radius, 0, 0, 0, 0};
  if (scatter.wants(BIND_EMITTERS)) {
    push.emitted = scene_.emitters().total;
    push.emitters = std::uint32_t(scene_.emitters().texels.size());
  }
  push.lights = std::uint32_t(scene_.scene().lights.size());
  push.sky = scene_.scene().sky.kind != Sky::Kind::None;
  run(scatter, wave->count, &push, sizeof push, "scatter", times, true);
  release(std::move(wave));
  Queues queues{};
  queues_->download(std::span(&queues, 1));
  if (plan.shadow) connect(queues.shadow, settings, times);
  for (auto [child, count, child_kind] :
       {std::tuple(&next, queues.next, plan.second ? "reflect" : settings.integrator->next_kind),
        std::tuple(&second, queues.second, std::string_view("refract"))}) {
    if (!*child) continue;
    (*child)->count = count;
    if (count > 0)
      run_wave(std::move(*child), depth + 1, child_kind, settings, film, times);
    else
      release(std::move(*child));
  }
}

void Waves::add_samples(const WaveSettings& settings, const Buffer<std::uint32_t>& numbers, std::uint32_t places,
                        std::uint32_t first, std::uint32_t count, Buffer<FilmPixel>& film, Buffer<glm::vec3>* moments,
                        PassTimes& times) {
  const WavePlan plan = plan_of(*settings.integrator, settings.features);
  const std::uint32_t together = std::clamp(capacity(*settings.integrator) / places, 1u, count);
  if (places * together > room_) {
    pool_.clear();
    wave_bytes_ = 0;
    room_ = places * together;
  }
  make_room(paths_, gpu_, room_, "paths");
  make_room(queues_, gpu_, 1, "queue counts");
  if (plan.shadow) {
    make_room(shadow_rays_, gpu_, room_, "rays to lights");
    make_room(shadow_hits_, gpu_, room_, "hits of rays to lights");
    make_room(shadow_light_, gpu_, room_, "awaited light");
  }
  Kernel &begin = kernel(begin_source(settings.features)), &add = kernel(film_source(moments != nullptr));
  const PixelCone cone = pixel_cone(settings.camera);
  for (std::uint32_t done = 0; done < count; done += together) {
    const std::uint32_t samples = std::min(together, count - done);
    WavePtr wave = acquire(room_);
    wave->count = places * samples;
    begin.bind(BIND_RAYS, wave->rays);
    begin.bind(BIND_CARRIED, wave->carried);
    begin.bind(BIND_PATHS, *paths_);
    begin.bind(BIND_NUMBERS, numbers);
    const BeginPush push{settings.camera, wave->count, places, first + done, cone.width, cone.spread, settings.seed};
    run(begin, wave->count, &push, sizeof push, "begin", times);
    run_wave(std::move(wave), 0, "primary", settings, film, times);
    add.bind(BIND_PATHS, *paths_);
    add.bind(BIND_FILM, film);
    if (moments) add.bind(BIND_MOMENTS, *moments);
    const FilmPush to_film{places, samples, first + done};
    run(add, places, &to_film, sizeof to_film, "film", times);
  }
}

std::uint64_t Waves::bytes() const {
  std::uint64_t sum = wave_bytes_ + (alpha_ ? alpha_->bytes() : 0);
  for (const RawBuffer* b : std::initializer_list<const RawBuffer*>{paths_.get(), shadow_rays_.get(),
                                                                    shadow_hits_.get(), shadow_light_.get()})
    if (b) sum += b->bytes();
  return sum;
}

}  // namespace ballot
