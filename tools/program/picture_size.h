#pragma once

#include <cstdint>
#include <string>

namespace ballot::cli {

/// Parses a size such as "512x512" into width and height, in pixels. Throws Error(Arguments).
void parse_size(const std::string& text, std::uint32_t& width, std::uint32_t& height);

}  // namespace ballot::cli
