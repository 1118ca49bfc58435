// The triangles that overlap a box.
#include "engine/answer/point_lists.h"
#include "engine/core/interruption.h"
#include "engine/core/stopwatch.h"
#include "engine/oracle/overlap.h"

namespace ballot {

/// Lists of triangles, each of which lies in one leaf of the tree.
class PointQueries::Parts::OverlapLists : public TriangleLists<ProbeBox> {
 public:
  OverlapLists(Parts& parts, const PointQuery& query) : TriangleLists(parts, "overlap", query) {}
  bool order(std::span<const ProbeBox> boxes, std::vector<std::uint32_t>& order) override {
    order_boxes(boxes, parts_.whole.tree().bvh().bounds, order);
    return true;
  }
  std::vector<std::vector<Within>> settle(const ListPart<ProbeBox>& boxes) override {
    constexpr std::size_t kSettled = 1 << 8;
    DeviceTree& tree = parts_.whole.tree();
    const FilterJudge judge(tree.forest(), query_.triangle_masks);
    const OracleScene& oracle = tree.oracle_scene();
    std::vector<std::vector<Within>> all(boxes.size());
    const Stopwatch watch(tree.walked_s());
    for_chunks(boxes.size(), kSettled, [&](std::size_t begin, std::size_t end) {
      check_interruption();
      for (std::size_t i = begin; i < end; ++i) {
        const ProbeBox& box = boxes.questions[i];
        for (const std::uint32_t prim : prims_overlapping(oracle, {box.lo, box.hi}))
          if (judge.keeps(boxes.words, i, prim)) all[i].push_back({0, prim});
      }
    });
    return all;
  }
};

TraceTimes PointQueries::overlapping(const BoxStream& stream, const TakeWithin& take, const PointQuery& query) {
  if (parts_->scene.facts().shapes)
    fail(Failure::Arguments, "triangles that overlap boxes: found a scene with shapes; expected triangles alone");
  Parts::OverlapLists kind(*parts_, query);
  return parts_->list(kind, parts_->box_lists, stream, take);
}

}  // namespace ballot
