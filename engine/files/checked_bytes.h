// Bytes of a scene file that are read only within their bounds. Internal to engine/files.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace ballot {

/// A row of `size()` elements in memory, `stride` bytes apart. Every range of a file's data is made by one of the
/// functions below, which check it. A row is valid as long as the memory that it was made of.
class CheckedBytes {
 public:
  /// Makes a row without elements.
  CheckedBytes() = default;
  /// Makes a row of single bytes. `name`, such as "buffer 0", is for error messages.
  CheckedBytes(std::span<const unsigned char> bytes, std::string name);

  /// Returns `count` bytes from byte `offset` on. For rows of single bytes.
  /// Throws Flaw that names the part, the range and the number of bytes here.
  CheckedBytes part(std::size_t offset, std::size_t count, std::string name) const;

  /// Returns `count` elements of `element_bytes` > 0, the first at byte `offset`, `stride` bytes apart. For rows of
  /// single bytes.
  /// Throws Flaw that names the elements, their number and the number that these bytes hold.
  CheckedBytes elements(std::size_t offset, std::size_t count, std::size_t element_bytes, std::size_t stride,
                        std::string name) const;

  std::size_t size() const { return count_; }
  std::size_t stride() const { return stride_; }
  std::size_t element_bytes() const { return element_bytes_; }

  /// Returns the bytes of element i. Throws Flaw if there is none.
  const unsigned char* operator[](std::size_t i) const {
    if (i >= count_) no_element(i);
    return data_ + i * stride_;
  }

  /// Returns all bytes, from the first element's to the last element's.
  std::span<const unsigned char> bytes() const {
    return {data_, count_ == 0 ? 0 : (count_ - 1) * stride_ + element_bytes_};
  }

 private:
  [[noreturn]] void no_element(std::size_t i) const;

  const unsigned char* data_ = nullptr;
  std::size_t count_ = 0, element_bytes_ = 1, stride_ = 1;
  std::string name_;
};

}  // namespace ballot
