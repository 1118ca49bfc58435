#include "engine/render/renderer.h"

#include <bit>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>

#include "engine/core/error.h"
#include "engine/core/morton.h"

namespace ballot {

namespace {

constexpr std::uint32_t kGroup = 64;  // of shaders/rays/primary.comp and shaders/shade/shade.comp

PrimaryPush camera_push(const View& view, std::uint32_t width, std::uint32_t height) {
  const glm::dmat4& m = view.world_from_camera;
  const glm::dvec3 right(m[0]), up(m[1]), back(m[2]), eye(m[3]);
  const double half_y = view.orthographic ? view.ymag : std::tan(view.yfov / 2);
  const double half_x = half_y * width / height;
  PrimaryPush push{};
  push.width = width;
  push.height = height;
  push.orthographic = view.orthographic;
  const glm::dvec3 centre = view.orthographic ? eye : -back;
  push.origin = glm::vec3(view.orthographic ? -back : eye);
  push.corner = glm::vec3(centre - right * half_x + up * half_y);
  push.step_x = glm::vec3(right * (2 * half_x / width));
  push.step_y = glm::vec3(up * (-2 * half_y / height));
  return push;
}

/// Three texels a triangle from three corners and a word for the first texel.
template <class Corners>
std::vector<glm::uvec4> texels_of(std::span<const Corners> items, std::span<const std::uint32_t> words) {
  std::vector<glm::uvec4> texels(items.size() * 3);
  for (std::size_t i = 0; i < items.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      const glm::vec3& v = items[i][c];
      texels[i * 3 + c] = {std::bit_cast<std::uint32_t>(v.x), std::bit_cast<std::uint32_t>(v.y),
                           std::bit_cast<std::uint32_t>(v.z), c == 0 && !words.empty() ? words[i] : 0u};
    }
  return texels;
}

Image image_of(const std::vector<FilmPixel>& film, const RenderOptions& options) {
  Image image;
  image.width = options.width;
  image.height = options.height;
  const float scale = 1.0f / float(options.spp);
  const auto add = [&](const char* name, Pixel type, auto value) {
    Channel channel{name, type, {}, {}};
    for (const FilmPixel& p : film)
      if constexpr (std::is_same_v<decltype(value(p)), std::uint32_t>)
        channel.uints.push_back(value(p));
      else
        channel.floats.push_back(value(p));
    image.channels.push_back(std::move(channel));
  };
  add("R", Pixel::Half, [&](const FilmPixel& p) { return p.color.r * scale; });
  add("G", Pixel::Half, [&](const FilmPixel& p) { return p.color.g * scale; });
  add("B", Pixel::Half, [&](const FilmPixel& p) { return p.color.b * scale; });
  add("A", Pixel::Half, [&](const FilmPixel& p) { return p.alpha * scale; });
  add("Z", Pixel::Float, [](const FilmPixel& p) { return p.z; });
  add("N.X", Pixel::Float, [](const FilmPixel& p) { return p.normal.x; });
  add("N.Y", Pixel::Float, [](const FilmPixel& p) { return p.normal.y; });
  add("N.Z", Pixel::Float, [](const FilmPixel& p) { return p.normal.z; });
  add("prim", Pixel::Uint, [](const FilmPixel& p) { return p.prim; });
  return image;
}

/// From the order of rays (shaders/lib/film.glsl) to rows of pixels.
void scatter(std::span<const FilmPixel> part, const PrimaryPush& camera, std::vector<FilmPixel>& film) {
  const std::uint32_t tiles_x = (camera.width + TILE_SIZE - 1) / TILE_SIZE;
  for (std::uint32_t i = 0; i < part.size(); ++i) {
    const std::uint32_t ray = camera.first + i, tile = ray / (TILE_SIZE * TILE_SIZE),
                        inner = ray % (TILE_SIZE * TILE_SIZE);
    const std::uint32_t x = tile % tiles_x * TILE_SIZE + even_bits(inner);
    const std::uint32_t y = tile / tiles_x * TILE_SIZE + even_bits(inner >> 1);
    if (x < camera.width && y < camera.height) film[std::size_t(y) * camera.width + x] = part[i];
  }
}

}  // namespace

const Shading& find_shading(std::string_view name) {
  std::string names;
  for (const Shading& s : kShadings) {
    if (s.name == name) return s;
    names += fmt::format("{}{}", names.empty() ? "" : ", ", s.name);
  }
  fail(Failure::Arguments, "no shading is called '{}'; there are: {}", name, names);
}

void check_options(const RenderOptions& o) {
  if (o.width < 1 || o.height < 1 || o.width > 16384 || o.height > 16384)
    fail(Failure::Arguments, "--size: {}x{} is not between 1x1 and 16384x16384", o.width, o.height);
  if (o.spp < 1 || o.spp > 65536) fail(Failure::Arguments, "--spp: {} is not between 1 and 65536", o.spp);
  find_shading(o.shading);
}

/// Kernels and buffers of pictures that share shading and chunk size.
struct Renderer::Passes {
  std::string shading;
  std::uint32_t chunk;
  Buffer<Ray> rays;
  Buffer<Hit> hits;
  Buffer<FilmPixel> film;
  Kernel primary, shade;

