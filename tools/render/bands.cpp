#include "tools/render/bands.h"

#include <algorithm>

#include "tools/render/frames.h"

namespace ballot::cli {

namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostWhole = 1 << 24, kMostInBand = 1 << 23;  // pixels
constexpr const char* kJob = "band_job";  // attribute of a band: everything that decides its pixels

std::uint64_t pixels_of(const Window& w) { return std::uint64_t(w.x1 - w.x0) * (w.y1 - w.y0); }

RenderOptions with_window(RenderOptions options, const Window& window) {
  options.crop = window;
  return options;
}

/// Returns the file of a band beside the picture.
fs::path band_file(const fs::path& exr, const Window& band) {
  return fs::path(exr).replace_extension(fmt::format(".rows-{}-{}.exr", band.y0, band.y1 - 1));
}

/// Returns the rows of a band if nobody asked for a number; 0: the picture is rendered whole.
std::uint32_t suitable_rows(const Window& window, std::uint64_t pixel_bytes) {
  const std::uint64_t room = memory_left() / 2 / pixel_bytes, width = window.x1 - window.x0;
  if (pixels_of(window) <= std::min(kMostWhole, room)) return 0;
  const std::uint64_t rows = std::min(kMostInBand, room) / width / TILE_SIZE * TILE_SIZE;
  return std::uint32_t(std::max<std::uint64_t>(rows, TILE_SIZE));
}

std::vector<Window> bands_of(const Window& window, std::uint32_t rows) {
  if (rows == 0) return {window};
  rows = (rows + TILE_SIZE - 1) / TILE_SIZE * TILE_SIZE;
  std::vector<Window> bands;
  for (std::uint32_t y = window.y0; y < window.y1; y = bands.back().y1)
    bands.push_back({window.x0, y, window.x1, std::min(window.y1, (y / rows + 1) * rows)});
  return bands;
}

/// Gives the colours a type: bands keep them in full, so that a PNG of them has the bytes of one of the whole.
void set_colors(Image& image, Pixel type) {
  for (Channel& channel : image.channels)
    for (const char* name : {"R", "G", "B", "A"})
      if (channel.name == name) channel.type = type;
}

/// Returns true if the last colour of the heat map follows from all pixels.
bool paints_by_all(const RenderOptions& options) {
  return !find_integrator(options.shading) && find_shading(options.shading).heat && !find_heat(options.heat).ratio();
}

bool is_there(const fs::path& file, const std::string& job) {
  if (!fs::exists(file)) return false;
  try {
    const Image image = read_exr_header(file);
    const auto found = image.attributes.find(kJob);
    return found != image.attributes.end() && found->second == Attribute(job);
  } catch (const Error&) {
    return false;  // no picture
  }
}

/// Returns the value of the last colour for a heat map of all bands.
float top_of(const fs::path& exr, const RenderOptions& options, const BandPlan& plan) {
  std::vector<float> values;
  for (const Window& band : plan.bands) {
    const Image image = read_exr(band_file(exr, band));
    const std::vector<float>& some = image.channel(fmt::format("stats.{}", find_heat(options.heat).name)).floats;
    values.insert(values.end(), some.begin(), some.end());
  }
  return heat_top_of(std::move(values));
}

/// Returns the picture without the values of its pixels.
Image without_values(const fs::path& exr, const Window& window, const BandPlan& plan) {
  Image whole;
  float seconds = 0;
  for (const Window& band : plan.bands) {
    Image image = read_exr_header(band_file(exr, band));
    if (const auto s = image.attributes.find("seconds"); s != image.attributes.end())
      if (const float* spent = std::get_if<float>(&s->second)) seconds += *spent;
    if (&band == &plan.bands[0]) whole = std::move(image);
  }
  set_colors(whole, Pixel::Half);
  whole.height = window.y1 - window.y0;
  whole.attributes.erase(kJob);
  whole.attributes["seconds"] = seconds;
  return whole;
}

}  // namespace

