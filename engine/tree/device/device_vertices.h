// Vertices that lie on the device already, where a shader or another program has written them.
#pragma once

#include <memory>
#include <string>

#include "engine/gpu/buffer.h"
#include "engine/tree/host/instance.h"

namespace ballot {

/// Vertices in a buffer, three float32 each. Whoever has this keeps the buffer. What writes the vertices must have
/// ended, or be recorded in the buffer's Context, when they are used; they must stay as they are during the call.
struct DeviceVertices {
  std::shared_ptr<const RawBuffer> buffer = {};  // with Access::Storage
  std::uint64_t offset = 0;                      // of the first, bytes; a multiple of 4
  std::uint64_t stride = sizeof(glm::vec3);      // bytes from one to the next; a multiple of 4, at least 12
  std::uint64_t count = 0;

  /// Returns the byte behind the last vertex.
  std::uint64_t end() const { return count ? offset + (count - 1) * stride + sizeof(glm::vec3) : offset; }
};

/// Throws Error(Arguments), which begins with `where`, unless kernels of a context can read the vertices: the buffer is
/// of this context and large enough, offset and stride are as above.
void check_there(const DeviceVertices& vertices, const Context& gpu, const std::string& where);

/// Returns vertices [first, first + count), read back. Waits for the device.
std::vector<glm::vec3> read_vertices(const DeviceVertices& vertices, std::size_t first, std::size_t count);
inline std::vector<glm::vec3> read_vertices(const DeviceVertices& vertices) {
  return read_vertices(vertices, 0, vertices.count);
}

}  // namespace ballot
