// Records passes, submits many of them together and measures their times.
#include <algorithm>

#include "engine/core/error.h"
#include "engine/gpu/context.h"

namespace ballot {

namespace {

constexpr std::uint32_t kPasses = 255;  // at most in one submission
constexpr std::size_t kInFlight = 2;    // submissions

/// Records a barrier that makes all writes so far visible to all later commands and to the host.
void full_barrier(const Vulkan& vk, VkCommandBuffer cmd) {
  VkMemoryBarrier barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
  barrier.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
  barrier.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT | VK_ACCESS_HOST_READ_BIT;
  vk.CmdPipelineBarrier(cmd, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT,
                        VK_PIPELINE_STAGE_ALL_COMMANDS_BIT | VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &barrier, 0, nullptr, 0,
                        nullptr);
}

}  // namespace

void Context::create_slot(Slot& slot) {
  VkCommandPoolCreateInfo pool{};
  pool.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
  pool.queueFamilyIndex = queue_family_;
  vk_check(vk_.CreateCommandPool(device_, &pool, nullptr, &slot.pool), "creating a command pool");
  VkCommandBufferAllocateInfo allocate{};
  allocate.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
  allocate.commandPool = slot.pool;
  allocate.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  allocate.commandBufferCount = 1;
  vk_check(vk_.AllocateCommandBuffers(device_, &allocate, &slot.commands), "allocating a command buffer");
  VkFenceCreateInfo fence{};
  fence.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
  vk_check(vk_.CreateFence(device_, &fence, nullptr, &slot.fence), "creating a fence");
  if (!queue_times()) return;
  VkQueryPoolCreateInfo queries{};
  queries.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO;
  queries.queryType = VK_QUERY_TYPE_TIMESTAMP;
  queries.queryCount = kPasses + 1;
  vk_check(vk_.CreateQueryPool(device_, &queries, nullptr, &slot.queries), "creating a query pool");
}

void Context::destroy_slot(Slot& slot) {
  vk_.DestroyQueryPool(device_, slot.queries, nullptr);
  vk_.DestroyFence(device_, slot.fence, nullptr);
  vk_.DestroyCommandPool(device_, slot.pool, nullptr);
}

Context::Slot& Context::open_slot(const std::string& what) {
  expect_device();
  Slot& slot = slots_[slot_];
  if (slot.under_way) wait(slot.submission);
  slot.what = what;
  if (slot.open) return slot;
  vk_check(vk_.ResetCommandPool(device_, slot.pool, 0), "resetting commands for", what.c_str());
  VkCommandBufferBeginInfo begin{};
  begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  vk_check(vk_.BeginCommandBuffer(slot.commands, &begin), "recording", what.c_str());
  if (slot.queries) {
    vk_.CmdResetQueryPool(slot.commands, slot.queries, 0, kPasses + 1);
    vk_.CmdWriteTimestamp(slot.commands, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, slot.queries, 0);
  }
  slot.passes.clear();
  slot.names.clear();
  slot.open = true;
  return slot;
}

void Context::end_pass(Slot& slot, Done done) {
  Commands(vk_, slot.commands).barrier();
  slot.passes.push_back(std::move(done));
  slot.names.push_back(slot.what);
  if (slot.queries)
    vk_.CmdWriteTimestamp(slot.commands, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, slot.queries,
                          std::uint32_t(slot.passes.size()));
}

void Context::pass(const std::string& what, const Record& record, Done done) {
  Slot& slot = open_slot(what);
  try {
    Commands commands(vk_, slot.commands);
    record(commands);
  } catch (...) {
    end_pass(slot, {});  // earlier passes stay valid
    throw;
  }
  end_pass(slot, std::move(done));
  if (!batches())
    finish();
  else if (slot.passes.size() == kPasses)
    flush();
}

std::uint64_t Context::flush() {
  Slot& slot = slots_[slot_];
  if (!slot.open) return 0;
  expect_device();
  while (std::size_t(std::ranges::count(slots_, true, &Slot::under_way)) == kInFlight) wait(ended_ + 1);
  // A fence alone makes writes visible neither to the host nor to the next submission.
  full_barrier(vk_, slot.commands);
  slot.open = false;
  vk_check(vk_.EndCommandBuffer(slot.commands), "recording", slot.what.c_str());
  VkSubmitInfo submit{};
  submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
  submit.commandBufferCount = 1;
  submit.pCommandBuffers = &slot.commands;
  slot.start = std::chrono::steady_clock::now();
  check(submit_to_queue(submit, slot.fence), "submitting", passes_of(slot).c_str());
  slot.under_way = true;
  slot.submission = ++submitted_;
  slot_ = (slot_ + 1) % slots_.size();
  return slot.submission;
}

std::vector<double> Context::times_of(Slot& slot) {
  std::vector<double> ms(slot.passes.size());
  if (!slot.queries) {  // every submission is one pass
    const auto wall = std::chrono::steady_clock::now() - slot.start;
    ms.assign(ms.size(), std::chrono::duration<double, std::milli>(wall).count());
    return ms;
  }
  std::vector<std::uint64_t> ticks(ms.size() + 1);
  check(vk_.GetQueryPoolResults(device_, slot.queries, 0, std::uint32_t(ticks.size()), ticks.size() * sizeof ticks[0],
                                ticks.data(), sizeof ticks[0], VK_QUERY_RESULT_64_BIT),
        "reading the times of", passes_of(slot).c_str());
  const std::uint64_t mask = info_.timestamp_bits >= 64 ? ~0ull : (1ull << info_.timestamp_bits) - 1;
  for (std::size_t i = 0; i < ms.size(); ++i)
    ms[i] = double((ticks[i + 1] - ticks[i]) & mask) * info_.timestamp_ns * 1e-6;
  return ms;
}

void Context::end_slot(Slot& slot) {
  check(wait_for(slot.fence), "waiting for", passes_of(slot).c_str());
  const std::vector<double> ms = times_of(slot);
  vk_check(vk_.ResetFences(device_, 1, &slot.fence), "resetting the fence of", slot.what.c_str());
  slot.under_way = false;
  ended_ = slot.submission;
  ended_ms_ = 0;
  const std::vector<Done> passes = std::move(slot.passes);
  for (std::size_t i = 0; i < passes.size(); ++i) {
    ended_ms_ += ms[i];
    if (ms[i] > longest_.ms) longest_ = {std::move(slot.names[i]), ms[i]};
    if (passes[i]) passes[i](ms[i]);
  }
}

void Context::wait(std::uint64_t submission) {
  if (submission > submitted_) flush();
  for (std::size_t i = 0; i < slots_.size(); ++i) {  // oldest first
    Slot& slot = slots_[(slot_ + i) % slots_.size()];
    if (slot.under_way && slot.submission <= submission) end_slot(slot);
  }
}

std::size_t Context::in_flight() {
  std::size_t count = 0;
  for (std::size_t i = 0; i < slots_.size(); ++i) {  // oldest first
    Slot& slot = slots_[(slot_ + i) % slots_.size()];
    if (!slot.under_way) continue;
    const VkResult status = count == 0 ? vk_.GetFenceStatus(device_, slot.fence) : VK_NOT_READY;
    if (status == VK_NOT_READY) {
      ++count;
      continue;
    }
    check(status, "asking for the state of", passes_of(slot).c_str());
    end_slot(slot);
  }
  return count;
}

bool Context::has_ended(std::uint64_t submission) {
  const std::size_t under_way = in_flight();
  if (submission > submitted_ && !has_recorded()) return under_way == 0;
  if (submission > submitted_ && under_way < kInFlight) flush();
  return submission <= ended_;
}

void Context::finish() {
  expect_device();
  flush();
  wait(submitted_);
}

void Context::wait_idle(const char* what) const { vk_check(vk_.DeviceWaitIdle(device_), what); }

void Context::abandon() noexcept {
  for (Slot& slot : slots_) {
    if (slot.under_way) {
      wait_for(slot.fence);
      vk_.ResetFences(device_, 1, &slot.fence);
      ended_ = std::max(ended_, slot.submission);
    }
    slot.open = slot.under_way = false;
    slot.passes.clear();
  }
}

void Context::submit(const std::string& what, const Record& record) {
  pass(what, record, [this](double ms) { last_ms_ = ms; });
  finish();
}

}  // namespace ballot
