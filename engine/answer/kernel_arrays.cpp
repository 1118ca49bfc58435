#include "engine/answer/kernel_arrays.h"

#include "shaders/shared/shapes.h"

namespace ballot {

namespace {

/// Writes the address of an array in halves; an array that is null leaves them as they are.
void push_address(const DeviceTree::Texels* texels, std::uint32_t& lo, std::uint32_t& hi) {
  if (!texels) return;
  lo = std::uint32_t(texels->address());
  hi = std::uint32_t(texels->address() >> 32);
}

}  // namespace

KernelArrays::KernelArrays(DeviceTree& tree, const TreeReads& r) : in_double(r.in_double) {
  if (r.in_double && tree.doubles()) doubles = &tree.double_texels();
  if (r.pairs) nodes = &tree.nodes(r.access, r.source);
  if (format_of(r.format).encode) format = &tree.format(r.format, r.access, r.source);
  leaves = &tree.leaves(r.leaves, r.access.fetch, r.source);
  if (tree.forest()) {
    if (tree.facts().shapes) shapes = &tree.shapes();
    top = &tree.top(r.access.fetch);
    meshes = &tree.mesh_table(r.format, r.access, r.leaves, r.source);
  }
  tree.let_go();
}

void KernelArrays::bind(Kernel& kernel, Fetch fetch) const {
  if (shapes && kernel.wants(BIND_SHAPES)) kernel.bind(BIND_SHAPES, *shapes);
  if (doubles) kernel.bind(BIND_DOUBLES, *doubles);
  if (fetch == Fetch::Reference) return;  // by their addresses
  if (nodes) kernel.bind(BIND_NODES, *nodes);
  if (format) kernel.bind(BIND_FORMAT, *format);
  kernel.bind(BIND_LEAVES, *leaves);
  if (top) kernel.bind(BIND_TOP, *top);
  if (meshes) kernel.bind(BIND_MESHES, *meshes);
}

TracePushes KernelArrays::pushes(const DeviceTree& tree, const TreePiece& from) const {
  TracePushes pushes{};
  TracePush& push = pushes.trace;
  push.scene_lo = tree.bvh().bounds.lo;
  push.scene_hi = tree.bvh().bounds.hi;
  push.box_origin = tree.box_origin();
  push.padded_reach = tree.padded_reach();
  push.shear_scale = tree.shear().scale;
  push.shear_near = tree.shear().near;
  if (in_double) {  // what the others are for is not read (shaders/lib/numeric/box_relative.glsl)
    push.padded_reach = tree.doubles_room();
    push.shear_scale = tree.doubles() ? tree.doubles()->top_room() : 0;
  }
  push.root = from.root;
  push_address(nodes, push.nodes_lo, push.nodes_hi);
  push_address(format, push.format_lo, push.format_hi);
  push_address(leaves, push.leaves_lo, push.leaves_hi);
  push_address(top, pushes.top.top_lo, pushes.top.top_hi);
  push_address(meshes, pushes.top.meshes_lo, pushes.top.meshes_hi);
  pushes.top.records = tree.forest() ? tree.forest()->top_facts().records : 0;
  pushes.top.mesh_root = from.mesh_root;
  return pushes;
}

}  // namespace ballot
