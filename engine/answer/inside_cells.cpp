#include "engine/answer/inside_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/answer/coherent_order.h"
#include "engine/answer/query_kernel.h"
#include "engine/tree/host/topology.h"

namespace ballot {

namespace {

// tools/measured/queries.md has what cells take and save.
constexpr std::uint64_t kCellsPay = 1 << 18, kFineCellsPay = 1 << 23;  // points of a generation
constexpr std::uint64_t kCellPointsOfTriangle = 4;                     // to pay for its edges
constexpr std::uint64_t kFewLookedUp = 1 << 12;                        // points of a call
constexpr std::uint32_t kCellLevel = 6, kFineCellLevel = 7;
constexpr std::size_t kFewToOrder = 1 << 10;  // fewer are not put in order
constexpr float kNoEdge = -std::numeric_limits<float>::max();
constexpr float kCellReach = 4;               // of points, in longest sides of the scene
constexpr float kFarthestCells = 4096;        // scene from zero, in longest sides
constexpr float kLeastCoordinate = 0x1p-60f;  // coordinate, in longest sides
constexpr float kCellPad = 0x1p-15f;          // of cells, in longest sides: shaders/query/cells.comp
constexpr double kMostShadow = 0.25;          // share of the cells

std::uint32_t cell_words(std::uint32_t level) { return std::max(1u, (1u << 3 * level) / 16); }

/// The rows of cells along x, by y and z.
struct Rows {
  std::uint32_t side;  // rows along an axis
  double cell, pad;
  std::span<float> most;  // the largest x of an edge in each

