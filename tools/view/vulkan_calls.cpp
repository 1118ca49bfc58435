// The functions of Vulkan that ImGui's back end for it (imgui_impl_vulkan, in libimgui.a) calls by name. Ballot opens
// the Vulkan loader only when it needs a device, and is not linked to it: each function here calls the one of the
// loader.
#include <boost/preprocessor/repetition/enum.hpp>
#include <boost/preprocessor/repetition/enum_params.hpp>
#include <boost/preprocessor/seq/for_each.hpp>
#include <tuple>

#include "tools/view/overlay.h"

namespace {

template <class Call>
struct Signature;
template <class R, class... A>
struct Signature<R(VKAPI_PTR*)(A...)> {
  using Result = R;
  template <std::size_t i>
  using Argument = std::tuple_element_t<i, std::tuple<A...>>;
};

}  // namespace

#define BALLOT_ARGUMENT(z, i, f) typename Signature<PFN_vk##f>::template Argument<i> a##i
#define BALLOT_CALL(count, f)                                                                                   \
  extern "C" __attribute__((visibility("hidden")))                                                              \
  VKAPI_ATTR Signature<PFN_vk##f>::Result VKAPI_CALL vk##f(BOOST_PP_ENUM(count, BALLOT_ARGUMENT, f)) {          \
    return reinterpret_cast<PFN_vk##f>(ballot::view::vulkan_function("vk" #f))(BOOST_PP_ENUM_PARAMS(count, a)); \
  }
#define BALLOT_NEXT(r, count, f) BALLOT_CALL(count, f)
#define BALLOT_CALLS(count, names) BOOST_PP_SEQ_FOR_EACH(BALLOT_NEXT, count, names)

// By the number of their arguments.
// clang-format off
BALLOT_CALLS(1, (DeviceWaitIdle)(EndCommandBuffer)(QueueWaitIdle))
BALLOT_CALLS(2, (BeginCommandBuffer)(GetPhysicalDeviceMemoryProperties)(GetPhysicalDeviceProperties)(UnmapMemory))
BALLOT_CALLS(3, (AllocateCommandBuffers)(AllocateDescriptorSets)(CmdBindPipeline)(DestroyBuffer)(DestroyCommandPool)
  (DestroyDescriptorPool)(DestroyDescriptorSetLayout)(DestroyFence)(DestroyFramebuffer)(DestroyImage)(DestroyImageView)
  (DestroyPipeline)(DestroyPipelineLayout)(DestroyRenderPass)(DestroySampler)(DestroySemaphore)(DestroyShaderModule)
  (DestroySurfaceKHR)(DestroySwapchainKHR)(FlushMappedMemoryRanges)(FreeMemory)(GetBufferMemoryRequirements)
  (GetImageMemoryRequirements)(GetPhysicalDeviceSurfaceCapabilitiesKHR)(ResetCommandPool))
BALLOT_CALLS(4, (AllocateMemory)(BindBufferMemory)(BindImageMemory)(CmdBindIndexBuffer)(CmdSetScissor)(CmdSetViewport)
  (CreateBuffer)(CreateCommandPool)(CreateDescriptorPool)(CreateDescriptorSetLayout)(CreateFence)(CreateFramebuffer)
  (CreateImage)(CreateImageView)(CreatePipelineLayout)(CreateRenderPass)(CreateSampler)(CreateSemaphore)
  (CreateShaderModule)(CreateSwapchainKHR)(FreeCommandBuffers)(FreeDescriptorSets)(GetDeviceQueue)
  (GetPhysicalDeviceSurfaceFormatsKHR)(GetPhysicalDeviceSurfacePresentModesKHR)(GetSwapchainImagesKHR)(QueueSubmit))
BALLOT_CALLS(5, (CmdBindVertexBuffers)(UpdateDescriptorSets))
BALLOT_CALLS(6, (CmdCopyBufferToImage)(CmdDrawIndexed)(CmdPushConstants)(CreateGraphicsPipelines)(MapMemory))
BALLOT_CALLS(8, (CmdBindDescriptorSets))
BALLOT_CALLS(10, (CmdPipelineBarrier))
