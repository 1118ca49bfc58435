// The tuning table: a row for each driver that needs another kernel configuration, with the measurement that justifies
// it.
#include "engine/answer/auto/auto.h"
#include "engine/core/error.h"

namespace ballot {

namespace {

struct TuningRow {
  Driver driver;
  std::uint32_t from, to;  // Mesa versions [from, to) as 220306; 0 and 0xFFFFFFFF for any
  void (*tune)(const Method&, const NumericMode&, KernelConfig&);
};

const TuningRow kTuningRows[] = {
    // Mesa below 25: all loops of an invocation share 65 535 iterations. A subgroup that takes more than 16 batches
    // loses time to traversals that are cut short and traced again. Where idle lanes take new rays, a subgroup waits
    // for its last rays once, so 64 batches are 1.03 to 1.06 times as fast (tools/measured/traversal.md); decisions of
    // mode exact loop too. The driver also executes the code that lanes branch around (jump).
    {Driver::Llvmpipe, 0, 250000,
     [](const Method& m, const NumericMode& numeric, KernelConfig& f) {
       f.batches = m.refills() && !numeric.needs_float64 ? 64 : 16;
       f.jump = false;
     }},
    // Mesa 25 and later: loops run to their end (device test Vulkan.TheTuningTableKnowsDriversThatCutLoops). Each texel
    // costs a call that returns its words through memory, so node pairs of three texels are used (Compact).
    {Driver::Llvmpipe, 250000, 0xFFFFFFFF,
     [](const Method& m, const NumericMode&, KernelConfig& f) {
       f.loops_cut = false;
       f.resident_lanes = 2048;  // workgroups for 32 threads; later workgroups would find no rays left
       f.claim = 1024;           // measured in tools/measured/traversal.md
       if (!m.packet()) f.layout = NodeLayout::Compact;
     }},
    // Every version of lavapipe: subgroupBarrier() runs as a workgroup barrier, and subgroups that have left the loop
    // are lost (seen on 25.0.7).
    {Driver::Llvmpipe, 0, 0xFFFFFFFF,
     [](const Method&, const NumericMode&, KernelConfig& f) {
       f.subgroup_barrier = false;
       // A mispredicted branch per lane costs more than a store. Measured with while-while on sponza and conference: ao
       // and diffuse rays are 1.17 to 1.23 times as fast on 22.3.6 and 1.08 to 1.23 times on 25.0.7; primary rays 0.98
       // to 1.07 times.
       f.push = Push::Always;
       f.minmax = MinMax::Select;   // measured in shaders/lib/numeric/box.glsl
       f.unpack = Unpack::Integer;  // measured in tools/measured/queries.md
       f.cooperative = true;
     }},
    // fma() is one instruction that rounds once (device test ProductsTest.KeepTheExactSign). Loops run to their end;
    // checks that they do would cost 1 %.
    //
    // The other settings were measured in one run on an H200 (580.159.04). A figure says how many times as fast a
    // setting is: the geometric mean over primary, shadow, ao, diffuse and secondary rays of four scenes, 1024 x 1024,
    // two views. Three figures are for fast, plain and watertight; "more" is on top of the settings before. With
    // while-while:
    // - no second test of leaf boxes: 1.03, 1.03, 1.02
    // - minima of three integers: 1.01, 1.05, 1.03 more
    // - centred boxes: 1.03, 1.06, 1.03 more
    // - runs of leaves: 0.95, 1.02, 1.06 (fast: because of its registers)
    // - workgroups of 128 instead of 64: 1.01
    // - a store in every step (Push::Always in its row of methods.h): 1.00, 1.01, 1.01 more
    // The other methods gain as much: stack-max 1.10, 1.14, 1.07. Boxes padded in the tree, watertight, three scenes:
    // while-while 1.15, frontier 1.11, dynamic-fetch 1.10. Pairs in 48 bytes: 1.11, 1.06, 1.00 more (diffuse rays 1.14,
    // 1.11, 1.03); packets, whose lanes share a load, 0.99.
    {Driver::Nvidia, 0, 0xFFFFFFFF,
     [](const Method& m, const NumericMode& numeric, KernelConfig& f) {
       f.products = Products::Fma;
       f.loops_cut = false;
       f.layout = m.packet() ? NodeLayout::Centred : NodeLayout::Compact;
       f.minmax = MinMax::Integer;
       f.padding = Padding::Tree;
       f.leaf_run = numeric.leaves == LeafFormat::Vertices;
       if (!m.shares_stack() && f.launch == Launch::Plain) f.workgroup = 128;
     }},
};

/// Returns true if boxes can be padded in the tree. Returns false for modes whose boxes need no padding, and for tree
/// formats that have no padded boxes.
bool can_widen(const Method& m, const NumericMode& numeric) {
  return numeric.box == BOX_PADDED && format_of(m.tree).padded;
}

/// Replaces settings that the device or the tree lacks. Throws Error(Arguments) if the method needs them or a knob
/// asked for them.
void fit_to_device(const Method& m, const NumericMode& numeric, KernelConfig& f, const DeviceInfo& d,
                   const Knobs& knobs) {
  if (!d.shuffle) {
    if (m.shuffles() || (has_frontier(m, f) && f.reduce == Reduce::Shuffle))
      fail(Failure::Arguments, "method {}: {} has no subgroup shuffle", m.name, d.name);
    if (knobs.contains("cooperative") && f.cooperative)
      fail(Failure::Arguments, "knob cooperative=1: {} has no subgroup shuffle", d.name);
    if (knobs.contains("packet_stack") && f.packet_stack == PacketStack::Lanes)
      fail(Failure::Arguments, "knob packet_stack=lanes: {} has no subgroup shuffle", d.name);
    f.cooperative = false;
    f.packet_stack = PacketStack::Shared;
  }
  if (!d.arithmetic && f.reduce == Reduce::Integer)
    fail(Failure::Arguments, "knob reduce=integer: {} has no subgroup arithmetic", d.name);
  if (!d.buffer_address && f.fetch == Fetch::Reference) {
    if (knobs.contains("fetch"))
      fail(Failure::Arguments, "knob fetch=reference: {} has no buffer device address", d.name);
    f.fetch = Fetch::Storage;
  }
  if (knobs.contains("padding") && f.padding == Padding::Tree && !format_of(m.tree).padded)
    fail(Failure::Arguments, "knob padding=tree: the tree that method {} walks is not padded", m.name);
  if (knobs.contains("padding") && f.padding == Padding::Tree && f.leaf_box)
    fail(Failure::Arguments, "knob padding=tree: leaf_box=1 would test boxes of leaves, which are not padded");
  if (!can_widen(m, numeric) || f.leaf_box) f.padding = Padding::Ray;
  if (!d.float64 && f.products == Products::Float64)
    fail(Failure::Arguments, "knob products=float64: {} has no shaderFloat64", d.name);
  if (!numeric.leaves_open) f.doubtful = Doubtful::Decided;
  // A lane with several rays does not count the decisions of each.
  if (m.ray_packets && f.rays > 1 && f.doubtful == Doubtful::Limited) f.doubtful = Doubtful::Decided;
  // The lanes of a subgroup share a claim, so they have to come to it together.
  if (!d.is_cpu() && !d.uniform_flow) f.claim = 1;
}

/// Checks the subgroup and workgroup sizes and sets those that no knob gave. Throws Error(Arguments).
void fit_sizes(KernelConfig& f, const DeviceInfo& d, const Knobs& knobs) {
  const bool power_of_two = (f.subgroup & (f.subgroup - 1)) == 0;
  if (f.subgroup && (f.subgroup < d.min_subgroup_size || f.subgroup > d.max_subgroup_size || !power_of_two))
    fail(Failure::Arguments, "knob subgroup={}: {} offers powers of two from {} to {}", f.subgroup, d.name,
         d.min_subgroup_size, d.max_subgroup_size);
  if (!f.subgroup) f.subgroup = d.subgroup_size;
  if (f.workgroup < f.subgroup && !knobs.contains("workgroup")) f.workgroup = f.subgroup;
  const std::uint32_t most =
      std::min(std::min(d.max_group_invocations, d.max_group_size_x), f.subgroup * d.max_group_subgroups);
  if (f.workgroup % f.subgroup || f.workgroup > most)
    fail(Failure::Arguments, "knob workgroup={}: it must be a multiple of the subgroup, {}, and at most {} on {}",
         f.workgroup, f.subgroup, most, d.name);
}

}  // namespace

KernelConfig kernel_config_for(const Method& method, const NumericMode& numeric, const DeviceInfo& device,
                               const Knobs& knobs) {
  if (method.chooses) {
    const AutoChoice choice = auto_choice({.numeric = std::string(numeric.name), .knobs = knobs}, device);
    return kernel_config_for(find_method(choice.chosen.method), numeric, device, choice.chosen.knobs);
  }
  const Defaults& wants = device.is_cpu() ? method.cpu : method.gpu;
  KernelConfig f;
  f.fetch = wants.fetch;
  f.stack = wants.stack;
  f.launch = wants.launch;
  f.push = wants.push;
  f.threshold = method.threshold.standard;
  // In modes that need float64, a kernel that holds its code eight times would take long to compile.
  f.rays = device.is_cpu() && !numeric.needs_float64 ? 8 : 1;
  // Where all lanes run both sides of a branch, the rare decision of such rays costs all of them: measured in
  // tools/measured/traversal.md.
  if (numeric.leaves_open) f.doubtful = device.is_cpu() ? Doubtful::Listed : Doubtful::Limited;
  f.products = device.float64 ? Products::Float64 : Products::Split;
  f.reduce = device.arithmetic && !device.is_cpu() ? Reduce::Integer : Reduce::Shuffle;  // tools/measured/traversal.md
  f.jump = device.is_cpu();  // an H200 gains nothing by it: 0.97 to 1.05 times as fast
  f.packet_stack = device.shuffle ? PacketStack::Lanes : PacketStack::Shared;
  for (const TuningRow& row : kTuningRows) {
    const std::uint32_t version = device.mesa_version();
    if (row.driver == device.known_driver() && version >= row.from && version < row.to) row.tune(method, numeric, f);
  }
  apply_knobs(f, knobs);
  check_knobs(method, f, knobs);
  fit_to_device(method, numeric, f, device, knobs);
  fit_sizes(f, device, knobs);
  return f;
}

}  // namespace ballot
