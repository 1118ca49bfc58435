// An open .npy file: its header, and its items in parts. The format is that of numpy.lib.format, versions 1.0 to 3.0.
// Internal to the readers of arrays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/file.h"

namespace ballot {

inline constexpr std::string_view kNpyMagic = "\x93NUMPY";

/// The contents of a header's dictionary. A dtype is kept as canonical text: "'<f4'", or "[('t', '<f4'), ...]".
struct NpyHeader {
  std::string descr;
  std::optional<bool> fortran_order;
  std::optional<std::vector<std::uint64_t>> shape;
};

/// An open .npy file, positioned behind its header, which has been checked. Errors throw Error(Work) "cannot read PATH:
/// reason".
class NpyFile {
 public:
  /// "-" is standard input, whose length is not known beforehand.
  explicit NpyFile(const std::filesystem::path& path);
  /// Takes the bytes of a file that is part of another one. `name` is for messages.
  NpyFile(std::filesystem::path name, std::vector<std::byte> bytes);

  const NpyHeader& header() const { return header_; }
  /// Returns the dtype and the shape in words, for messages.
  std::string found() const;

  /// Throws unless exactly `count` items of `item_bytes` bytes follow, which are rows of numbers of `number_bytes`.
  /// Of a pipe, read() finds out. An array in Fortran order is then read as a whole, so that its rows follow. Throws if
  /// it does not fit into memory.
  void expect_items(std::uint64_t count, std::uint64_t item_bytes, std::size_t number_bytes);

  /// Reads the next bytes, of a regular file by several threads if they are many.
  void read(void* out, std::size_t bytes);

  /// Skips the next bytes of a regular file.
  void skip(std::uint64_t bytes);

  [[noreturn]] void stop(const std::string& reason) const;

 private:
  void read_header();
  void read_transposed(std::uint64_t bytes, std::size_t number_bytes);

  std::filesystem::path path_;
  InputStream file_{nullptr, nullptr};
  std::vector<std::byte> bytes_;       // instead of file_
  std::optional<std::uint64_t> left_;  // bytes; none: not known, as of a pipe
  std::uint64_t position_ = 0;         // of a regular file or in bytes_
  NpyHeader header_;
};

/// Returns the first bytes of a file of version 1.0, up to its items.
std::string npy_start(std::string_view descr, const std::string& shape);

}  // namespace ballot
