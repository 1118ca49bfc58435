#include "tools/program/picture_size.h"

#include <charconv>

#include "engine/scene/device_scene.h"

namespace ballot::cli {

void parse_size(const std::string& text, std::uint32_t& width, std::uint32_t& height) {
  const char* end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, width);
  if (first.ec == std::errc() && first.ptr != end && *first.ptr == 'x') {
    const auto second = std::from_chars(first.ptr + 1, end, height);
    if (second.ec == std::errc() && second.ptr == end) return;
  }
  fail(Failure::Arguments, "--size: '{}' is not of the form WIDTHxHEIGHT, such as 1024x1024", text);
}

}  // namespace ballot::cli
