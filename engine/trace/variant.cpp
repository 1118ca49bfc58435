#include "engine/trace/variant.h"

#include <algorithm>

#include "engine/core/error.h"

namespace ballot {

std::string Variant::kernel_name() const {
  constexpr const char* kCameras[] = {"", ".perspective", ".orthographic"};
  return fmt::format("{}.{}.{}{}{}{} [{}]", method->name, want == Want::Any ? "any" : "nearest", numeric->name,
                     counters ? ".counters" : "", indirect ? ".indirect" : "", kCameras[int(camera)],
                     describe(how, *method));
}

std::string Variant::name() const {
  const std::string threshold = describe_threshold(how, *method);
  return threshold.empty() ? kernel_name() : kernel_name() + " " + threshold;
}

std::uint32_t stack_entries(const TreeFacts& tree, std::uint32_t pushed) {
  return (tree.depth * pushed + 1 + 15) / 16 * 16;
}

KernelSource kernel_source(const Variant& variant, const DeviceInfo& device, const TreeFacts& tree) {
  const KernelConfig& f = variant.how;
  const Method& method = *variant.method;
  const bool packet = method.packet(), wide = method.wide;
  const std::uint32_t stack = stack_entries(tree, method.quads ? BVH4_CHILDREN - 1 : 1);
  const std::uint32_t list = method.lists ? f.list : 0;
  std::uint32_t shared_words = 0;
  const bool own_stack = method.own_stack && (!wide || f.fallback);
  if (own_stack && f.stack == StackPlace::Shared) shared_words = (stack + list) * f.workgroup;
  if (method.shares_stack() && f.packet_stack == PacketStack::Shared)
    shared_words += stack * (f.workgroup / f.subgroup);
  if (packet && f.vote == Vote::Sum) shared_words += f.workgroup;
  if (std::uint64_t(shared_words) * 4 > device.shared_bytes)
    fail(Failure::Work,
         "{}: the stacks of a tree of depth {} need {} bytes of shared memory at workgroup={}, but {} has {}; use a "
         "smaller "
         "--knob workgroup, or --knob stack=private",
         variant.name(), tree.depth, std::uint64_t(shared_words) * 4, f.workgroup, device.name, device.shared_bytes);
  KernelSource source;
  source.name = variant.kernel_name() + (wide || leaves_loop(tree) ? "" : " leaves=1") + (tree.far ? " far=1" : "");
  source.file = variant.method->kernel;
  source.group_size = f.workgroup;
  source.subgroup_size = f.subgroup;
  source.defines = {{"BALLOT_ANY_HIT", variant.want == Want::Any},
                    {"BALLOT_TRIANGLE", variant.numeric->triangle},
                    {"BALLOT_BOX", f.padding == Padding::Tree ? BOX_WIDENED : variant.numeric->box},
                    {"BALLOT_PRODUCTS", int(f.products)},
                    {"BALLOT_FETCH", int(f.fetch)},
                    {"BALLOT_RAY_TEXELS", f.fetch == Fetch::Texel && device.is_cpu()},
                    {"BALLOT_LAYOUT", method.quads ? LAYOUT_CENTRED : int(f.layout)},
                    {"BALLOT_STACK", int(f.stack)},
                    {"BALLOT_PUSH", own_stack ? int(f.push) : 0},
                    {"BALLOT_PACKET_STACK", method.shares_stack() ? int(f.packet_stack) : 0},
                    {"BALLOT_VOTE", packet ? int(f.vote) : 0},
                    {"BALLOT_COOPERATIVE", packet && f.cooperative},
                    {"BALLOT_SUBGROUP_BARRIER", f.subgroup_barrier},
                    {"BALLOT_MINMAX", int(f.minmax)},
                    {"BALLOT_LEAF_BOX", f.leaf_box},
                    {"BALLOT_LEAF_RUN", f.leaf_run},
                    {"BALLOT_LEAF_LOOP", wide || leaves_loop(tree)},
                    {"BALLOT_BOX_ORIGIN", tree.far},
                    {"BALLOT_LOOPS_CUT", f.loops_cut},
                    {"BALLOT_SORTED", f.sorted || method.quads || variant.want == Want::Nearest},
                    {"BALLOT_RAYS", wide ? int(f.rays) : 1},
                    {"BALLOT_FALLBACK", wide && f.fallback},
                    {"BALLOT_JUMP", wide && f.jump},
                    {"BALLOT_REDUCE", method.reduces() ? int(f.reduce) : 0},
                    {"BALLOT_FRONTIER", method.frontier ? int(f.frontier) : 0},
                    {"BALLOT_LAUNCH", int(f.launch)},
                    {"BALLOT_UNIFORM_FLOW", device.uniform_flow},
                    {"BALLOT_INDIRECT", variant.indirect},
                    {"BALLOT_CAMERA", variant.camera != CameraKind::None},
                    {"BALLOT_COUNTERS", variant.counters}};
  if (variant.camera != CameraKind::None) {
    source.defines.emplace_back("BALLOT_PERSPECTIVE", variant.camera == CameraKind::Perspective);
    source.defines.emplace_back("BALLOT_ORTHOGRAPHIC", variant.camera == CameraKind::Orthographic);
  }
  source.constants = {{SPEC_GROUP_SIZE, f.workgroup},
                      {SPEC_STACK_SIZE, stack},
                      {SPEC_GROUP_SUBGROUPS, f.workgroup / f.subgroup},
                      {SPEC_SUBGROUP_SIZE, f.subgroup},
                      {SPEC_LIST_SIZE, list}};
  return source;
}

}  // namespace ballot
