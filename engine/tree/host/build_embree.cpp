// Builds the tree with rtcBuildBVH of Embree 3 or 4. The sources of its three qualities:
// HIGH    Martin Stich, Heiko Friedrich, Andreas Dietrich. Spatial Splits in Bounding Volume Hierarchies. HPG 2009.
// MEDIUM  Ingo Wald. On fast Construction of SAH-based Bounding Volume Hierarchies. RT 2007.
// LOW     Christian Lauterbach et al. Fast BVH Construction on GPUs. Eurographics 2009.
#if __has_include(<embree4/rtcore.h>)  // CMakeLists.txt prefers it too
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <type_traits>

#include "engine/core/error.h"
#include "engine/core/interruption.h"
#include "engine/core/memory.h"
#include "engine/core/stopwatch.h"
#include "engine/core/tsan.h"
#include "engine/tree/host/build.h"
#include "engine/tree/host/reinsert.h"

namespace ballot {
namespace {

// Depth limits that are given to Embree, from the first to the last. Eight levels before the limit, Embree stops using
// the SAH and splits at medians. If that does not suffice, it builds no tree at all. Then the next limit is tried,
// which is four times the last. The trees of the scenes tried are at most 30 deep; that of triangles in a geometric
// series is 34.
constexpr unsigned kFirstDepth = 48, kLastDepth = 3072;

// Scenes whose box has half a surface below this are built without spatial splits: their areas leave the range of
// float32, and Embree then takes any plane, one that all references lie on one side of included.
constexpr double kLeastArea = 1e-30;

// Leaves of builder `fast` hold up to this many triangles.
constexpr std::uint32_t kMortonLeaf = 4;

struct DeviceRelease {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct BvhRelease {
  void operator()(RTCBVH bvh) const { rtcReleaseBVH(bvh); }
};
using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, DeviceRelease>;
using Memory = std::unique_ptr<std::remove_pointer_t<RTCBVH>, BvhRelease>;

// The state that Embree's callbacks share. The callbacks run on many threads at once. No exception may pass through
// Embree.
struct Job {
  std::span<const Triangle> triangles;
  std::span<const Bounds> boxes;  // either
  const Progress& progress;
  bool keeps_flat = false;
  glm::vec3 thickness{0};  // of the thinnest part that a split may leave, by axis
  std::mutex mutex;        // guards the members below
  double reported = 0;
  std::exception_ptr failure;  // what `progress` or an interruption threw
  std::string message;         // the first error text of Embree
};

Job& job_of(void* user) { return *static_cast<Job*>(user); }

BuildNode* new_node(RTCThreadLocalAllocator allocator) {
  void* memory = rtcThreadLocalAlloc(allocator, sizeof(BuildNode), alignof(BuildNode));
  return memory == nullptr ? nullptr : new (memory) BuildNode;
}

void* create_node(RTCThreadLocalAllocator allocator, unsigned, void* user) {
  const OrderedWork order(user);
  return new_node(allocator);
}

void set_children(void* node, void** children, unsigned, void* user) {
  const OrderedWork order(user);
  if (node == nullptr) return;  // out of memory: Embree has noted the error and returns no tree
  for (const int side : {0, 1}) static_cast<BuildNode*>(node)->child[side] = static_cast<BuildNode*>(children[side]);
}

void set_bounds(void*, const RTCBounds**, unsigned, void*) {}  // flatten() unites the children's boxes

Bounds box_of(const RTCBuildPrimitive& part) {
  return {{part.lower_x, part.lower_y, part.lower_z}, {part.upper_x, part.upper_y, part.upper_z}};
}

// Returns the box without what split() added to it outside of the triangle.
Bounds box_in_leaf(const RTCBuildPrimitive& part, std::span<const Triangle> triangles) {
  const Bounds box = box_of(part);
  if (triangles.empty()) return box;
  const Bounds whole = bounds_of(triangles[part.primID]);
  return {glm::clamp(box.lo, whole.lo, whole.hi), glm::clamp(box.hi, whole.lo, whole.hi)};
}

// Makes a leaf. Spatial splits may put two parts of one triangle into the same leaf; the leaf then holds one reference.
void* create_leaf(RTCThreadLocalAllocator allocator, const RTCBuildPrimitive* parts, std::size_t count, void* user) {
  const OrderedWork order(user);
  BuildNode* leaf = new_node(allocator);
  if (leaf == nullptr) return nullptr;
  for (std::size_t i = 0; i < count; ++i) {
    const Bounds box = box_in_leaf(parts[i], job_of(user).triangles);
    leaf->box = i == 0 ? box : Bounds{glm::min(leaf->box.lo, box.lo), glm::max(leaf->box.hi, box.hi)};
    std::uint32_t* const end = leaf->prims + leaf->count;
    if (std::find(leaf->prims, end, parts[i].primID) == end) leaf->prims[leaf->count++] = parts[i].primID;
  }
  return leaf;
}

RTCBounds to_embree(const Bounds& b) { return {b.lo.x, b.lo.y, b.lo.z, 0, b.hi.x, b.hi.y, b.hi.z, 0}; }

// Returns the thickness that keeps the centre of a part on its side of the plane. Embree numbers sixteen bins by
// float32. So the bin of a centre is off from the plane by up to 2^-22 of the extent of the references and 2^-22 of the
// coordinate. This is twice as much, and the last term is for bins narrower than the normal range of float32.
glm::vec3 least_thickness(const Bounds& scene) {
  const glm::vec3 largest = glm::max(glm::abs(scene.lo), glm::abs(scene.hi));
  return (scene.hi - scene.lo + largest) * 0x1p-21f + 0x1p-140f;
}

// Embree plans a split by its bins, splits what crosses the plane until the room is used up, and then sorts the parts
// by the bins of their centres. It aborts the process if all lie on one side. That happened: slivers at the plane,
// which the bins do not see, took the room, and both parts of each lay on the same side. So each part is made so thick
// that its centre lies on its side, and then one split leaves no side empty.
void split(const RTCBuildPrimitive* part, unsigned axis, float position, RTCBounds* left, RTCBounds* right,
           void* user) {
  const OrderedWork order(user);
  const Job& job = job_of(user);
  const int k = static_cast<int>(axis);
  SplitBoxes boxes = split_reference(job.triangles[part->primID], box_of(*part), k, position);
  boxes.left.lo[k] = std::min(boxes.left.lo[k], position - job.thickness[k]);
  boxes.right.hi[k] = std::max(boxes.right.hi[k], position + job.thickness[k]);
  *left = to_embree(boxes.left);
  *right = to_embree(boxes.right);
}

bool report(void* user, double done) {
  const OrderedWork order(user);
  Job& job = job_of(user);
  const std::lock_guard lock(job.mutex);
  if (job.failure) return false;
  try {
    check_interruption();
    if (!job.progress || !(done > job.reported)) return true;
    job.reported = std::min(done, 1.0);
    job.progress(job.reported);
  } catch (...) {
    job.failure = std::current_exception();
  }
  return !job.failure;
}

void note_error(void* user, RTCError, const char* text) {
  Job& job = job_of(user);
  const std::lock_guard lock(job.mutex);
  if (job.message.empty() && text != nullptr) job.message = text;
}

std::size_t count_proper(std::span<const Triangle> triangles) {
  return static_cast<std::size_t>(
      std::count_if(triangles.begin(), triangles.end(), [](const Triangle& t) { return !is_degenerate(t); }));
}

RTCBuildPrimitive part_of(const Bounds& b, std::size_t prim) {
  return {b.lo.x, b.lo.y, b.lo.z, 0, b.hi.x, b.hi.y, b.hi.z, static_cast<unsigned>(prim)};
}

Bounds box_around(std::span<const RTCBuildPrimitive> parts) {
  Bounds all = box_of(parts[0]);
  for (const RTCBuildPrimitive& part : parts) {
    all.lo = glm::min(all.lo, box_of(part).lo);
    all.hi = glm::max(all.hi, box_of(part).hi);
  }
  return all;
}

void fill(std::vector<RTCBuildPrimitive>& parts, const Job& job) {
  const std::span<const Triangle> triangles = job.triangles;
  std::size_t at = 0;
  for (std::size_t i = 0; i < job.boxes.size(); ++i) parts[at++] = part_of(job.boxes[i], i);
  for (std::size_t prim = 0; prim < triangles.size(); ++prim) {
    if (!job.keeps_flat && is_degenerate(triangles[prim])) continue;
    parts[at++] = part_of(bounds_of(triangles[prim]), prim);
  }
}

RTCBuildQuality quality_of(BuilderId builder) {
  switch (builder) {
    case BuilderId::Balanced:
      return RTC_BUILD_QUALITY_MEDIUM;
    case BuilderId::Fast:
      return RTC_BUILD_QUALITY_LOW;
    default:
      return RTC_BUILD_QUALITY_HIGH;
  }
}

RTCBuildArguments arguments(const BuildSettings& settings, Job& job) {
  RTCBuildArguments args = rtcDefaultBuildArguments();
  args.buildQuality = quality_of(settings.builder);
  args.maxBranchingFactor = 2;
  // The Morton builder knows no costs: it splits down to the smallest leaf allowed.
  args.minLeafSize = settings.builder == BuilderId::Fast ? std::min(kMortonLeaf, settings.max_leaf) : 1;
  args.maxLeafSize = settings.max_leaf;
  args.traversalCost = settings.traversal_cost;
  args.intersectionCost = settings.intersection_cost;
  args.createNode = create_node;
  args.setNodeChildren = set_children;
  args.setNodeBounds = set_bounds;
  args.createLeaf = create_leaf;
  if (builder_of(settings.builder).splits) args.splitPrimitive = split;
  args.buildProgress = report;
  args.userPtr = &job;
  return args;
}

// Builds the tree in `memory`. Embree overwrites the array of parts, so every attempt fills it again.
const BuildNode* build_tree(RTCDevice device, RTCBVH memory, std::size_t count, const BuildSettings& settings,
                            Job& job) {
  // Without spare room in the array Embree makes no spatial splits and reports no error.
  const double splits = builder_of(settings.builder).splits ? double{settings.split_budget} : 0;
  const auto spare = static_cast<std::size_t>(static_cast<double>(count) * splits);
  std::vector<RTCBuildPrimitive> parts(count + spare);
  RTCBuildArguments args = arguments(settings, job);
  args.bvh = memory;
  args.primitives = parts.data();
  args.primitiveCount = count;
  args.primitiveArrayCapacity = parts.size();
  RTCError code = RTC_ERROR_NONE;
  for (unsigned depth = kFirstDepth; depth <= kLastDepth; depth *= 4) {
    fill(parts, job);
    const Bounds scene = box_around(std::span(parts).first(count));
    job.thickness = least_thickness(scene);
    if (half_area(scene.lo, scene.hi) < kLeastArea) args.splitPrimitive = nullptr;
    args.maxDepth = depth;
    { const OrderedWork before(&job); }
    const void* root = rtcBuildBVH(&args);
    { const OrderedWork after(&job); }
    if (job.failure) std::rethrow_exception(job.failure);
    code = rtcGetDeviceError(device);
    if (root != nullptr && code == RTC_ERROR_NONE) return static_cast<const BuildNode*>(root);
    if (code == RTC_ERROR_OUT_OF_MEMORY) throw std::bad_alloc();
    if (code != RTC_ERROR_UNKNOWN) break;
  }
  fail(Failure::Work, "bvh: Embree could not build a tree of {} {}: error {} ({})", count,
       job.boxes.empty() ? "triangles" : "boxes", static_cast<int>(code), job.message);
}

Bvh build(std::span<const Triangle> triangles, std::span<const Bounds> boxes, std::size_t count,
          const BuildSettings& settings, const Progress& progress) {
  if (count == 0) return {};
  Job job{triangles, boxes, progress, settings.keeps_flat, {}, {}, 0, {}, {}};
  const Device device(rtcNewDevice(nullptr));
  if (!device) {
    const RTCError error = rtcGetDeviceError(nullptr);
    fail(Failure::Work, "bvh: Embree cannot start: {}",
         error == RTC_ERROR_OUT_OF_MEMORY ? "out of memory; use a smaller scene or a machine with more"
                                          : fmt::format("its error {}", int(error)));
  }
  rtcSetDeviceErrorFunction(device.get(), note_error, &job);
  const Memory memory(rtcNewBVH(device.get()));
  if (!memory) throw std::bad_alloc();
  return flatten(build_tree(device.get(), memory.get(), count, settings, job), settings);
}

}  // namespace

void check_settings(const BuildSettings& s) {
  const auto positive = [](float x) { return std::isfinite(x) && x > 0; };
  if (s.max_leaf < 1 || s.max_leaf > MAX_LEAF_TRIANGLES)
    fail(Failure::Arguments, "bvh: max_leaf is {} (--max-leaf), but a leaf holds 1 to {} triangles", s.max_leaf,
         MAX_LEAF_TRIANGLES);
  if (!(s.split_budget >= 0 && s.split_budget <= 16))
    fail(Failure::Arguments, "bvh: split_budget is {} (--split-budget), but must lie between 0 and 16", s.split_budget);
  if (!positive(s.traversal_cost) || !positive(s.intersection_cost))
    fail(Failure::Arguments, "bvh: traversal_cost {} and intersection_cost {} must be positive", s.traversal_cost,
         s.intersection_cost);
}

// Embree aborts the process if a box is inverted or holds a NaN. So every vertex is checked before the build.
void check_triangles(std::span<const Triangle> triangles) {
  if (triangles.size() > std::size_t{1} << 31)
    fail(Failure::Work, "bvh: {} triangles, but at most 2^31 can be numbered", triangles.size());
  constexpr std::uint64_t kBuildBytes = 300;  // a triangle, measured on 10^6 of them
  need_memory(triangles.size() * kBuildBytes, fmt::format("a BVH of {} triangles", triangles.size()));
  for (std::size_t i = 0; i < triangles.size(); ++i)
    for (const glm::vec3& v : triangles[i])
      for (int axis = 0; axis < 3; ++axis)
        if (!(std::abs(v[axis]) <= kLargestVertex))
          fail(Failure::Work,
               "bvh: triangle {}: coordinate {} of a vertex is {}, expected a finite value within +-{:g}; scale the "
               "scene",
               i, "xyz"[axis], v[axis], kLargestVertex);
}

Bvh build_bvh(std::span<const Triangle> triangles, const BuildSettings& asked, const Progress& progress) {
  BuildSettings settings = asked;
  settings.builder = choose_builder(asked.builder, {.triangles = triangles.size()});
  const Timer timer;
  check_settings(settings);
  if (builder_of(settings.builder).on_device)
    fail(Failure::Arguments,
         "bvh: builder '{}' runs on a Vulkan device, but none is at hand; use one of the others: {}",
         builder_of(settings.builder).name, names_of(kBuilders));
  check_triangles(triangles);
  const std::size_t proper = settings.keeps_flat ? triangles.size() : count_proper(triangles);
  Bvh bvh;
  try {
    bvh = build(triangles, {}, proper, settings, progress);
    if (builder_of(settings.builder).reinserts) bvh = reinsert_subtrees(std::move(bvh), settings);
  } catch (const std::bad_alloc&) {
    fail(Failure::Work,
         "bvh: out of memory while building a tree of {} triangles; a smaller split_budget (now {}) needs less", proper,
         settings.split_budget);
  }
  bvh.stats.triangles = static_cast<std::uint32_t>(triangles.size());
  bvh.stats.degenerate = static_cast<std::uint32_t>(triangles.size() - proper);
  bvh.stats.builder = settings.builder;
  bvh.stats.build_s = timer.seconds();
  if (progress) progress(1);
  return bvh;
}

Bvh build_box_bvh(std::span<const Bounds> boxes) {
  try {
    return build({}, boxes, boxes.size(), {.max_leaf = 1, .builder = BuilderId::Balanced}, {});
  } catch (const std::bad_alloc&) {
    fail(Failure::Work, "bvh: out of memory while building a tree of {} instances", boxes.size());
  }
}

}  // namespace ballot
