// The headers of PLY files: their elements and properties. Internal to engine/files.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ballot {

/// How the data of a PLY file are written.
enum class PlyCoding { Text, Little, Big };

/// A type of numbers.
struct PlyType {
  std::string_view name, other_name;
  std::size_t bytes;
  double (*read)(const unsigned char*);  // of the host's byte order
};

/// A property of an element: a number or a list.
struct PlyProperty {
  std::string name;
  const PlyType* count = nullptr;  // of a list; null: one number
  const PlyType* type = nullptr;
};

/// An element, such as vertex, with its properties in the order of the file.
struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  /// Returns the index of a property, if the element has it.
  std::optional<std::size_t> find(std::string_view wanted) const {
    const auto found = std::ranges::find(properties, wanted, &PlyProperty::name);
    return found == properties.end() ? std::nullopt : std::optional(std::size_t(found - properties.begin()));
  }
};

/// What the header of a PLY file says.
struct PlyHeader {
  PlyCoding coding = PlyCoding::Text;
  std::vector<PlyElement> elements;
  std::size_t bytes = 0;  // where the data begin
  std::size_t lines = 0;
};

/// Parses the header at the start of a file. Throws Flaw that names the line.
PlyHeader read_ply_header(std::string_view file);

}  // namespace ballot
