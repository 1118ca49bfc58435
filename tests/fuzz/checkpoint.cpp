// Checkpoints: films on disk.
#include <ImfThreading.h>

#include <cmath>

#include "engine/render/film/film_file.h"
#include "tests/fuzz/fuzz.h"

namespace ballot::fuzz {

namespace {

constexpr const char* kMadeOf = "scene: square\nsize: 4 x 3\n";
constexpr std::uint32_t kMost = 16;  // samples

Film empty_film() { return make_film(4, 3, {0, 0, 4, 3}, {}, true, false); }

std::vector<std::string> checkpoint_seeds() {
  std::vector<std::string> all;
  const std::filesystem::path path = folder() / "film-seed.exr";
  for (const float value : {0.5f, 3.0f}) {
    Film film = empty_film();
    film.samples = 4;
    for (FilmPixel& pixel : film.pixels) pixel.color = {value, value, value}, pixel.alpha = value;
    write_film(path, film, kMadeOf);
    all.push_back(bytes_in(path));
  }
  return all;
}

std::vector<std::string> checkpoint_words() {
  return {"channels",     "chlist", "compression", "dataWindow",      "displayWindow", "box2i", "film_samples",
          "film_made_of", "int",    "string",      "sum.R",           "moment.R",      "prim",  "Z",
          "lineOrder",    "float",  "\x7f\x80",    "\xff\xff\xff\xff"};
}

void read_checkpoint(std::string_view input) {
  Imf::setGlobalThreadCount(0);  // a small picture is read sooner by one thread
  const std::filesystem::path path = put("film.exr", input);
  expect_plain([&] {
    Film film = empty_film();
    read_film(path, film, kMadeOf, kMost);
    if (film.samples > kMost) finding("a film of too many samples", input);
    for (const FilmPixel& pixel : film.pixels)
      if (std::isnan(pixel.color.r)) finding("a film with sums that are no numbers", input);
  });
}

}  // namespace

Target checkpoint_target() {
  return {"checkpoint", Form::Bytes, checkpoint_seeds(), checkpoint_words(), read_checkpoint, 2048};
}

}  // namespace ballot::fuzz
