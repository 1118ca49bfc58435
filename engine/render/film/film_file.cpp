#include "engine/render/film/film_file.h"

#include <cmath>
#include <sstream>

#include "engine/core/error.h"
#include "engine/files/image.h"
#include "engine/render/data/camera.h"

namespace ballot {

namespace {

/// Returns the index of each pixel of the film in the crop window, row by row.
std::vector<std::size_t> places_of(const Film& film) {
  std::vector<std::size_t> places;
  for (const std::uint32_t word : film.listed) {
    const glm::uvec2 at = listed_pixel(word);
    places.push_back(std::size_t(at.y - film.crop.y0) * (film.crop.x1 - film.crop.x0) + (at.x - film.crop.x0));
  }
  return places;
}

/// Calls each(name, value) for every float of a film pixel, in a fixed order.
template <class Pixel, class Each>
void each_float(Pixel& p, Each&& each) {
  each("sum.R", p.color.r);
  each("sum.G", p.color.g);
  each("sum.B", p.color.b);
  each("sum.A", p.alpha);
  each("Z", p.z);
  each("N.X", p.normal.x);
  each("N.Y", p.normal.y);
  each("N.Z", p.normal.z);
}

constexpr const char* kMoments[] = {"moment.R", "moment.G", "moment.B"};

/// Throws Error(Work) with the first line in which the texts differ.
void compare(const std::filesystem::path& path, const std::string& found, const std::string& expected) {
  std::istringstream a(found), b(expected);
  std::string x, y;
  while (true) {
    const bool more_a = bool(std::getline(a, x)), more_b = bool(std::getline(b, y));
    if (!more_a && !more_b) return;
    if (!more_a) x.clear();
    if (!more_b) y.clear();
    if (x != y)
      fail(Failure::Work,
           "{}: this checkpoint belongs to another picture: found '{}', expected '{}'; remove it, or give the options "
           "that it was made with",
           path.string(), x, y);
  }
}

/// Returns a channel of a checkpoint. Throws Error(Work) if it is missing or of another type.
const Channel& checked_channel(const std::filesystem::path& path, const Image& image, const char* name, Pixel type) {
  for (const Channel& channel : image.channels)
    if (channel.name == name && channel.type == type) return channel;
  fail(Failure::Work, "{}: is not a checkpoint of Ballot: it has no channel {} of {}; remove it", path.string(), name,
       type == Pixel::Uint ? "unsigned integers" : "floats");
}

float checked_sum(const std::filesystem::path& path, const Channel& channel, std::size_t place) {
  const float sum = channel.floats[place];
  if (std::isnan(sum))
    fail(Failure::Work, "{}: this checkpoint is damaged: channel {} of pixel {} is no number; remove it", path.string(),
         channel.name, place);
  return sum;
}

}  // namespace

void write_film(const std::filesystem::path& path, const Film& film, const std::string& made_of) {
  if (!film.stats.empty()) fail(Failure::Arguments, "a picture with counters cannot be checkpointed");
  Image image{.width = film.crop.x1 - film.crop.x0, .height = film.crop.y1 - film.crop.y0};
  const std::vector<std::size_t> places = places_of(film);
  const std::size_t count = std::size_t(image.width) * image.height;
  const FilmPixel none{};
  each_float(none, [&](const char* name, float) {
    image.channels.push_back({name, Pixel::Float, std::vector<float>(count, 0.0f), {}});
  });
  for (std::size_t i = 0; i < places.size(); ++i) {
    std::size_t c = 0;
    each_float(film.pixels[i], [&](const char*, float value) { image.channels[c++].floats[places[i]] = value; });
  }
  Channel prim{"prim", Pixel::Uint, {}, std::vector<std::uint32_t>(count, NO_HIT)};
  for (std::size_t i = 0; i < places.size(); ++i) prim.uints[places[i]] = film.pixels[i].prim;
  image.channels.push_back(std::move(prim));
  for (int c = 0; c < 3 && !film.moments.empty(); ++c) {
    Channel moment{kMoments[c], Pixel::Float, std::vector<float>(count, 0.0f), {}};
    for (std::size_t i = 0; i < places.size(); ++i) moment.floats[places[i]] = film.moments[i][c];
    image.channels.push_back(std::move(moment));
  }
  image.attributes = {{"film_samples", int(film.samples)}, {"film_made_of", made_of}};
  write_exr(path, image, Links::Replace);
}

void read_film(const std::filesystem::path& path, Film& film, const std::string& made_of, std::uint32_t most) {
  const Image image = read_exr(path);
  const auto samples = image.attributes.find("film_samples"), made = image.attributes.find("film_made_of");
  if (samples == image.attributes.end() || made == image.attributes.end() ||
      !std::holds_alternative<int>(samples->second) || !std::holds_alternative<std::string>(made->second))
    fail(Failure::Work, "{}: is not a checkpoint of Ballot; remove it", path.string());
  compare(path, std::get<std::string>(made->second), made_of);
  const int count = std::get<int>(samples->second);
  if (count < 0 || std::uint32_t(count) > most)
    fail(Failure::Work, "{}: this checkpoint has {} samples; expected 0 to {}; remove it", path.string(), count, most);
  const std::uint32_t width = film.crop.x1 - film.crop.x0, height = film.crop.y1 - film.crop.y0;
  if (image.width != width || image.height != height)
    fail(Failure::Work, "{}: this checkpoint has {} x {} pixels; expected {} x {}; remove it", path.string(),
         image.width, image.height, width, height);
  const std::vector<std::size_t> places = places_of(film);
  std::vector<const Channel*> channels;
  const FilmPixel none{};
  each_float(none,
             [&](const char* name, float) { channels.push_back(&checked_channel(path, image, name, Pixel::Float)); });
  const Channel& prim = checked_channel(path, image, "prim", Pixel::Uint);
  for (std::size_t i = 0; i < places.size(); ++i) {
    std::size_t c = 0;
    each_float(film.pixels[i],
               [&](const char*, float& value) { value = checked_sum(path, *channels[c++], places[i]); });
    film.pixels[i].prim = prim.uints[places[i]];
  }
  for (int c = 0; c < 3 && !film.moments.empty(); ++c) {
    const Channel& moment = checked_channel(path, image, kMoments[c], Pixel::Float);
    for (std::size_t i = 0; i < places.size(); ++i) film.moments[i][c] = checked_sum(path, moment, places[i]);
  }
  film.samples = std::uint32_t(count);
}

}  // namespace ballot
