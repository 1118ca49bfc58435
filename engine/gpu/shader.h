// Compiles GLSL to SPIR-V at run time, through a cache that is keyed by content.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace ballot {

/// Preprocessor definitions: name and value.
using Defines = std::vector<std::pair<std::string, int>>;

/// A compiled shader module.
struct Spirv {
  std::vector<std::uint32_t> words;
  bool from_cache = false;
  double ms = 0;  // milliseconds to compile, or to load
};

/// Returns the folder that shaders are read from: $BALLOT_SHADERS, else that of the source tree if the program lies in
/// the tree. Empty: there is none, and the texts inside the program serve.
/// Throws Error(Work) if $BALLOT_SHADERS names a folder without shaders.
std::filesystem::path shader_folder();

/// Kept: a module has the functions and variables of its text. Inlined: functions are inlined, and values that were
/// just stored are not loaded again. A driver does the same; no arithmetic is changed.
enum class Calls { Kept, Inlined };

/// A text of a shader that is no file.
struct GivenText {
  std::string text;   // empty: the file's own
  std::string named;  // what messages call it
};

/// Compiles the shader `file` of shader_folder() for Vulkan 1.2. An #include is relative to the including file. The
/// cache ($XDG_CACHE_HOME/ballot/spirv) is keyed by the texts of the file and all that it includes, by the other
/// arguments, and by the compiler's version.
/// `given`: a text in the place of the file's. Its #includes are relative to `file`, which need not be there.
/// Throws Error(Work) with glslang's message, which names file and line. Thread-safe.
Spirv compile_shader(const std::string& file, const Defines& defines, bool use_cache = true, Calls calls = Calls::Kept,
                     const GivenText& given = {});

/// Returns a text as the compiler sees it behind its preprocessor: without comments, #include and macros, with
/// #version, #extension and #line. Arguments and errors are those of compile_shader().
std::string preprocessed_shader(const std::string& file, const Defines& defines, const GivenText& given = {});

/// Returns the texts of a shader and of all that it may include, each once, with the length of each before it. Throws
/// Error(Work) if there is no such shader.
std::string texts_of(const std::string& file);

/// The interface of a module: its bindings and the size of its push constants.
struct Reflection {
  std::vector<std::uint32_t> storage_buffers;  // bindings of set 0, ascending
  std::vector<std::uint32_t> texel_buffers;
  std::vector<std::uint32_t> uniform_buffers;
  std::map<std::uint32_t, std::uint32_t> element_bytes;  // of storage buffers that are one array, by binding
  std::uint32_t push_bytes = 0;
};
/// Reads the interface of a module. Throws Error(Work) if the module cannot be read or uses a set other than 0.
Reflection reflect(const std::vector<std::uint32_t>& words, const std::string& name);

}  // namespace ballot