BandPlan plan_bands(DeviceScene& world, const View& view, const RenderOptions& options, const BandWish& wish) {
  const Window window = options.window();
  const PictureBytes bytes = picture_bytes(options);
  const std::uint64_t all = pixels_of(window);
  BandPlan plan;
  plan.bands = bands_of(window, wish.whole ? 0 : wish.rows ? wish.rows : suitable_rows(window, bytes.rendered));
  std::uint64_t largest = 0;
  for (const Window& band : plan.bands) largest = std::max(largest, pixels_of(band));
  const std::uint64_t kept = (wish.png ? 3 * all : 0) + (plan.in_bands() && paints_by_all(options) ? 4 * all : 0);
  plan.host_bytes = std::max(largest * bytes.rendered, largest * bytes.channels + kept);
  plan.device_bytes = world.render_bytes_for(view, with_window(options, plan.bands[0]));
  need_memory(plan.host_bytes + (world.device().is_cpu() ? plan.device_bytes : 0),
              fmt::format("view {} of {} x {} pixels", view.name, window.x1 - window.x0, window.y1 - window.y0),
              "use --band with fewer rows");
  return plan;
}

void announce(const View& view, const RenderOptions& options, const BandPlan& plan, bool is_cpu) {
  const Window w = options.window();
  const std::string parts =
      plan.in_bands() ? fmt::format(" in {} bands of {} rows", plan.bands.size(), plan.bands[0].y1 - plan.bands[0].y0)
                      : "";
  const std::string there = is_cpu ? "" : fmt::format(", {} on the device", size_text(plan.device_bytes));
  say("  {:<10} {} x {} pixels{}: about {} of memory{}\n", view.name, w.x1 - w.x0, w.y1 - w.y0, parts,
      size_text(plan.host_bytes + (is_cpu ? plan.device_bytes : 0)), there);
}

Rendered render_bands(DeviceScene& world, const View& view, const RenderJob& job, const fs::path& exr,
                      const BandPlan& plan) {
  Rendered all;
  for (const Window& band : plan.bands) {
    RenderJob part = job;
    part.options = with_window(job.options, band);
    part.rows = fmt::format(", rows {} to {}", band.y0, band.y1 - 1);
    const fs::path file = band_file(exr, band);
    const std::string text = job_of(world, view, part.options);
    if (job.resume && is_there(file, text)) {
      ++all.bands_there;
      continue;
    }
    Rendered done = render_job(world, view, part, file);
    done.image.attributes[kJob] = text;
    set_colors(done.image, Pixel::Float);
    write_exr(file, done.image, Links::Replace);
    finish_job(file);
    all.times.add(done.times);
    all.seconds += done.seconds;
    all.film_s += done.film_s;
    all.resumed_at = std::max(all.resumed_at, done.resumed_at);
  }
  all.image = without_values(exr, job.options.window(), plan);
  if (paints_by_all(job.options)) {
    all.times.heat_top = top_of(exr, job.options, plan);
    all.image.attributes["heat_top"] = all.times.heat_top;
  }
  return all;
}

void join_bands(const Image& whole, const RenderOptions& options, const BandPlan& plan, const fs::path& exr,
                const fs::path& png, const Tone& tone, Links links) {
  PngRows rows(whole.width, whole.height);
  std::size_t band = 0;
  const auto next = [&] {
    Image image = read_exr(band_file(exr, plan.bands[band++]));
    if (paints_by_all(options))
      paint_heat(image, find_heat(options.heat), std::get<float>(whole.attributes.at("heat_top")));
    if (!png.empty()) rows.add(png, image, tone);
    set_colors(image, Pixel::Half);
    return image;
  };
  write_exr_in_bands(exr, whole, next, links);
  if (!png.empty()) rows.write(png, Links::Replace);
  std::error_code ignored;
  for (const Window& each : plan.bands) fs::remove(band_file(exr, each), ignored);
}

}  // namespace ballot::cli
