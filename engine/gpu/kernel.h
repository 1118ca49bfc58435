// A kernel: a compute pipeline and the buffers that are bound to it.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/pipeline.h"

namespace ballot {

/// Returns how many workgroups of a size it takes for `count` invocations.
constexpr std::uint32_t groups_of(std::uint32_t count, std::uint32_t size) {
  return count / size + (count % size != 0);
}

/// A compute pipeline with its bindings, ready to be dispatched. Not thread-safe.
class Kernel {
 public:
  /// Compiles the kernel or takes it from the cache. On any failure throws Error(Work) that names the variant.
  Kernel(Context& gpu, const KernelSource& source);
  ~Kernel();
  Kernel(const Kernel&) = delete;
  Kernel& operator=(const Kernel&) = delete;

  /// Binds a buffer for all dispatches recorded from now on, as the type that the shader declares. Texel buffers are
  /// bound whole. Throws Error(Work) if the shader has no such binding.
  void bind(std::uint32_t binding, const BufferPart& part);
  /// True if the shader has this binding.
  bool wants(std::uint32_t binding) const;

  /// Records a dispatch. Throws Error(Work) if a binding has no buffer, the device does not allow so many workgroups,
  /// or the size of the push constants is not the shader's.
  void dispatch(Commands& cmd, std::uint32_t groups, const void* push, std::uint32_t push_bytes);
  template <class P>
  void dispatch(Commands& cmd, std::uint32_t groups, const P& push) {
    dispatch(cmd, groups, &push, sizeof push);
  }
  /// Records an indirect dispatch: the device reads the numbers of workgroups (x, y, z) at `offset` bytes in a buffer
  /// with Access::Indirect.
  void dispatch(Commands& cmd, const RawBuffer& groups, std::uint64_t offset, const void* push,
                std::uint32_t push_bytes);

  /// Returns Vulkan's handles of the layout of the kernel's set, and of a set of what is bound, for commands that are
  /// not this kernel's. They stay as they are until something else is bound, and go with the kernel.
  std::pair<std::uint64_t, std::uint64_t> descriptors();

  /// Returns the bytes of an element of each storage buffer that is one array, by binding.
  const std::map<std::uint32_t, std::uint32_t>& element_bytes() const { return pipeline_->reflection().element_bytes; }

  const std::string& name() const { return name_; }
  /// The times that making its pipeline took.
  const KernelTimes& times() const { return pipeline_->times(); }
  std::vector<PipelineFigure> statistics() const { return pipeline_->statistics(); }
  /// The Context's shader_generation() when this kernel was made.
  std::uint64_t generation() const { return generation_; }

 private:
  /// A buffer, or a part of one, that is bound.
  struct Bound {
    std::uint64_t id = 0;  // id of the buffer; 0: none
    VkBuffer buffer = VK_NULL_HANDLE;
    std::uint64_t offset = 0, bytes = 0;  // of the buffer's bytes
    VkBufferView view = VK_NULL_HANDLE;
  };
  /// What tells bound buffers apart: id, offset and bytes.
  using Name = std::array<std::uint64_t, 3>;
  /// A descriptor set. It is not changed while a submission that uses it has not ended.
  struct Set {
    VkDescriptorPool pool = VK_NULL_HANDLE;
    VkDescriptorSet set = VK_NULL_HANDLE;
    std::vector<Name> names;  // of the buffers, in the order of the bindings
    std::uint64_t used = 0;   // the last submission that uses it
  };

  Set create_set();
  void write(const Set& set) const;
  VkDescriptorSet set_for_bound();
  void begin_dispatch(Commands& cmd, const void* push, std::uint32_t push_bytes);
  void end_dispatch(Commands& cmd) const;

  Context& gpu_;
  friend bool refresh(Context& gpu, std::unique_ptr<Kernel>& kernel, const KernelSource& source);

  std::string name_;
  std::uint64_t generation_;
  std::shared_ptr<const ComputePipeline> pipeline_;
  std::map<std::uint32_t, Bound> bound_;
  std::vector<Set> sets_;
};

/// Makes a kernel if there is none or the shaders were reloaded since it was made. Returns true if it made one, which
/// has no buffers bound yet. If a kernel fails to compile again, the old one is kept and Context::shader_error() tells
/// why. If there is no old one, throws Error(Work).
bool refresh(Context& gpu, std::unique_ptr<Kernel>& kernel, const KernelSource& source);

}  // namespace ballot
