// The files in a zip file, such as NumPy's .npz. Internal to the readers of arrays.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace ballot {

/// A zip file of less than 4 GiB, read as APPNOTE.TXT of PKWARE describes it: entries that are stored or deflated, and
/// not encrypted. Errors throw Error(Work) "cannot read PATH: reason".
class ZipFile {
 public:
  /// Reads the file and its list of entries.
  explicit ZipFile(const std::filesystem::path& path);

  /// Returns the names of the entries, in the order of the list.
  std::vector<std::string> names() const;

  /// Returns the bytes of an entry. Throws if there is none of this name, if it does not fit into memory (memory.h), or
  /// if its bytes do not have the length and the checksum that the list gives.
  std::vector<std::byte> read(const std::string& name) const;

 private:
  struct Entry {
    std::string name;
    std::uint32_t method, flags, checksum, packed, size, place;
  };
  void read_list();
  std::uint32_t number(std::size_t at, std::size_t bytes) const;
  [[noreturn]] void stop(const std::string& reason) const;

  std::filesystem::path path_;
  std::vector<std::byte> bytes_;
  std::vector<Entry> entries_;
};

}  // namespace ballot
