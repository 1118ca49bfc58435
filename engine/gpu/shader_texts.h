// The texts of the shaders inside the program, for libraries that are installed without a folder of shaders.
#pragma once

#include <cstddef>
#include <string_view>

namespace ballot {

struct ShaderText {
  std::string_view file;  // relative to the folder of the shaders
  std::string_view text;
};

/// All shaders; tools/embed_shaders.cmake writes the table.
extern const ShaderText kShaderTexts[];
extern const std::size_t kShaderTextCount;

}  // namespace ballot
