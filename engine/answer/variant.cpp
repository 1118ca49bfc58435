#include "engine/answer/variant.h"

#include <algorithm>
#include <cctype>

#include "engine/core/error.h"

namespace ballot {

namespace {

/// Returns the words of shared memory that the stacks and votes of a workgroup take.
std::uint32_t shared_words(const Variant& variant, std::uint32_t stack) {
  const KernelConfig& c = variant.config;
  const Method& method = *variant.method;
  std::uint32_t words = 0;
  if (has_own_stack(method, c) && c.stack == StackPlace::Shared)
    words = (stack + (method.lists ? c.list : 0)) * c.workgroup;
  if (method.shares_stack() && c.packet_stack == PacketStack::Shared) words += stack * (c.workgroup / c.subgroup);
  if (method.packet() && c.vote == Vote::Sum) words += c.workgroup;
  return words;
}

/// The inputs of those defines that follow from no knob: the query (in its variant), the device and the tree.
struct Facts {
  const Variant& variant;
  const DeviceInfo& device;
  const TreeFacts& tree;
};

static_assert(int(Doubtful::Decided) == DOUBTFUL_DECIDED && int(Doubtful::Limited) == DOUBTFUL_LIMITED &&
              int(Doubtful::Listed) == DOUBTFUL_LISTED && int(Doubtful::Taken) == DOUBTFUL_TAKEN);

/// A define that follows from no knob.
struct FactDefine {
  const char* name;
  int (*value)(const Facts&);
};

constexpr FactDefine kFactDefines[] = {
    {"BALLOT_ANY_HIT", [](const Facts& f) { return int(f.variant.want == Want::Any); }},
    {"BALLOT_TRIANGLE", [](const Facts& f) { return f.variant.numeric->triangle; }},
    {"BALLOT_BOX",
     [](const Facts& f) { return f.variant.config.padding == Padding::Tree ? BOX_WIDENED : f.variant.numeric->box; }},
    {"BALLOT_RAY_TEXELS",
     [](const Facts& f) { return int(f.variant.config.fetch == Fetch::Texel && f.device.is_cpu()); }},
    {"BALLOT_SUBGROUP_BARRIER", [](const Facts& f) { return int(f.variant.config.subgroup_barrier); }},
    {"BALLOT_LEAF_LOOP", [](const Facts& f) { return int(f.variant.method->ray_packets || leaves_loop(f.tree)); }},
    {"BALLOT_BOX_ORIGIN", [](const Facts& f) { return int(f.tree.far); }},
    {"BALLOT_INSTANCES", [](const Facts& f) { return int(f.tree.top_depth > 0); }},
    {"BALLOT_SHAPES", [](const Facts& f) { return int(f.tree.shapes); }},
    {"BALLOT_LARGE", [](const Facts& f) { return int(f.tree.large); }},
    {"BALLOT_LOOPS_CUT", [](const Facts& f) { return int(f.variant.config.loops_cut); }},
    {"BALLOT_UNIFORM_FLOW", [](const Facts& f) { return int(f.device.uniform_flow); }},
    {"BALLOT_INDIRECT", [](const Facts& f) { return int(f.variant.indirect); }},
    {"BALLOT_CAMERA", [](const Facts& f) { return int(f.variant.camera != CameraKind::None); }},
    {"BALLOT_DOUBLES", [](const Facts& f) { return int(reads_doubles(f.variant, f.tree)); }},
    {"BALLOT_RAYS_DOUBLE", [](const Facts& f) { return int(f.variant.rays_in_double); }},
    {"BALLOT_COUNTERS", [](const Facts& f) { return int(f.variant.counters); }},
    {"BALLOT_DOUBTFUL", [](const Facts& f) { return int(f.variant.config.doubtful); }},
};

Defines defines_for(const Facts& f) {
  Defines defines = knob_defines(f.variant.config, *f.variant.method);
  if (f.variant.want == Want::Nearest)  // nearest hits: children are sorted, whatever the knob says
    for (auto& [name, value] : defines)
      if (name == "BALLOT_SORTED") value = 1;
  for (const FactDefine& d : kFactDefines) defines.emplace_back(d.name, d.value(f));
  if (f.variant.camera != CameraKind::None) {
    defines.emplace_back("BALLOT_PERSPECTIVE", f.variant.camera == CameraKind::Perspective);
    defines.emplace_back("BALLOT_ORTHOGRAPHIC", f.variant.camera == CameraKind::Orthographic);
  }
  return defines;
}

std::string upper(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](unsigned char c) { return char(std::toupper(c)); });
  return out;
}

}  // namespace

