#include "tools/render/denoise.h"

#include <algorithm>

namespace ballot::cli {

namespace {

constexpr const char* kColors[] = {"R", "G", "B"};
constexpr std::uint32_t kFeatureSamples = 16;  // of albedo and normals: edges must be as smooth as the picture's

/// Returns the colours of an image, three floats a pixel.
std::vector<float> colors_of(const Image& image) {
  std::vector<float> all(std::size_t(image.width) * image.height * 3);
  for (std::size_t c = 0; c < 3; ++c) {
    const std::vector<float>& values = image.channel(kColors[c]).floats;
    for (std::size_t i = 0; i < values.size(); ++i) all[3 * i + c] = values[i];
  }
  return all;
}

Image feature(DeviceScene& world, const View& view, RenderOptions options, const char* shading) {
  options.shading = shading;
  options.spp = std::min(options.spp, kFeatureSamples);
  options.aovs = {"color"};
  return world.render(view, options);
}

void add(Image& image, const std::string& group, const std::vector<float>& values) {
  for (std::size_t c = 0; c < 3; ++c) {
    Channel channel{group + kColors[c], Pixel::Half, {}, {}};
    channel.floats.resize(values.size() / 3);
    for (std::size_t i = 0; i < channel.floats.size(); ++i) channel.floats[i] = values[3 * i + c];
    image.channels.push_back(std::move(channel));
  }
}

}  // namespace

void check_denoised(const RenderOptions& options) {
  if (!find_integrator(options.shading))
    fail(Failure::Arguments, "--denoise: shading '{}' has no noise; it is for {}", options.shading,
         names_of(kIntegrators));
  if (options.shard.count > 1 || !options.wants("color"))
    fail(Failure::Arguments,
         "--denoise: needs the whole picture with its colours; leave out --tiles, and add color to --aov");
}

void denoise(const Denoiser& denoiser, DeviceScene& world, const View& view, const RenderOptions& options,
             Image& image) {
  const Image normals = feature(world, view, options, "normals");
  NoisyPicture noisy{image.width, image.height, colors_of(image), colors_of(feature(world, view, options, "albedo")),
                     colors_of(normals)};
  const std::vector<float>& hit = normals.channel("A").floats;  // a share: what misses has no normal
  for (std::size_t i = 0; i < noisy.normal.size(); ++i) noisy.normal[i] = 2 * noisy.normal[i] - hit[i / 3];
  for (float& each : noisy.albedo) each = std::clamp(each, 0.0f, 1.0f);
  const std::vector<float> clean = denoiser.clean(noisy);
  add(image, "noisy.", noisy.color);
  add(image, "albedo.", noisy.albedo);
  for (Channel& channel : image.channels)
    for (std::size_t c = 0; c < 3; ++c)
      if (channel.name == kColors[c])
        for (std::size_t i = 0; i < channel.floats.size(); ++i) channel.floats[i] = clean[3 * i + c];
  image.attributes["denoiser"] = denoiser.name();
}

}  // namespace ballot::cli
