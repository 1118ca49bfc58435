#include "engine/tree/device/build_kernels.h"

#include "engine/core/error.h"
#include "engine/tree/device/wide_encoder.h"

namespace ballot {

// On a GPU small workgroups keep the shared memory of a workgroup small. On lavapipe a workgroup is a task of a thread.
std::uint32_t cluster_subgroups(const DeviceInfo& device) { return device.is_cpu() ? 8 : 2; }

Defines over_define(BuildOver over) { return over == BuildOver::Instances ? Defines{{"BOXES", 1}} : Defines{}; }

KernelSource build_source(const std::string& name, const DeviceInfo& device, const Defines& defines,
                          std::uint32_t subgroups) {
  KernelSource source;
  source.file = "build/" + name + ".comp";
  source.name = "build." + name;
  source.subgroup_size = device.subgroup_size;
  source.group_size = device.subgroup_size * subgroups;
  source.defines = {{"BALLOT_UNIFORM_FLOW", int(device.uniform_flow)},
                    {"BALLOT_FLOAT64", int(device.float64)},
                    {"BALLOT_SUBGROUP_BARRIER", int(device.known_driver() != Driver::Llvmpipe)}};
  for (const auto& [define, value] : defines) {
    source.name += fmt::format(" {}={}", define, value);
    source.defines.emplace_back("BALLOT_" + define, value);
  }
  source.constants = {{BUILD_SPEC_GROUP, source.group_size},
                      {BUILD_SPEC_SUBGROUP, device.subgroup_size},
                      {BUILD_SPEC_GROUP_SUBGROUPS, subgroups}};
  return source;
}

KernelSource write_source(const DeviceInfo& device, NodeLayout layout, Padding padding) {
  return build_source("write", device, {{"LAYOUT", int(layout)}, {"PADDED", int(padding == Padding::Tree)}});
}

KernelSource frontier_source(const DeviceInfo& device, NodeLayout layout) {
  return build_source("frontier", device, {{"LAYOUT", int(layout)}});
}

std::vector<KernelSource> build_sources(const DeviceInfo& device) {
  std::vector<KernelSource> all;
  for (const char* name : {"frame", "needs", "place_blocks", "places", "top"})
    all.push_back(build_source(name, device));
  if (device.float64) all.push_back(build_source("instances", device));
  for (const BuildOver over : {BuildOver::Triangles, BuildOver::Instances})
    for (const char* name : {"bounds", "parents", "refit", "refit_end"})
      all.push_back(build_source(name, device, over_define(over)));
  for (const int words : {1, 2}) {
    all.push_back(build_source("codes", device, {{"KEY_WORDS", words}}));
    for (const char* name : {"sort_count", "sort_sum", "sort_move"})
      for (const int indirect : {0, 1})
        all.push_back(build_source(name, device, {{"KEY_WORDS", words}, {"INDIRECT", indirect}}));
    all.push_back(build_source("cluster", device, {{"KEY_WORDS", words}}, cluster_subgroups(device)));
  }
  const Defines boxes{{"KEY_WORDS", 1}, {"BOXES", 1}};
  all.push_back(build_source("codes", device, boxes));
  all.push_back(build_source("cluster", device, boxes, cluster_subgroups(device)));
  for (const NodeLayout layout :
       {NodeLayout::Paper, NodeLayout::Interleaved, NodeLayout::Centred, NodeLayout::Compact}) {
    for (const Padding padding : {Padding::Ray, Padding::Tree}) all.push_back(write_source(device, layout, padding));
    all.push_back(frontier_source(device, layout));
  }
  for (KernelSource& source : encoder_sources(device)) all.push_back(std::move(source));
  return all;
}

}  // namespace ballot