std::string Variant::kernel_name() const {
  constexpr const char *kCameras[] = {"", ".perspective", ".orthographic"},
                       *kDoubtful[] = {"", ".limited", ".lists", ".takes"};
  return fmt::format("{}.{}.{}{}{}{}{}{} [{}]", method->name, want == Want::Any ? "any" : "nearest", numeric->name,
                     rays_in_double ? ".rays64" : "", counters ? ".counters" : "", indirect ? ".indirect" : "",
                     kCameras[int(camera)], kDoubtful[int(config.doubtful)], describe(config, *method));
}

Variant Variant::taking() const {
  Variant v = *this;
  v.config.doubtful = Doubtful::Taken;
  v.indirect = false;  // the list has the count
  v.config.launch = Launch::Plain;
  // Lanes that share a path wait for each other's decisions. Each ray by itself, over the same tree, is faster.
  if (method->packet()) v.method = &find_method("while-while");
  return v;
}

std::string Variant::name() const {
  const std::string threshold = describe_threshold(config, *method);
  return threshold.empty() ? kernel_name() : kernel_name() + " " + threshold;
}

std::uint32_t stack_entries(const TreeFacts& tree, std::uint32_t pushed, std::uint32_t spare) {
  return (tree.depth * pushed + 1 + spare + 15) / 16 * 16;
}

KernelSource kernel_source(const Variant& variant, const DeviceInfo& device, const TreeFacts& tree) {
  check_takes(*variant.numeric, tree.shapes);
  const KernelConfig& c = variant.config;
  const Method& method = *variant.method;
  const std::uint32_t stack = stack_entries(tree, format_of(method.tree).pushes, method.spare_entries());
  const std::uint64_t shared_bytes = std::uint64_t(shared_words(variant, stack)) * 4;
  if (shared_bytes > device.shared_bytes)
    fail(Failure::Work,
         "{}: the stacks of a tree of depth {} need {} bytes of shared memory at workgroup={}, but {} has {}; use a "
         "smaller --knob workgroup, or --knob stack=private",
         variant.name(), tree.depth, shared_bytes, c.workgroup, device.name, device.shared_bytes);
  KernelSource source;
  source.name = variant.kernel_name() + (method.ray_packets || leaves_loop(tree) ? "" : " leaves=1") +
                (tree.far ? " far=1" : "") + (tree.top_depth ? " instances=1" : "") + (tree.large ? " large=1" : "") +
                (tree.shapes ? fmt::format(" shapes={}", tree.shapes) : "") +
                (reads_doubles(variant, tree) ? " doubles=1" : "");
  source.file = method.kernel;
  source.group_size = c.workgroup;
  source.subgroup_size = c.subgroup;
  source.defines = defines_for({variant, device, tree});
  source.constants = {{SPEC_GROUP_SIZE, c.workgroup},
                      {SPEC_STACK_SIZE, stack},
                      {SPEC_GROUP_SUBGROUPS, c.workgroup / c.subgroup},
                      {SPEC_SUBGROUP_SIZE, c.subgroup},
                      {SPEC_LIST_SIZE, method.lists ? c.list : 0}};
  if (tree.top_depth) source.constants[SPEC_TOP_STACK] = top_entries(tree);
  return source;
}

std::string knobs_header() {
  std::string text =
      "// Written by `ballot shaders --headers` from the registry engine/answer/knobs.h; a test compares.\n"
      "// The values of the defines that knobs set.\n#ifndef BALLOT_KNOBS_H\n#define BALLOT_KNOBS_H\n";
  for (const Knob& knob : kKnobs) {
    if (knob.define.empty()) continue;
    text += fmt::format("\n// {}: {}.\n", knob.define, knob.help);
    if (knob.names[0].empty() || knob.names == kOffOn) continue;
    const std::string prefix = upper(knob.define.substr(std::string_view("BALLOT_").size()));
    for (std::size_t i = 0; i < knob.names.size(); ++i)
      if (!knob.names[i].empty()) text += fmt::format("#define {}_{} {}\n", prefix, upper(knob.names[i]), i);
  }
  return text + "\n#endif  // BALLOT_KNOBS_H\n";
}

std::string knobs_guard() {
  std::string text =
      "// Written by `ballot shaders --headers` from engine/answer/; a test compares.\n"
      "// Every define that a traversal kernel reads must be given (engine/answer/variant.cpp).\n";
  const auto guard = [&](std::string_view name) {
    text += fmt::format("#ifndef {}\n#error {} is not defined\n#endif\n", name, name);
  };
  for (const Knob& knob : kKnobs)
    if (!knob.define.empty()) guard(knob.define);
  for (const FactDefine& d : kFactDefines) guard(d.name);
  return text;
}

}  // namespace ballot
