#include "engine/gpu/commands.h"

#include "engine/gpu/buffer.h"

namespace ballot {

void Commands::barrier() {
  VkMemoryBarrier barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
  barrier.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
  barrier.dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_READ_BIT |
                          VK_ACCESS_TRANSFER_WRITE_BIT | VK_ACCESS_INDIRECT_COMMAND_READ_BIT |
                          VK_ACCESS_UNIFORM_READ_BIT;
  const VkPipelineStageFlags stages =
      VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT | VK_PIPELINE_STAGE_DRAW_INDIRECT_BIT;
  vk_.CmdPipelineBarrier(handle_, stages, stages, 0, 1, &barrier, 0, nullptr, 0, nullptr);
}

void Commands::fill(const RawBuffer& buffer, std::uint32_t word) { fill(buffer, 0, buffer.bytes(), word); }

void Commands::fill(const RawBuffer& buffer, std::uint64_t offset, std::uint64_t bytes, std::uint32_t word) {
  vk_.CmdFillBuffer(handle_, buffer.handle(), buffer.offset() + offset, bytes, word);
}

void Commands::write(const RawBuffer& buffer, std::uint64_t offset, const void* data, std::uint64_t bytes) {
  vk_.CmdUpdateBuffer(handle_, buffer.handle(), buffer.offset() + offset, bytes, data);
}

void Commands::copy(const RawBuffer& from, const RawBuffer& to, std::uint64_t bytes) {
  const VkBufferCopy region{from.offset(), to.offset(), bytes};
  vk_.CmdCopyBuffer(handle_, from.handle(), to.handle(), 1, &region);
}

}  // namespace ballot
