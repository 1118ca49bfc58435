/* Ballot on the Vulkan of a program: its device, and the calls of a scene in its own shaders. ballot_c.h includes it.
 * It needs no header of Vulkan: handles are void*, or 64 bits where Vulkan has no pointer on every machine. */
#ifndef BALLOT_C_VULKAN_H
#define BALLOT_C_VULKAN_H

#ifndef BALLOT_C_H
#error include ballot/ballot_c.h
#endif

/* Something that Ballot needs, or uses where it is enabled, beyond Vulkan 1.2, subgroups of 4 to 128 lanes with vote
 * and ballot in compute, and a queue with compute. */
typedef struct BallotVulkanNeed {
  BALLOT_SIZE(BallotVulkanNeed);
  char name[64];     /* of a feature, as "scalarBlockLayout", or of an extension, as "VK_KHR_external_memory_fd" */
  char of[64];       /* the struct or the extension that has the feature; "" for an extension */
  char without[128]; /* why it is required, or what it costs to go without it */
  BallotBool is_extension; /* 1: an extension, 0: a feature */
  BallotBool required;     /* 1: without it a device is refused */
} BallotVulkanNeed;

/* Writes what a program has to enable, and what it may, at most `room`, and their number to *count. `needs` may be NULL
 * if room is 0. needs[0].size must be set; the others follow. */
BALLOT_API BallotStatus ballot_vulkan_needs(BallotVulkanNeed* needs, size_t room, size_t* count);

/* A program's device: BallotDeviceOptions::vulkan. Ballot makes its objects there and destroys nothing that it did not
 * make. All handles must live until ballot_device_close(), and until what was made on the device is destroyed: before
 * vkDestroyDevice(). Calls submit to the queue, and have waited when they return, but for ballot_submit_buffers(). */
typedef struct BallotVulkan {
  BALLOT_SIZE(BallotVulkan);
  void* instance BALLOT_ZERO;        /* VkInstance */
  void* physical_device BALLOT_ZERO; /* VkPhysicalDevice, one of the instance's */
  void* device BALLOT_ZERO;          /* VkDevice */
  void* queue BALLOT_ZERO;           /* VkQueue, of a family with compute */
  uint32_t queue_family BALLOT_ZERO; /* the queue's */
  uint32_t api_version BALLOT_ZERO;  /* of the program's VkApplicationInfo, at least 1.2; 0: it is */
  /* What is enabled of what ballot_vulkan_needs() lists: names with blanks between them. Vulkan does not tell. Others
   * are not used. NULL: what is required, alone. */
  BallotText enabled BALLOT_ZERO;
  void* get_instance_proc_addr BALLOT_ZERO; /* PFN_vkGetInstanceProcAddr; NULL: that of libvulkan.so.1 */
  /* Holds the queue, and unlock releases it, if other threads of the program use it during calls. Both must not call
   * Ballot. NULL: none does. */
  void (*lock)(void* user) BALLOT_ZERO;
  void (*unlock)(void* user) BALLOT_ZERO; /* goes with lock */
  void* user BALLOT_ZERO;                 /* given to both */
} BallotVulkan;

/* Which calls a shader makes. */
typedef struct BallotIncludeOptions {
  BALLOT_SIZE(BallotIncludeOptions);
  /* Names with blanks between them: of calls, "nearest any count closest corner place", and of hooks that the shader
   * has: "accept intersect is_shape" (shaders/user_kernels.md). */
  BallotText calls BALLOT_ZERO;
  BallotText numeric BALLOT_ZERO; /* mode of nearest() and any(): "watertight", "plain", "fast"; NULL: "watertight" */
  uint32_t set BALLOT_ZERO;       /* number of the descriptor set that the shader has for the scene */
} BallotIncludeOptions;

/* What a shader takes to call a scene. */
typedef struct BallotInclude {
  BALLOT_SIZE(BallotInclude);
  const char* text;    /* GLSL 460 */
  uint64_t set_layout; /* VkDescriptorSetLayout, for stage compute */
  uint64_t set;        /* VkDescriptorSet, with the scene's buffers */
} BallotInclude;

/* Writes what a compute shader of a program takes to call a scene on the program's device. The shader has its version
 * (460) and its own extensions, then the text, then its own declarations and main(). Its pipeline layout has the set
 * layout at the number that was asked for; push constants, specialisation constants, workgroup and other sets are its
 * own. The bits are those of the built-in answers.
 *
 * Names     The text has the calls that were named, Ray, Hit, Nearest and NO_HIT; all others begin with ballot_. Hooks
 *           stand behind it.
 * Validity  Text and handles are the scene's, until it is destroyed or a call with it may change it: a commit, and
 *           after vertices have moved any answer, as a tree that has become slow is built anew then. Ask again after
 *           those: what has not changed is the same. A pipeline fits as long as the text does.
 * Memory    Work of the program that uses the set must have ended before such a call. Behind this call, commands on
 *           Ballot's queue see the scene. On another queue of its family the first of them is a barrier from
 *           VK_ACCESS_MEMORY_WRITE_BIT to VK_ACCESS_SHADER_READ_BIT. Other families do not share the buffers. Shaders
 *           only read them.
 * Loops     lavapipe before Mesa 25 ends loops of an invocation after 65 535 iterations, those of the shader counted.
 *           Then the text's function ballot_is_cut, of no arguments, returns true, and no answer of the invocation is
 *           to be used. */
BALLOT_API BallotStatus ballot_scene_include(BallotScene* scene, const BallotIncludeOptions* options,
                                             BallotInclude* include);

#endif