  std::uint32_t row_of(double x) const {
    return std::uint32_t(std::clamp(std::floor(x / cell), 0.0, double(side - 1)));
  }
  /// Adds an edge, whose ends are counted from the first corner of the cells but for `x`, its largest x.
  void add(glm::dvec3 a, glm::dvec3 b, float x) {
    if (a.y > b.y) std::swap(a, b);
    const std::uint32_t first = row_of(a.y - pad), last = row_of(b.y + pad);
    for (std::uint32_t y = first; y <= last; ++y) {
      // The part of the edge over this strip.
      const double from = std::max(a.y, y * cell - pad), to = std::min(b.y, (y + 1) * cell + pad), span = b.y - a.y;
      const auto z_at = [&](double at) { return a.z + (b.z - a.z) * std::clamp((at - a.y) / span, 0.0, 1.0); };
      const bool flat = !(span > pad);
      const double z0 = flat ? a.z : z_at(from), z1 = flat ? b.z : z_at(to);
      const std::uint32_t end = row_of(std::max(z0, z1) + pad);
      for (std::uint32_t z = row_of(std::min(z0, z1) - pad); z <= end; ++z)
        most[y * side + z] = std::max(most[y * side + z], x);
    }
  }
};

}  // namespace

KernelSource look_up_source() {
  return {.name = "query.look_up", .file = "query/look_up.comp", .group_size = LOOK_UP_GROUP};
}

InsideCells::InsideCells(Context& gpu) : gpu_(gpu) {}
InsideCells::~InsideCells() = default;

bool InsideCells::serve(DeviceTree& tree, std::uint64_t points) {
  if (!pay_.value_or(gpu_.info().is_cpu()) || tree.forest() || tree.facts().shapes) return false;
  if (generation_ != tree.generation()) generation_ = tree.generation(), asked_ = 0, level_ = 0, refused_ = false;
  asked_ += std::min<std::uint64_t>(points, 1ull << 40);
  if (refused_ || (!pay_ && points < kFewLookedUp)) return false;
  const std::uint64_t pays = std::max(kCellsPay, kCellPointsOfTriangle * tree.bvh().stats.triangles);
  const std::uint32_t level = asked_ >= std::max(kFineCellsPay, pays) ? kFineCellLevel : kCellLevel;
  if (level_ >= level) return true;
  if (!pay_ && asked_ < pays) return false;
  refused_ = true;  // until they are found
  if (!place(tree, level) || !cast_shadows(tree)) return false;
  find(tree);
  refused_ = false;
  return true;
}

void InsideCells::forget_tree() {
  kernel_.reset();
  generation_ = 0;
}

/// Places cells around the scene, with a layer of them on each side. Returns false if it has coordinates for which the
/// proof does not hold.
bool InsideCells::place(const DeviceTree& tree, std::uint32_t level) {
  const Bounds& b = tree.bvh().bounds;
  const glm::vec3 sides = b.hi - b.lo, ends = glm::max(glm::abs(b.lo), glm::abs(b.hi));
  scene_side_ = std::max({sides.x, sides.y, sides.z});
  if (!(scene_side_ > 0x1p-60f) || !(scene_side_ < 0x1p60f)) return false;
  if (std::max({ends.x, ends.y, ends.z}) > kFarthestCells * scene_side_) return false;
  const float least = kLeastCoordinate * scene_side_;
  for (const Triangle& t : tree.triangles())
    for (const glm::vec3& v : t)
      if ((v.y != 0 && std::abs(v.y) < least) || (v.z != 0 && std::abs(v.z) < least)) return false;
  level_ = level;
  const auto cells = float(1u << level);
  side_ = scene_side_ * (1 + 8 * kCellPad) * (cells / (cells - 2));
  middle_ = 0.5f * b.lo + 0.5f * b.hi;
  lo_ = middle_ - 0.5f * side_;
  return true;
}

/// Finds the shadows of open edges at all levels. Returns false if they are too large.
bool InsideCells::cast_shadows(const DeviceTree& tree) {
  const std::uint32_t side = 1u << level_;
  shadows_.assign(side * side, kNoEdge);
  shadows_at_.assign(level_ + 1, 0);
  Rows rows{side, double(side_) / side, double(kCellPad) * scene_side_, shadows_};
  for (const auto& [a, b] : open_edges(tree.triangles()))
    rows.add(glm::dvec3(a) - glm::dvec3(lo_), glm::dvec3(b) - glm::dvec3(lo_), std::max(a.x, b.x));
  double share = 0;
  for (const float x : shadows_) share += std::clamp((double(x) - lo_.x) / side_, 0.0, 1.0);
  level_ = share <= kMostShadow * side * side ? level_ : 0;
  if (!level_) return false;
  for (std::uint32_t level = level_; level > FIRST_CELL_LEVEL; --level) {
    const std::uint32_t of = shadows_at_[level], half = 1u << (level - 1);
    shadows_at_[level - 1] = std::uint32_t(shadows_.size());
    for (std::uint32_t y = 0; y < half; ++y)
      for (std::uint32_t z = 0; z < half; ++z) {
        const auto at = [&](std::uint32_t k) { return shadows_[of + (2 * y + k / 2) * 2 * half + 2 * z + k % 2]; };
        shadows_.push_back(std::max({at(0), at(1), at(2), at(3)}));
      }
  }
  return true;
}

CellGrid InsideCells::grid_of(std::uint32_t level) const {
  return {lo_, side_ / float(1u << level), kCellPad * scene_side_, level, shadows_at_[level]};
}

void InsideCells::find(DeviceTree& tree) {
  const std::uint32_t finest = std::exchange(level_, 0);
  if (!kernel_) kernel_ = std::make_unique<QueryKernel>(gpu_, tree, "cells", Defines{{"BALLOT_EXACT", 0}});
  kernel_->prepare();
  Buffer<CellGrid> grid(gpu_, 1, Access::Storage, "grid of cells");
  Buffer<float> shadows(gpu_, shadows_.size(), Access::Storage, "shadows of open edges");
  shadows.upload(shadows_);
  kernel_->bind(BIND_RAYS, grid);  // not read: cells are asked
  kernel_->bind(BIND_CELL_GRID, grid);
  kernel_->bind(BIND_SHADOWS, shadows);
  TraceTimes times;
  parents_ = std::make_unique<Buffer<std::uint32_t>>(gpu_, 1, Access::Storage, "cells");
  for (std::uint32_t level = FIRST_CELL_LEVEL; level <= finest; ++level) {
    cells_ = std::make_unique<Buffer<std::uint32_t>>(gpu_, cell_words(level), Access::Storage, "cells");
    cells_->upload(std::vector<std::uint32_t>(cell_words(level)));
    grid.upload(std::vector{grid_of(level)});
    kernel_->bind(BIND_CELLS, *cells_);
    kernel_->bind(BIND_PARENT_CELLS, *parents_);
    const std::uint32_t count = 1u << 3 * level;
    for (std::uint32_t first = 0; first < count; first += kernel_->most())
      kernel_->run(first, std::min(kernel_->most(), count - first), {tree.root()}, times);
    std::swap(cells_, parents_);
  }
  std::swap(cells_, parents_);
  parents_.reset();
  level_ = finest;
}

void InsideCells::make_list(std::uint32_t count) {
  buffer_for(listed_, gpu_, count, "points in touched cells");
  if (!listed_count_)
    listed_count_ = std::make_unique<Buffer<std::uint32_t>>(gpu_, 1, Access::Storage, "number of points");
}

void InsideCells::list_all(std::uint32_t count) {
  make_list(count);
  std::vector<std::uint32_t> all(count);
  for (std::uint32_t i = 0; i < count; ++i) all[i] = i;
  listed_->upload(all);
}

std::uint32_t InsideCells::look_up(const RawBuffer& points, const RawBuffer& answers, std::uint32_t first,
                                   std::uint32_t count, TraceTimes& times) {
  if (refresh(gpu_, look_up_, look_up_source())) gpu_.save_pipeline_cache();
  make_list(count);
  std::uint32_t listed = 0;
  listed_count_->upload(std::span(&listed, 1));
  const float cells = float(1u << level_);
  look_up_->bind(BIND_RAYS, points);
  look_up_->bind(BIND_CROSSINGS, answers);
  look_up_->bind(BIND_CELLS, *cells_);
  look_up_->bind(BIND_LISTED_POINTS, *listed_);
  look_up_->bind(BIND_LISTED_COUNT, *listed_count_);
  const LookUpPush push{lo_,    cells / side_, middle_, kCellReach * scene_side_, kLeastCoordinate * scene_side_,
                        level_, first,         count};
  gpu_.submit(look_up_->name(), [&](Commands& cmd) { look_up_->dispatch(cmd, groups_of(count, LOOK_UP_GROUP), push); });
  times.device_ms += gpu_.last_ms();
  ++times.dispatches;
  listed_count_->download(std::span(&listed, 1));
  if (gpu_.info().is_cpu() && listed >= kFewToOrder) put_in_order(points, listed);
  return listed;
}

/// Puts listed points in an order in which neighbours are near each other.
void InsideCells::put_in_order(const RawBuffer& points, std::uint32_t listed) {
  std::vector<std::uint32_t> numbers(listed), order;
  listed_->download(numbers);
  const auto* all = reinterpret_cast<const ProbePoint*>(points.mapped());
  std::vector<ProbePoint> asked(listed);
  for (std::size_t i = 0; i < listed; ++i) asked[i] = all[numbers[i]];
  order_points(asked, {lo_, lo_ + side_}, order);
  std::vector<std::uint32_t> ordered(listed);
  for (std::size_t i = 0; i < listed; ++i) ordered[i] = numbers[order[i]];
  listed_->upload(ordered);
}

}  // namespace ballot
