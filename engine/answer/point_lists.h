// Lists of triangles near points and in boxes. Internal to engine/answer.
#pragma once

#include "engine/answer/list_there.h"
#include "engine/answer/point_parts.h"

namespace ballot {

/// Lists of triangles, each of which lies in one leaf of the tree, by a kernel of shaders/query.
template <class Question>
class PointQueries::Parts::TriangleLists : public ListKind<Question, Within> {
 public:
  /// Keeps references to all but the words' arrays.
  TriangleLists(Parts& parts, const char* name, const PointQuery& query, const DeviceFilters& words_there = {})
      : parts_(parts), name_(name), query_(query), words_there_(words_there) {
    filters_ = parts.within_filters.take(parts.whole_tree(), query.filters.bits(), query.triangle_masks);
  }

  QueryKernel& kernel(ListForm form, bool) override {
    const std::uint32_t kind = form == ListForm::Numbers ? LISTS_NONE
                               : form == ListForm::Rows  ? LISTS_ROWS
                                                         : LISTS_PLACES;
    const std::uint32_t records = form == ListForm::Rows || form == ListForm::Rest ? this->row() : 0;
    const SpecConstants constants = kind ? SpecConstants{{SPEC_ROW, records}} : SpecConstants{};
    DeviceTree& tree = parts_.whole.tree();
    QueryKernel& kernel =
        parts_.lists_by[name_]
            .try_emplace({filters_, kind, records}, parts_.gpu, tree, name_,
                         Defines{{"BALLOT_LISTS", int(kind)}, {"BALLOT_FILTERS", int(filters_)}}, false, constants)
            .first->second;
    kernel.prepare();
    parts_.within_filters.bind_scene(kernel);
    if (form == ListForm::Rest) parts_.within_filters.bind_again(kernel);
    if (tree.forest()) {
      parts_.whole_instances.update(parts_.gpu, tree, kernel.fetch());
      kernel.bind(BIND_POINT_INSTANCES, parts_.whole_instances.device());
    }
    return kernel;
  }
  std::vector<TreePiece> pieces(std::uint64_t limit) override { return kernel(ListForm::Numbers, true).pieces(limit); }
  TreePiece whole() override { return {parts_.whole.tree().root()}; }
  FilterWords words(std::uint64_t first, std::size_t count) override { return query_.filters.read(first, count); }
  void bind_words(QueryKernel& kernel, std::size_t points, const FilterWords& words, bool apart) override {
    parts_.within_filters.bind(kernel, points, words, apart);
  }
  void bind_words_there(QueryKernel& kernel, std::uint64_t first, std::size_t count) override {
    parts_.within_filters.bind_there(kernel, words_there_, first, count);
  }

 protected:
  Parts& parts_;
  const char* name_;
  const PointQuery& query_;

 private:
  DeviceFilters words_there_;
  std::uint32_t filters_ = 0;  // of kernels
};

/// Lists triangles for a stream of questions.
template <class Question>
TraceTimes PointQueries::Parts::list(TriangleLists<Question>& kind, ListRooms<Question, Within>& rooms,
                                     const Stream<Question, std::uint32_t>& stream, const TakeWithin& take) {
  ListAnswerer<Question, Within> answerer(gpu, kind, rooms);
  Stream<Question, std::uint32_t> asked = stream;
  asked.in_place = {};
  asked.take = [&](std::uint64_t first, std::span<const std::uint32_t> counts) {
    take(first, counts, answerer.records());
  };
  TraceTimes times = StreamRing::of(gpu).run(asked, answerer);
  times += answerer.again();
  return times;
}

}  // namespace ballot
