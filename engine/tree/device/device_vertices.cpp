#include "engine/tree/device/device_vertices.h"

#include "engine/core/error.h"
#include "engine/core/parallel.h"

namespace ballot {

void check_there(const DeviceVertices& v, const Context& gpu, const std::string& where) {
  constexpr std::uint64_t kVertex = sizeof(glm::vec3), kWord = sizeof(float);
  if (!v.buffer || !v.buffer->context())
    fail(Failure::Arguments,
         "{}: the array of its vertices on the device is freed; give one that lives until the commit", where);
  const RawBuffer& b = *v.buffer;
  if (b.context() != &gpu)
    fail(Failure::Arguments,
         "{}: array '{}' of vertices lies on {}, as another Device has opened it; make it on the scene's Device", where,
         b.name(), b.context()->info().name);
  if (!has(b.access(), Access::Storage))
    fail(Failure::Arguments, "{}: kernels cannot read array '{}'; make it with Access::Storage", where, b.name());
  if (v.stride < kVertex || v.stride % kWord)
    fail(Failure::Arguments, "{}: the stride of vertices is {} bytes; expected a multiple of {}, at least {}", where,
         v.stride, kWord, kVertex);
  if (v.offset % kWord)
    fail(Failure::Arguments, "{}: the vertices begin at byte {}; expected a multiple of {}", where, v.offset, kWord);
  const std::uint64_t room = v.offset <= b.bytes() ? b.bytes() - v.offset : 0;
  const std::uint64_t most = room < kVertex ? 0 : (room - kVertex) / v.stride + 1;
  if (v.count > most)
    fail(Failure::Arguments,
         "{}: array '{}' of {} bytes has room for {} vertices, {} bytes apart, from byte {}; expected {}", where,
         b.name(), b.bytes(), most, v.stride, v.offset, v.count);
}

std::vector<glm::vec3> read_vertices(const DeviceVertices& v, std::size_t first, std::size_t count) {
  std::vector<glm::vec3> read(count);
  if (count == 0) return read;
  const std::uint64_t begin = v.offset + first * v.stride;
  if (v.stride == sizeof(glm::vec3)) {
    v.buffer->download(begin, read.data(), count * sizeof(glm::vec3));
    return read;
  }
  std::vector<std::byte> bytes((count - 1) * v.stride + sizeof(glm::vec3));
  v.buffer->download(begin, bytes.data(), bytes.size());
  for_chunks(count, 1 << 16, [&](std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) std::memcpy(&read[i], bytes.data() + i * v.stride, sizeof(glm::vec3));
  });
  return read;
}

}  // namespace ballot
