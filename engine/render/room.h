// Buffers that only grow.
#pragma once

#include <memory>

#include "engine/vk/buffer.h"

namespace ballot {

/// Makes the buffer anew if it holds fewer than `count`; its content is then undefined. True: it is another one.
template <class T>
bool make_room(std::unique_ptr<Buffer<T>>& buffer, Context& gpu, std::size_t count, const char* name) {
  if (buffer && buffer->size() >= count) return false;
  buffer.reset();
  buffer = std::make_unique<Buffer<T>>(gpu, count, Access::Storage, name);
  return true;
}

}  // namespace ballot
