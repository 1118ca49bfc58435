// Crossings as a kind of list. Internal to engine/answer.
#pragma once

#include "engine/answer/ray_parts.h"

namespace ballot {

/// The crossings of rays. Of few first ones a row holds all, in order, but for mode exact.
class RayQueries::Parts::Crossings : public ListKind<Ray, Hit> {
 public:
  Crossings(Parts& parts, const RaySource& source, const DeviceFilters& words_there = {})
      : parts_(parts),
        source_(source),
        words_there_(words_there),
        first_(parts.query.most <= ray_queries::kMostFirst ? parts.query.most : 0) {}

  std::uint32_t row() const override {
    return has_rest() ? std::max(ray_queries::kRow, first_ + ray_queries::kRow / 2) : first_;
  }
  bool has_rest() const override { return first_ == 0 || parts_.query.exact; }
  std::uint32_t most() const override { return parts_.query.most; }
  QueryKernel& kernel(ListForm form, bool pieces) override {
    CrossingVariant v = parts_.variant;
    if (!pieces) v.first = first_;
    v.last = v.first && parts_.query.last;
    v.any = parts_.query.any && form == ListForm::Rows && row() == 1;
    if (form == ListForm::Rows) v.lists = LISTS_ROWS, v.row = row();
    if (form == ListForm::Rest) v.lists = LISTS_PLACES, v.row = row();
    if (form == ListForm::Apart) v.lists = LISTS_PLACES;
    QueryKernel& made = parts_.kernels.kernel(v, pieces);
    if (form == ListForm::Rest) parts_.kernels.filters().bind_again(made);
    return made;
  }
  std::vector<TreePiece> pieces(std::uint64_t limit) override { return parts_.kernels.pieces(parts_.variant, limit); }
  TreePiece whole() override { return {parts_.kernels.tree().root()}; }
  bool order(std::span<const Ray> rays, std::vector<std::uint32_t>& order) override {
    return order_rays(rays, parts_.kernels.tree().bvh().bounds, order);
  }
  FilterWords words(std::uint64_t first, std::size_t count) override { return source_.filters.read(first, count); }
  void bind_words(QueryKernel& kernel, std::size_t rays, const FilterWords& words, bool apart) override {
    parts_.kernels.filters().bind(kernel, rays, words, apart);
  }
  void bind_words_there(QueryKernel& kernel, std::uint64_t first, std::size_t count) override {
    parts_.kernels.filters().bind_there(kernel, words_there_, first, count);
  }
  std::vector<std::vector<Hit>> settle(const RayPart& rays) override { return parts_.exact_lists->lists(rays); }
  bool reorders() const override { return parts_.query.exact; }
  void put_in_order(const Ray& ray, std::vector<Hit>& hits) const override {
    if (parts_.query.exact) return parts_.exact_lists->put_in_order(ray, hits);
    if (!parts_.query.last) return ListKind::put_in_order(ray, hits);
    std::ranges::sort(hits, [](const Hit& a, const Hit& b) { return a.t != b.t ? a.t > b.t : a.prim < b.prim; });
  }

 private:
  Parts& parts_;
  const RaySource& source_;
  DeviceFilters words_there_;
  std::uint32_t first_;  // crossings that are looked for; 0: all
};

}  // namespace ballot
