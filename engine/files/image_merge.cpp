#include "engine/files/image_merge.h"

#include <cstdio>
#include <map>

#include "engine/core/error.h"

namespace ballot {

namespace {

/// Returns i and n of the attribute "part", "i/n".
std::pair<std::uint32_t, std::uint32_t> tiles_of(const ImagePart& part) {
  const auto found = part.image.attributes.find("part");
  unsigned index = 0, count = 0;
  char rest = 0;
  if (found == part.image.attributes.end() || !std::holds_alternative<std::string>(found->second) ||
      std::sscanf(std::get<std::string>(found->second).c_str(), "%u/%u%c", &index, &count, &rest) != 2 || count < 1 ||
      index >= count)
    fail(Failure::Work, "{}: has no attribute part of the form i/n; expected a picture of ballot render --tiles",
         part.file.string());
  return {index, count};
}

void check_same(const ImagePart& first, const ImagePart& part) {
  const auto stop = [&](const std::string& what) {
    fail(Failure::Arguments, "{} and {} are not parts of one picture: they differ in {}", first.file.string(),
         part.file.string(), what);
  };
  const Image &a = first.image, &b = part.image;
  if (a.width != b.width || a.height != b.height || a.x != b.x || a.y != b.y || a.full_width != b.full_width ||
      a.full_height != b.full_height)
    stop(fmt::format("size or crop window ({}x{} and {}x{} pixels)", a.width, a.height, b.width, b.height));
  if (a.channels.size() != b.channels.size()) stop("their channels");
  for (std::size_t c = 0; c < a.channels.size(); ++c)
    if (a.channels[c].name != b.channels[c].name || a.channels[c].type != b.channels[c].type)
      stop(fmt::format("channel {}", a.channels[c].name));
  // With these arithmetics every method gives the same bits, and method auto may choose a different one for each part.
  const auto numeric = a.attributes.find("numeric");
  const bool same_by_any_method =
      numeric != a.attributes.end() &&
      (numeric->second == Attribute(std::string("watertight")) || numeric->second == Attribute(std::string("exact")));
  for (const auto& [name, value] : a.attributes) {
    if (name == "part" || name == "seconds" || (name == "method" && same_by_any_method)) continue;
    const auto found = b.attributes.find(name);
    if (found == b.attributes.end() || found->second != value) stop(fmt::format("attribute {}", name));
  }
}

}  // namespace

Image merge_parts(const std::vector<ImagePart>& parts, std::uint32_t tile) {
  if (parts.empty()) fail(Failure::Arguments, "there are no parts to merge");
  const std::uint32_t count = tiles_of(parts[0]).second;
  std::map<std::uint32_t, const ImagePart*> by_index;  // a file may claim any number of parts
  float seconds = 0;
  for (const ImagePart& part : parts) {
    const auto [index, of] = tiles_of(part);
    check_same(parts[0], part);
    if (of != count)
      fail(Failure::Arguments, "{} is part {}/{}, but {} is one of {}", part.file.string(), index, of,
           parts[0].file.string(), count);
    const auto [entry, fresh] = by_index.try_emplace(index, &part);
    if (!fresh)
      fail(Failure::Arguments, "part {}/{} is there twice: {} and {}", index, count, entry->second->file.string(),
           part.file.string());
    if (const auto s = part.image.attributes.find("seconds"); s != part.image.attributes.end()) {
      const float* spent = std::get_if<float>(&s->second);
      if (!spent)
        fail(Failure::Work, "{}: its attribute seconds is no float; expected a picture of ballot render --tiles",
             part.file.string());
      seconds += *spent;
    }
  }
  for (std::uint32_t i = 0; i < count; ++i)
    if (!by_index.contains(i))
      fail(Failure::Arguments, "part {}/{} is missing; render it with --tiles {}/{}", i, count, i, count);
  std::vector<const ImagePart*> ordered;
  for (const auto& [index, part] : by_index) ordered.push_back(part);
  Image whole = parts[0].image;
  const std::uint32_t full_width = whole.full_width ? whole.full_width : whole.width;
  const std::uint32_t tiles_x = (full_width + tile - 1) / tile;
  for (std::uint32_t y = 0; y < whole.height; ++y)
    for (std::uint32_t x = 0; x < whole.width; ++x) {
      const Image& from = ordered[((y + whole.y) / tile * tiles_x + (x + whole.x) / tile) % count]->image;
      const std::size_t at = std::size_t(y) * whole.width + x;
      for (std::size_t c = 0; c < whole.channels.size(); ++c)
        if (whole.channels[c].type == Pixel::Uint)
          whole.channels[c].uints[at] = from.channels[c].uints[at];
        else
          whole.channels[c].floats[at] = from.channels[c].floats[at];
    }
  whole.attributes.erase("part");
  whole.attributes["seconds"] = seconds;
  return whole;
}

}  // namespace ballot
