#include "engine/files/checked_bytes.h"

#include <utility>

#include "engine/files/flaw.h"

namespace ballot {

CheckedBytes::CheckedBytes(std::span<const unsigned char> bytes, std::string name)
    : data_(bytes.data()), count_(bytes.size()), name_(std::move(name)) {}

CheckedBytes CheckedBytes::part(std::size_t offset, std::size_t count, std::string name) const {
  if (offset > count_ || count > count_ - offset)
    refuse("{} spans {} bytes from byte {}, but {} has {}; export it again", name, count, offset, name_, count_);
  CheckedBytes part = *this;
  part.data_ = count == 0 ? nullptr : data_ + offset;
  part.count_ = count;
  part.name_ = std::move(name);
  return part;
}

CheckedBytes CheckedBytes::elements(std::size_t offset, std::size_t count, std::size_t element_bytes,
                                    std::size_t stride, std::string name) const {
  if (stride < element_bytes)
    refuse("{} has a byteStride of {}, but an element of {} takes {} bytes", name_, stride, name, element_bytes);
  // The last element ends at offset + (count - 1) * stride + element_bytes. Solving for count avoids an overflow.
  const std::size_t room = offset < count_ ? count_ - offset : 0;
  const std::size_t most = room < element_bytes ? 0 : (room - element_bytes) / stride + 1;
  if (count > most)
    refuse("{} has {} elements, but {} ({} bytes) holds {} from byte {}; export it again", name, count, name_, count_,
           most, offset);
  CheckedBytes row = *this;
  row.data_ = count == 0 ? nullptr : data_ + offset;
  row.count_ = count;
  row.element_bytes_ = element_bytes;
  row.stride_ = stride;
  row.name_ = std::move(name);
  return row;
}

void CheckedBytes::no_element(std::size_t i) const {
  refuse("{} has {} elements, but element {} is asked for; export it again", name_, count_, i);
}

}  // namespace ballot
