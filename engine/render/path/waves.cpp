#include "engine/render/path/waves.h"

#include <algorithm>
#include <limits>

#include "engine/core/error.h"
#include "engine/gpu/room.h"
#include "engine/render/data/camera.h"
#include "engine/render/data/parts.h"
#include "engine/render/data/run_pass.h"
#include "engine/render/path/wave_batch.h"
#include "engine/render/path/wave_room.h"

namespace ballot {

void PassTimes::add(std::string_view name, double ms, std::uint64_t rays, std::uint64_t dispatches) {
  auto found = std::ranges::find(times_, name, &PassTime::name);
  if (found == times_.end() && rays == 0) return;
  if (found == times_.end()) found = times_.insert(times_.end(), {.name = std::string(name)});
  found->ms += ms;
  found->rays += rays;
  found->dispatches += dispatches;
}

void PassTimes::add(const PassTimes& others) {
  for (const PassTime& t : others.times_) add(t.name, t.ms, t.rays, t.dispatches);
}

double PassTimes::ms(std::string_view name) const {
  double sum = 0;
  for (const PassTime& t : times_)
    if (t.name.starts_with(name)) sum += t.ms;
  return sum;
}

Waves::Waves(Context& gpu, Tracer& tracer, SceneData& scene) : gpu_(gpu), tracer_(tracer), scene_(scene) {}

Waves::~Waves() = default;

std::uint64_t Waves::path_bytes(const WavePlan& plan, std::uint64_t deferred) {
  constexpr std::uint64_t kRayAndHit = sizeof(Ray) + sizeof(Hit), kNumber = sizeof(std::uint32_t);
  std::uint64_t sum = kRayAndHit + sizeof(Path);
  if (plan.next) sum += kRayAndHit + 2 * sizeof(Carried);
  if (plan.shadow) sum += kRayAndHit + sizeof(ShadowPayload);
  if (plan.second) sum += deferred * (sizeof(Ray) + sizeof(Carried)) + sizeof(Deferred);
  if (plan.alpha) sum += 2 * (kRayAndHit + kNumber);
  return sum;
}

std::uint32_t Waves::capacity(const Integrator& integrator, const SceneFeatures& features, std::uint32_t last_depth,
                              std::uint64_t paths) const {
  const WavePlan plan = plan_of(integrator, features);
  const std::uint64_t deferred = plan.second ? std::max(1u, last_depth) : 0;
  const DeviceInfo& device = gpu_.info();
  return wave_capacity({.cpu = device.is_cpu(),
                        .grows = device.is_discrete(),
                        .memory = gpu_.own_memory(),
                        .path_bytes = path_bytes(plan, deferred),
                        .deferred = deferred,
                        .most_records = std::min(device.max_storage_range, device.max_allocation) / sizeof(Ray),
                        .most_rays = std::uint64_t(device.max_group_count_x) * kPassGroup},
                       paths);
}

std::uint64_t Waves::bytes_for(const Integrator& integrator, const SceneFeatures& features, std::uint32_t last_depth,
                               std::uint64_t paths) const {
  const WavePlan plan = plan_of(integrator, features);
  const std::uint64_t deferred = plan.second ? std::max(1u, last_depth) : 0;
  return std::min<std::uint64_t>(paths, capacity(integrator, features, last_depth, paths)) * path_bytes(plan, deferred);
}

Kernel& Waves::kernel(const KernelSource& source) {
  auto& kernel = kernels_[source.name];
  if (refresh(gpu_, kernel, source)) {
    scene_.bind(*kernel);
    gpu_.save_pipeline_cache();
  }
  return *kernel;
}

Kernel& Waves::indirect_kernel() {
  if (!indirect_kernel_ || indirect_kernel_->generation() != gpu_.shader_generation())
    indirect_kernel_ = &kernel(indirect_source());
  return *indirect_kernel_;
}

void Waves::make_alpha(std::uint32_t room) {
  if (ballot::make_room(queues_, gpu_, 1, "queue counts")) queues_->upload(std::vector<Queues>(1));
  if (!indirect_)
    indirect_ = std::make_unique<Buffer<IndirectArgs>>(gpu_, kRecords * INDIRECT_RECORDS,
                                                       Access::Storage | Access::Indirect, "indirect arguments");
  if (!reports_)
    reports_ = std::make_unique<Buffer<std::uint32_t>>(gpu_, kRecords * QUEUES, Access::Storage | Access::Host,
                                                       "counts of queues");
  if (room == 0 || (alpha_ && alpha_->room >= room)) return;
  alpha_.reset();
  alpha_ = std::make_unique<Alpha>(gpu_, room);
}

void Waves::make_buffers(std::uint32_t room, const WavePlan& plan, std::uint32_t last_depth, bool alpha) {
  if (room > room_) {
    waves_[0].reset();
    waves_[1].reset();
    room_ = room;
  }
  for (const int i : {0, 1}) {
    if (!waves_[i] && (i == 0 || plan.next)) waves_[i] = std::make_unique<Wave>(gpu_, room_);
    if (plan.next) make_room(waves_[i]->carried, gpu_, room_, "carried");
  }
  make_room(paths_, gpu_, room_, "paths");
  make_alpha(alpha ? room_ : 0);
  if (plan.shadow) {
    make_room(shadow_rays_, gpu_, room_, "rays to lights");
    make_room(shadow_hits_, gpu_, room_, "hits of rays to lights");
    make_room(shadow_payload_, gpu_, room_, "shadow payloads");
  }
  if (plan.second) {
    const std::size_t rays = std::size_t(room) * std::max(1u, last_depth);
    make_room(deferred_rays_, gpu_, rays, "deferred rays");
    make_room(deferred_carried_, gpu_, rays, "carried by deferred rays");
    make_room(deferred_, gpu_, room_, "depths put off");
  }
}

void Waves::drop_buffers() {
  for (auto& wave : waves_) wave.reset();
  room_ = 0;
  paths_.reset();
  alpha_.reset();
  shadow_rays_.reset();
  shadow_hits_.reset();
  shadow_payload_.reset();
  deferred_rays_.reset();
  deferred_carried_.reset();
  deferred_.reset();
}

// An eighth of the device's memory may be more than the scene and other programs leave free. The second try therefore
// asks for the smaller waves that capacity() gives for 0 paths.
Part Waves::make_room_for(const WaveSettings& settings, const WavePlan& plan, std::uint32_t places,
                          std::uint32_t count) {
  constexpr std::uint32_t kTogether = 16;  // samples of a pixel in one part
  const Part largest = largest_part(places, count, settings.most_paths, kTogether);
  try {
    make_buffers(largest.rays(), plan, settings.last_depth, plan.alpha);
    return largest;
  } catch (const Error&) {
    const std::uint32_t few = capacity(*settings.integrator, settings.features, settings.last_depth, 0);
    if (few >= largest.rays()) throw;
    drop_buffers();
    const Part less = largest_part(places, count, few, kTogether);
    make_buffers(less.rays(), plan, settings.last_depth, plan.alpha);
    return less;
  }
}

void Waves::add_samples(const WaveSettings& settings, const Buffer<std::uint32_t>& listed, std::uint32_t places,
                        std::uint32_t first, std::uint32_t count, Buffer<FilmPixel>& film, Buffer<glm::vec3>* moments,
                        PassTimes& times, const Progress& progress) {
  const PassScope scope(gpu_);
  const WavePlan plan = plan_of(*settings.integrator, settings.features);
  const Part largest = make_room_for(settings, plan, places, count);
  std::vector<PrimaryPush> cameras = cameras_of(settings.camera, places, count, largest, first);
  for (PrimaryPush& part : cameras) part.first += settings.first_place;
  Kernel& add = kernel(film_source(moments != nullptr));
  add.bind(BIND_PATHS, *paths_);
  add.bind(BIND_FILM, film);
  if (moments) add.bind(BIND_MOMENTS, *moments);
  Batch batch = batch_of(settings, listed, film, times);
  batch.push.paths = largest.rays();
  if (batch.makes_rays) {
    make_room(cameras_, gpu_, cameras.size(), "cameras");
    cameras_->upload(cameras);
  }
  std::uint64_t done = 0;
  for (const PrimaryPush& part : cameras) {
    batch.push.camera = std::uint32_t(&part - cameras.data());
    batch.push.samples = {part.first, part.together, part.sample_index, part.width, part.seed};
    Count pixels = run_batch(batch, part);
    pixels.rays = part.count / part.together;
    const FilmPush to_film{part.first, pixels.rays, part.together, part.sample_index,
                           settings.clamp > 0 ? settings.clamp : std::numeric_limits<float>::max()};
    run(add, pixels, &to_film, sizeof to_film, "film", times);
    done += part.count;
    if (progress) progress(double(done) / (double(places) * count));
  }
  gpu_.finish();
}

std::uint64_t Waves::bytes() const {
  std::uint64_t sum = alpha_ ? alpha_->bytes() : 0;
  for (const auto& wave : waves_)
    if (wave) sum += wave->bytes();
  for (const RawBuffer* b : std::initializer_list<const RawBuffer*>{
           paths_.get(), shadow_rays_.get(), shadow_hits_.get(), shadow_payload_.get(), deferred_rays_.get(),
           deferred_carried_.get(), deferred_.get(), cameras_.get()})
    if (b) sum += b->bytes();
  return sum;
}

}  // namespace ballot
