/* Kernels of the user: GLSL of his that asks a scene, for each index of a run. ballot_c.h includes it. */
#ifndef BALLOT_C_KERNELS_H
#define BALLOT_C_KERNELS_H

#ifndef BALLOT_C_H
#error include ballot/ballot_c.h
#endif

/* What a kernel is called, and how its calls answer. */
typedef struct BallotKernelOptions {
  BALLOT_SIZE(BallotKernelOptions);
  BallotText name BALLOT_ZERO;     /* in messages; NULL: "kernel" */
  BallotText file BALLOT_ZERO;     /* that the text is from, in messages of the compiler; NULL: "kernel.glsl" */
  uint32_t first_line BALLOT_ZERO; /* of the text in its file; 0: 1 */
  BallotText numeric BALLOT_ZERO;  /* mode of nearest() and any(): "watertight", "plain", "fast"; NULL: "watertight" */
} BallotKernelOptions;

/* Makes a kernel of a text for the scenes of a device. The text is GLSL 460 for Vulkan with `void main(uint index)`,
 * which is called for each index of a run, in no order, and which may ask the scene of the run: nearest(), any(),
 * count(), closest(), corner(), place(). shaders/user_kernels.md lists the calls, and hooks that see each hit. What the
 * text reads and writes is declared in it:
 *
 *   readonly buffer Rays { Ray rays[]; };   // an array; without readonly it is written, too
 *   buffer Near { float near[]; };
 *   uniform float reach;                    // a number, the same for all indices
 *
 * An element is float, int or uint, a vector of 2 to 4 of them, a record as Ray, Hit and Nearest, which are BallotRay,
 * BallotHit and BallotNearestPoint, or a struct of the text. They lie side by side: a vec3 takes 12 bytes. Arrays and
 * numbers stand outside of conditional blocks, without layout(). Other names are free, but for those that begin with
 * ballot_.
 *
 * BALLOT_ERROR_ARGUMENT, if the text does not compile, with the messages of the compiler as they are: a line each, that
 * names file and line. options may be NULL. */
BALLOT_API BallotStatus ballot_kernel_create(BallotDevice* device, const char* text, const BallotKernelOptions* options,
                                             BallotKernel** kernel);
/* Destroys a kernel, and what was compiled for it. */
BALLOT_API void ballot_kernel_destroy(BallotKernel* kernel);
/* Returns the text of the kernel's last failed call. */
BALLOT_API const char* ballot_kernel_error(BallotKernel* kernel);

/* An array or number that a kernel's text declares. */
typedef struct BallotInputInfo {
  BALLOT_SIZE(BallotInputInfo);
  char name[64];       /* in the text */
  char type[64];       /* in the text: "vec3", "uint", "Ray" */
  BallotBool is_array; /* 1: an array, 0: a number */
  BallotBool written;  /* 1: an array that is not readonly */
  uint32_t bytes;      /* of the number, or of an element of the array */
} BallotInputInfo;

/* Writes what a kernel's text declares, arrays first, at most `room`, and their number to *count. `infos` may be NULL
 * if room is 0. infos[0].size must be set; the others follow. */
BALLOT_API BallotStatus ballot_kernel_inputs(BallotKernel* kernel, BallotInputInfo* infos, size_t room, size_t* count);

/* What an array or number of a kernel is in a run. */
typedef struct BallotInput {
  BALLOT_SIZE(BallotInput);
  BallotText name BALLOT_ZERO;      /* in the text */
  BallotBuffer* buffer BALLOT_ZERO; /* of an array: whole elements, of any record; one may be several arrays */
  const void* number BALLOT_ZERO;   /* of a number: read before the call returns */
  size_t bytes BALLOT_ZERO;         /* of a number: 4 for each component */
} BallotInput;

/* Calls a kernel's main() for each index below count, at most 2^32 - 1, and returns when all are done. Answers are
 * those of the scene as it was committed last, with the bits of ballot_trace() and the like. inputs has each array and
 * number of the text once; all on one device. The first run on a scene compiles for it what it needs.
 *
 * Query     query may have progress alone; it and times may be NULL. Runs go in launches of about 0.1 s, by the time of
 *           those before, and end between two of them if progress says so. The first ones have few indices. An
 *           invocation that never ends is ended by the system alone: GPUs with a screen are reset after seconds, by
 *           BALLOT_ERROR_WORK, and all calls of the device fail then; others go on for ever.
 * Indices   Beyond the end of an array an index is the kernel's fault. With VK_EXT_pipeline_robustness, and on
 *           lavapipe, what is read there is any number, and nothing is written outside of the array. `ballot info`
 *           lists devices without: they may read and write anything, and may be lost.
 * Loops     lavapipe before Mesa 25 ends loops of an invocation after 65 535 iterations: BALLOT_ERROR_WORK. */
BALLOT_API BallotStatus ballot_kernel_run(BallotKernel* kernel, BallotScene* scene, uint64_t count,
                                          const BallotInput* inputs, size_t input_count, const BallotQuery* query,
                                          BallotTimes* times);

#endif
