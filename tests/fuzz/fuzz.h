// The parts that fuzz targets share. A target is a function in a file of its own and a line of targets().
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ballot::fuzz {

/// How inputs are changed: as bytes alone, or also as JSON values, or also as the JSON and the buffer of a glTF file.
enum class Form { Bytes, Json, Gltf };

/// A reader of files from elsewhere.
struct Target {
  const char* name;
  Form form = Form::Bytes;
  std::vector<std::string> seeds;              // inputs to start from, made by code
  std::vector<std::string> words;              // of the format, for the dictionary
  std::function<void(std::string_view)> read;  // reads one input; a fault ends the process
  std::size_t largest = 16384;  // bytes of an input; a picture may take thousands of times its file in memory
};

Target bvh_target();         // the cache of trees
Target cache_target();       // folders of caches
Target checkpoint_target();  // films on disk
Target command_target();     // command lines
Target exr_target();         // pictures, skies and parts of pictures
Target gltf_target();
Target mesh_target();   // PLY and STL
Target npy_target();    // triangles, rays, hits and points
Target obj_target();    // with a material file
Target views_target();  // the JSON of views

/// Returns the names of all targets.
std::vector<std::string> target_names();
/// Returns a target; one without a name if there is none of this name.
Target find_target(std::string_view name);

/// Returns the inputs kept in tests/fuzz/corpus/NAME: files *.hex hold bytes in hexadecimal digits, others their text.
std::vector<std::string> kept_inputs(std::string_view name);

/// Reads an input. A fault ends the process.
void read_input(const Target& target, std::string_view input);

/// Sets what every target needs: a process of more than 2 GiB is refused memory.
void prepare();

/// Writes a file into the folder of this process, which lies in memory where there is /dev/shm. Returns its path.
std::filesystem::path put(const std::string& name, std::string_view content);
/// Returns that folder.
const std::filesystem::path& folder();
/// Returns the bytes of a file.
std::string bytes_in(const std::filesystem::path& path);

/// Runs `call`, which may throw Error(Work) or Error(Arguments). Anything else is a finding and aborts: another
/// exception, or a text that shows one of a library.
void expect_plain(const std::function<void()>& call);

/// Aborts with a text that says what is wrong.
[[noreturn]] void finding(std::string_view what, std::string_view text);

/// Returns true if a text shows a name inside a library, or of its exceptions, that is not in the input.
bool is_raw(std::string_view text);

/// Returns the bytes of values, for seeds.
template <class T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

}  // namespace ballot::fuzz
