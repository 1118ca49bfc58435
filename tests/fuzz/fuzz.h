// The parts that fuzz targets share. A target is one file fuzz_*.cpp that defines the three functions below.
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

/// Returns the inputs to start from. They are made by code, so that none are kept as binary files.
std::vector<std::string> seeds();
/// Returns words of the format, for libFuzzer's dictionary.
std::vector<std::string> words();
/// Reads one input.
void read(std::string_view input);

/// Writes a file into the folder of this process, which lies in memory where there is /dev/shm. Returns its path.
std::filesystem::path put(const std::string& name, std::string_view content);

/// Runs `call`, which may throw Error(Work) or Error(Arguments). Anything else is a finding and aborts: another
/// exception, or a text that shows one of a library.
void expect_plain(const std::function<void()>& call);

/// Returns the bytes of values, for seeds.
template <class T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

}  // namespace ballot::fuzz
