// Columns of answers that lie on the device: numbers of triangles and meshes, normals, and the like, from hits or
// nearest points.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "engine/gpu/buffer.h"
#include "engine/gpu/kernel.h"
#include "engine/tree/device/device_tree.h"
#include "shaders/shared/query.h"

namespace ballot {

/// What tells apart where triangles belong, by their numbers.
struct PrimTable {
  std::vector<std::uint32_t> words;  // shaders/shared/query.h: BIND_PRIM_TABLE
  std::uint32_t placements = 0, ranges = 0;
};

/// Where columns go, by COLUMN_...; null: not wanted.
using ColumnBuffers = std::array<RawBuffer*, ALL_COLUMNS>;

/// Records that columns are of: hits, or nearest points.
struct ColumnRecords {
  const RawBuffer& found;             // Hit, or Nearest
  bool points = false;                // the latter
  const RawBuffer* inside = nullptr;  // a word for each point; null: Nearest::behind tells
  std::uint64_t count = 0;            // of these, from the first one on
  std::uint64_t to = 0;               // the place of the first one's columns, a multiple of 4
  const RawBuffer* rays = nullptr;    // of hits: the rays, for COLUMN_POSITIONS and COLUMN_FRONT
  std::uint32_t row = 1;              // hits of each ray
};

/// The records of a dispatch.
struct ColumnRange {
  std::uint32_t records, from, to;
};
/// Calls dispatch(ColumnRange) for the parts of records that a device takes at once, by workgroups of COLUMNS_GROUP.
template <class Dispatch>
void for_ranges(const DeviceInfo& device, const ColumnRecords& from, const Dispatch& dispatch) {
  constexpr std::uint64_t kMost = 1u << 22;  // a multiple of 4
  const std::uint64_t most = std::min<std::uint64_t>(kMost, std::uint64_t(device.max_group_count_x) * COLUMNS_GROUP);
  for (std::uint64_t first = 0; first < from.count; first += most)
    dispatch(ColumnRange{std::uint32_t(std::min(most, from.count - first)), std::uint32_t(first),
                         std::uint32_t(from.to + first)});
}

/// Writes columns, each by one dispatch with all others of a call. What they are made from is put on the device when
/// somebody first asks for it, and follows the tree: the table of numbers, and for normals the corners of triangles,
/// which take 36 bytes each unless the device has them from building the tree of a flat scene. Belongs to the thread of
/// its Context.
class ColumnWriter {
 public:
  ColumnWriter(Context& gpu, PrimTable table) : gpu_(gpu), table_(std::move(table)) {}

  /// The columns that the device needs float64 for.
  static constexpr std::uint32_t kInDouble[] = {COLUMN_NORMALS, COLUMN_POSITIONS, COLUMN_FRONT, COLUMN_FRONT_WORDS};
  /// Returns true if the device can compute these.
  static bool has_double(const DeviceInfo& device) { return device.float64; }

  /// Records the writing of the columns below COLUMNS behind all earlier passes. Their numbers have the bits of those
  /// that the host finds. `done` is given the device milliseconds of each pass. Throws Error(Work) if the device has no
  /// room.
  void record(DeviceTree& tree, const ColumnRecords& from, const ColumnBuffers& to, const Context::Done& done);

 private:
  struct Corners {
    std::uint64_t of_tree = 0, of_forest = 0;    // generation or exchanges of what the triangles are of; else 0
    std::optional<Buffer<Triangle>> own;         // null: a DeviceBuild has them
    std::uint64_t generation = 0;                // of the forest that the table is of
    std::optional<Buffer<std::uint32_t>> table;  // of a forest
  };
  const RawBuffer& corners_of(DeviceTree& tree);
  const RawBuffer& corner_table_of(const DeviceTree& tree);
  void gather(DeviceTree& tree);
  void bind(Kernel& kernel, DeviceTree& tree, const ColumnRecords& from, const ColumnBuffers& to);

  Context& gpu_;
  PrimTable table_;
  std::optional<Buffer<std::uint32_t>> table_there_;
  Corners corners_;
  std::map<std::string, std::unique_ptr<Kernel>> kernels_;  // by name
};

/// Returns the sources of kernels that together write every column in every way.
std::vector<KernelSource> column_sources();

}  // namespace ballot
