// Inside tests by look-up: cells around a scene that no triangle touches, each all inside or all outside. Internal to
// engine/answer.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "engine/answer/dispatch.h"
#include "engine/gpu/kernel.h"
#include "engine/tree/device/device_tree.h"
#include "shaders/shared/query.h"

namespace ballot {

class QueryKernel;

/// Returns the source of the kernel that looks points up.
KernelSource look_up_source();

/// The cells of a tree (shaders/query/cells.comp), found once for each of its generations and kept. A point in a cell
/// that nothing touches has the cell's answer, which is the one that a walk gives, bit for bit; the others are listed.
/// Not for instances and shapes, meshes whose open edges shadow much of the cells, scenes farther from zero than 4096
/// of their longest sides, and vertices whose y or z are within 2^-60 of that side from zero but not 0. Belongs to the
/// thread of its Context.
class InsideCells {
 public:
  explicit InsideCells(Context& gpu);
  ~InsideCells();

  /// Returns true if a call for so many points is to be answered by look-up, and makes the cells then. On a CPU device
  /// that is so once a generation has been asked for kCellsPay points, and for a number of them for each triangle.
  /// Throws Error(Work) if the device fails.
  bool serve(DeviceTree& tree, std::uint64_t points);
  /// To be called when the tree that serve() was given goes.
  void forget_tree();
  /// For tests: whether it is so for any number of points, or none; nothing: as serve() says.
  void set_pay(std::optional<bool> pay) { pay_ = pay; }
  bool are_found() const { return level_ > 0; }

  /// Answers points [first, first + count) of an array, but for those that it lists, and waits. Returns the number of
  /// these. Adds the time to `times`.
  std::uint32_t look_up(const RawBuffer& points, const RawBuffer& answers, std::uint32_t first, std::uint32_t count,
                        TraceTimes& times);
  /// Lists points [0, count).
  void list_all(std::uint32_t count);
  /// Binds the list to a kernel with BALLOT_LISTED.
  template <class Kernel>
  void bind(Kernel& kernel) const {
    kernel.bind(BIND_LISTED_POINTS, *listed_);
  }

 private:
  bool place(const DeviceTree& tree, std::uint32_t level);
  bool cast_shadows(const DeviceTree& tree);
  void find(DeviceTree& tree);
  CellGrid grid_of(std::uint32_t level) const;
  void make_list(std::uint32_t count);
  void put_in_order(const RawBuffer& points, std::uint32_t listed);

  Context& gpu_;
  std::optional<bool> pay_;
  std::uint64_t generation_ = 0, asked_ = 0;  // of the tree that is asked; points of it
  std::uint32_t level_ = 0;                   // of the finest cells; 0: none are found
  bool refused_ = false;                      // the tree has no cells
  glm::vec3 lo_{0}, middle_{0};
  float side_ = 0, scene_side_ = 0;        // of all cells, and the scene's longest
  std::vector<float> shadows_;             // of all levels, the finest first
  std::vector<std::uint32_t> shadows_at_;  // where those of a level begin
  std::unique_ptr<QueryKernel> kernel_;
  std::unique_ptr<Kernel> look_up_;
  std::unique_ptr<Buffer<std::uint32_t>> cells_, parents_, listed_, listed_count_;
};

}  // namespace ballot
