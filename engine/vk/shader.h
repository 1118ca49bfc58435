// GLSL to SPIR-V at run time, through a cache keyed by content.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace ballot {

using Defines = std::vector<std::pair<std::string, int>>;

struct Spirv {
  std::vector<std::uint32_t> words;
  bool from_cache = false;
  double ms = 0;  // time to preprocess and compile, or to preprocess and load
};

/// The folder that shaders are read from: $BALLOT_SHADERS, else ../share/ballot/shaders beside the program (installed
/// or bundled), else the source tree that the program was built from. Throws Error(Work) that lists what was tried.
std::filesystem::path shader_folder();

/// Compiles shader_folder()/file, Vulkan 1.2, with #include relative to the including file. The cache
/// ($XDG_CACHE_HOME/ballot/spirv) is keyed by the preprocessed text, the defines and the compiler's version.
/// Throws Error(Work) with glslang's message, which names file and line. Not thread-safe.
Spirv compile_shader(const std::string& file, const Defines& defines, bool use_cache = true);

/// What a module wants bound. Throws Error(Work) if it cannot be read.
struct Reflection {
  std::vector<std::uint32_t> storage_buffers;  // bindings of set 0, ascending
  std::vector<std::uint32_t> texel_buffers;
  std::uint32_t push_bytes = 0;
};
Reflection reflect(const std::vector<std::uint32_t>& words, const std::string& name);

}  // namespace ballot
