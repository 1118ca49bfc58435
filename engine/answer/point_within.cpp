// The triangles within a radius of a point.
#include "engine/answer/list_there.h"
#include "engine/answer/point_parts.h"

namespace ballot {

/// Lists of triangles, each of which lies in one leaf of the tree.
class PointQueries::Parts::WithinLists : public ListKind<ProbePoint, Within> {
 public:
  WithinLists(Parts& parts, const PointQuery& query, const Buffer<std::uint32_t>* masks_there = nullptr)
      : parts_(parts), query_(query), masks_there_(masks_there) {
    DeviceTree& tree = parts_.whole_tree();
    if (query.masks) parts.within_masks.take(tree, query.triangle_masks);
  }

  QueryKernel& kernel(ListForm form, bool) override {
    const std::uint32_t kind = form == ListForm::Numbers ? LISTS_NONE
                               : form == ListForm::Rows  ? LISTS_ROWS
                                                         : LISTS_PLACES;
    const std::uint32_t records = form == ListForm::Rows || form == ListForm::Rest ? row() : 0;
    const SpecConstants constants = kind ? SpecConstants{{SPEC_ROW, records}} : SpecConstants{};
    const bool masks = query_.masks != nullptr;
    DeviceTree& tree = parts_.whole.tree();
    QueryKernel& kernel =
        parts_.within
            .try_emplace({masks, kind, records}, parts_.gpu, tree, "within",
                         Defines{{"BALLOT_LISTS", int(kind)}, {"BALLOT_MASKS", masks}}, false, constants)
            .first->second;
    kernel.prepare();
    if (masks) parts_.within_masks.bind_triangles(kernel);
    if (masks && form == ListForm::Rest) parts_.within_masks.bind_again(kernel);
    if (tree.forest()) {
      parts_.whole_instances.update(parts_.gpu, tree, kernel.fetch());
      kernel.bind(BIND_POINT_INSTANCES, parts_.whole_instances.device());
    }
    return kernel;
  }
  std::vector<TreePiece> pieces(std::uint64_t limit) override { return kernel(ListForm::Numbers, true).pieces(limit); }
  TreePiece whole() override { return {parts_.whole.tree().root()}; }
  bool order(std::span<const ProbePoint> points, std::vector<std::uint32_t>& order) override {
    order_points(points, parts_.whole.tree().bvh().bounds, order);
    return true;
  }
  std::vector<std::uint32_t> masks(std::uint64_t first, std::size_t count) override {
    std::vector<std::uint32_t> masks(query_.masks ? count : 0);
    if (query_.masks) query_.masks(first, masks);
    return masks;
  }
  void bind_masks(QueryKernel& kernel, std::size_t points, std::span<const std::uint32_t> masks, bool apart) override {
    if (query_.masks) parts_.within_masks.bind(kernel, points, masks, apart);
  }
  void bind_masks_there(QueryKernel& kernel, std::uint64_t first, std::size_t count) override {
    if (query_.masks) parts_.within_masks.bind_there(kernel, masks_there_, first, count);
  }

 private:
  Parts& parts_;
  const PointQuery& query_;
  const Buffer<std::uint32_t>* masks_there_;
};

namespace {

void refuse_exact(const PointQuery& query) {
  if (query.exact)
    fail(Failure::Arguments,
         "triangles within a radius: found mode exact; expected mode watertight: distances are computed in float32");
}

}  // namespace

TraceTimes PointQueries::within(const InsideStream& stream, const TakeWithin& take, const PointQuery& query) {
  refuse_exact(query);
  Parts::WithinLists kind(*parts_, query);
  ListAnswerer<ProbePoint, Within> answerer(parts_->gpu, kind, parts_->lists);
  InsideStream asked = stream;
  asked.in_place = {};
  asked.take = [&](std::uint64_t first, std::span<const std::uint32_t> counts) {
    take(first, counts, answerer.records());
  };
  TraceTimes times = StreamRing::of(parts_->gpu).run(asked, answerer);
  times += answerer.again();
  return times;
}

DeviceListed PointQueries::within(const DevicePoints& there, const DeviceLists<Within>& to, const PointQuery& query) {
  refuse_exact(query);
  check_there(there.points.size(), "points", to, there.count);
  if (there.masks) check_there(there.masks->size(), there.count, "lists", "masks");
  DeviceListed listed;
  PointQuery asked = query;
  asked.masks = {};
  if (there.masks)
    asked.masks = [&](std::uint64_t first, std::span<std::uint32_t> room) {
      there.masks->download(room, std::size_t(first));
    };
  if (there.count > 0 && !StreamRing::of(parts_->gpu).is_alone()) {
    Parts::WithinLists kind(*parts_, asked, there.masks);
    const PassScope scope(parts_->gpu);
    ListsThere lists(parts_->gpu, kind, parts_->lists, there.points, there.count, listed.times);
    if (const auto all = lists.list(to)) return listed.records = *all, listed;
  }
  DeviceListsSink<Within> sink(to);
  InsideStream stream{.most = there.count};
  stream.next = [&](std::uint64_t first, std::span<ProbePoint> room) {
    there.points.download(room, std::size_t(first));
    return room.size();
  };
  const auto take = [&](std::uint64_t first, std::span<const std::uint32_t> counts, std::span<const Within> found) {
    sink.take(first, counts, found);
  };
  listed.times = within(stream, take, asked);
  listed.records = sink.sum();
  return listed;
}

DeviceListed PointQueries::within(const DevicePoints& there, const DeviceLists<Hit>& to, const PointQuery& query) {
  if (!to.records) return within(there, DeviceLists<Within>{to.counts, to.offsets}, query);
  Parts& parts = *parts_;
  auto& found = buffer_for(parts.some_within, parts.gpu, to.records->size(), "triangles within a radius");
  DeviceListed listed = within(there, DeviceLists<Within>{to.counts, to.offsets, &found}, query);
  const auto all = std::uint32_t(std::min<std::uint64_t>(listed.records, to.records->size()));
  refresh(parts.gpu, parts.lists.widen, pick_source(true));
  parts.lists.widen->bind(BIND_ROWS, found);
  parts.lists.widen->bind(BIND_RECORDS, *to.records);
  constexpr std::uint32_t kGroups = 1024;
  parts.gpu.submit(parts.lists.widen->name(), [&](Commands& cmd) {
    parts.lists.widen->dispatch(cmd, kGroups, PickPush{all, 0, 0});
  });
  listed.times.device_ms += parts.gpu.last_ms();
  ++listed.times.dispatches;
  return listed;
}

}  // namespace ballot