  Passes(Context& gpu, std::uint32_t chunk_rays, const std::string& shading_name, const SceneFeatures& scene)
      : shading(shading_name),
        chunk(chunk_rays),
        rays(gpu, chunk, Access::Storage, "rays"),
        hits(gpu, chunk, Access::Storage, "hits"),
        film(gpu, chunk, Access::Storage, "film"),
        primary(gpu, {.name = "rays.primary", .file = "rays/primary.comp", .defines = {}, .constants = {}}),
        shade(gpu, {.name = "shade." + shading + (scene.shading_normals ? "+normals" : "") +
                            (scene.emits ? "+emission" : ""),
                    .file = "shade/shade.comp",
                    .defines = {{"BALLOT_SHADING", find_shading(shading).value},
                                {"BALLOT_HAS_NORMALS", scene.shading_normals},
                                {"BALLOT_HAS_EMISSION", scene.emits}},
                    .constants = {}}) {
    primary.bind(BIND_RAYS, rays);
    shade.bind(BIND_RAYS, rays);
    shade.bind(BIND_HITS, hits);
    shade.bind(BIND_FILM, film);
  }
};

/// What shading reads of the scene; what the scene lacks has no buffer.
struct Renderer::SceneData {
  Buffer<glm::uvec4> triangles;
  std::unique_ptr<Buffer<glm::uvec4>> normals;
  Buffer<GpuMaterial> materials;
};

Renderer::Renderer(Context& gpu, Tracer& tracer, const Scene& scene) : gpu_(gpu), tracer_(tracer), scene_(scene) {}

Renderer::~Renderer() = default;

const Renderer::SceneData& Renderer::scene_data() {
  if (data_) return *data_;
  const auto triangles = texels_of(std::span<const Triangle>(scene_.triangles), scene_.material_of);
  std::vector<GpuMaterial> materials;
  for (const Material& m : scene_.materials) materials.push_back({m.base_color, m.emissive});
  data_ = std::make_unique<SceneData>(SceneData{{gpu_, triangles.size(), Access::Texel, "triangles"},
                                                nullptr,
                                                {gpu_, materials.size(), Access::Storage, "materials"}});
  data_->triangles.upload(triangles);
  data_->materials.upload(materials);
  if (scene_.normals.empty()) return *data_;
  const auto normals = texels_of(std::span<const std::array<glm::vec3, 3>>(scene_.normals), {});
  data_->normals = std::make_unique<Buffer<glm::uvec4>>(gpu_, normals.size(), Access::Texel, "normals");
  data_->normals->upload(normals);
  return *data_;
}

Renderer::Passes& Renderer::passes(const RenderOptions& options, std::uint32_t chunk) {
  if (passes_ && passes_->shading == options.shading && passes_->chunk == chunk) return *passes_;
  passes_.reset();
  passes_ = std::make_unique<Passes>(gpu_, chunk, options.shading, features_of(scene_));
  const SceneData& data = scene_data();
  passes_->shade.bind(BIND_TRIANGLES, data.triangles);
  if (data.normals) passes_->shade.bind(BIND_NORMALS, *data.normals);
  if (passes_->shade.wants(BIND_MATERIALS)) passes_->shade.bind(BIND_MATERIALS, data.materials);
  gpu_.save_pipeline_cache();
  return *passes_;
}

void Renderer::trace_sample(Passes& passes, const PrimaryPush& camera, std::uint32_t count, const Query& query,
                            RenderTimes& times) {
  const std::uint32_t groups = (count + kGroup - 1) / kGroup;
  gpu_.submit(passes.primary.name(), [&](VkCommandBuffer cmd) {
    passes.primary.dispatch(cmd, groups, camera);
    memory_barrier(cmd);
  });
  times.generate_ms += gpu_.last_ms();
  times.trace_ms += tracer_.trace(passes.rays, passes.hits, count, query).device_ms;
  const ShadePush push{camera.width, camera.height, camera.first, count, camera.sample_index};
  gpu_.submit(passes.shade.name(), [&](VkCommandBuffer cmd) {
    passes.shade.dispatch(cmd, groups, push);
    memory_barrier(cmd);
  });
  times.shade_ms += gpu_.last_ms();
}

Image Renderer::render(const View& view, const RenderOptions& options, RenderTimes* times, const Progress& progress) {
  check_options(options);
  const auto start = std::chrono::steady_clock::now();
  const std::uint32_t tiles_x = (options.width + TILE_SIZE - 1) / TILE_SIZE;
  const std::uint32_t tiles_y = (options.height + TILE_SIZE - 1) / TILE_SIZE;
  const std::uint32_t total = tiles_x * tiles_y * TILE_SIZE * TILE_SIZE;
  const std::uint32_t chunk = std::min(total, tracer_.chunk_rays() / (TILE_SIZE * TILE_SIZE) * (TILE_SIZE * TILE_SIZE));
  Passes& passes = this->passes(options, chunk);
  PrimaryPush camera = camera_push(view, options.width, options.height);
  camera.sample_count = options.spp;
  RenderTimes sum;
  std::vector<FilmPixel> film(std::size_t(options.width) * options.height), part(chunk);
  for (camera.first = 0; camera.first < total; camera.first += chunk) {
    const std::uint32_t count = std::min(chunk, total - camera.first);
    for (camera.sample_index = 0; camera.sample_index < options.spp; ++camera.sample_index) {
      trace_sample(passes, camera, count, options.query, sum);
      const double chunk_done = double(camera.sample_index + 1) / options.spp * count;
      if (progress) progress((camera.first + chunk_done) / total);
    }
    passes.film.download(std::span(part).first(count));
    scatter(std::span<const FilmPixel>(part).first(count), camera, film);
  }
  Image image = image_of(film, options);
  sum.rays = std::uint64_t(options.width) * options.height * options.spp;
  sum.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (times) *times = sum;
  return image;
}

}  // namespace ballot
