// Buffers that only grow.
#pragma once

#include <memory>

#include "engine/gpu/buffer.h"

namespace ballot {

/// Replaces the buffer if it holds fewer than `count` records; its content is then undefined. Returns true if it was
/// replaced.
template <class T>
bool make_room(std::unique_ptr<Buffer<T>>& buffer, Context& gpu, std::size_t count, const char* name) {
  if (buffer && buffer->size() >= count) return false;
  buffer.reset();
  buffer = std::make_unique<Buffer<T>>(gpu, count, Access::Storage, name);
  return true;
}

/// Returns the buffer, which has room for `count` records.
template <class T>
Buffer<T>& buffer_for(std::unique_ptr<Buffer<T>>& buffer, Context& gpu, std::size_t count, const char* name) {
  make_room(buffer, gpu, count, name);
  return *buffer;
}

}  // namespace ballot
