// Queries of points, and of all crossings of rays, in Python.
#include "query.h"
#include "sources.h"

namespace ballot::python {

namespace {

template <class T>
using Out = std::optional<nb::ndarray<T, nb::ndim<1>, nb::c_contig, nb::device::cpu>>;

template <class T>
T* room(const Out<T>& array, std::size_t expected, const char* name) {
  if (!array) return nullptr;
  if (array->size() != expected)
    throw Error(Code::Argument, std::string(name) + " has " + std::to_string(array->size()) + " numbers; expected " +
                                    std::to_string(expected));
  return array->data();
}

TimesTuple query_points(const SceneObject& self, const Objects& source, bool assume_closed, nb::object progress,
                        const std::string& numeric, std::uint32_t sign, const Out<float>& distances,
                        const Out<float>& points, const Out<std::uint32_t>& prims, const Out<std::uint32_t>& mesh_ids,
                        const Out<float>& uvs, const Out<float>& normals, const Out<float>& signed_distances,
                        const Out<std::uint8_t>& inside) {
  const Source array(source);
  const BallotPoints from = array.points();
  const std::size_t n = array.count();
  auto to = BALLOT_INIT(BallotNearest);
  to.distances = room(distances, n, "distances");
  to.points = room(points, 3 * n, "points");
  to.prims = room(prims, n, "prims");
  to.mesh_ids = room(mesh_ids, n, "mesh_ids");
  to.uvs = room(uvs, 2 * n, "uvs");
  to.normals = room(normals, 3 * n, "normals");
  to.signed_distances = room(signed_distances, n, "signed_distances");
  to.inside = room(inside, n, "inside");
  const std::tuple kept(array, distances, points, prims, mesh_ids, uvs, normals, signed_distances, inside);
  const PointQuery given{.assume_closed = assume_closed, .numeric = numeric, .sign = Sign(sign)};
  return watched(
      self.use(), std::move(progress),
      [=, query = given](const Scene& s, Watch& watch) mutable {
        static_cast<void>(kept);
        query.progress = [&watch](double done) { return watch(done); };
        const BallotPointQuery asked = detail::point_query_of(query);
        auto times = BALLOT_INIT(BallotTimes);
        check(ballot_query_points(s.handle(), &from, &to, &asked, &times));
        return tuple_of(detail::times_of(times));
      },
      n <= kFew && !signed_distances && !inside);
}

/// What a list of crossings has taken so far.
struct Crossings {
  ResultBlock block;      // t, prim (its bits), u, v of each
  std::size_t bytes = 0;  // of these
  Watch* watch = nullptr;
  Times times = {};

  static int take(void* user, std::uint64_t, std::size_t rays, const std::uint32_t* counts, const BallotHit* hits) {
    auto& self = *static_cast<Crossings*>(user);
    std::size_t total = 0;
    for (std::size_t i = 0; i < rays; ++i) total += counts[i];
    const std::size_t more = total * sizeof(BallotHit);
    self.block.make_room(self.bytes + more, self.bytes);
    if (more) std::memcpy(static_cast<std::byte*>(self.block.data()) + self.bytes, hits, more);
    self.bytes += more;
    return 0;
  }
  /// Returns the numbers of the hits. Few are copied, so that they hold no large block.
  auto array() && {
    const std::size_t numbers = bytes / sizeof(float);
    const auto* first = static_cast<const float*>(block.data());
    if (bytes < (std::size_t(1) << 20)) return array_of(std::vector<float>(first, first + numbers), {numbers});
    return nb::ndarray<nb::numpy, float>(block.data(), {numbers}, std::move(block).owner());
  }
  static int progress(void* user, double done) { return int(!(*static_cast<Crossings*>(user)->watch)(done)); }
};

using Masks = std::optional<nb::ndarray<const std::uint32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>>;
using Counts = nb::ndarray<std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

/// Writes the counts and returns (numbers of the hits, times).
Objects list_crossings(const SceneObject& self, const Objects& source, std::uint32_t most, bool lists,
                       nb::object progress, const std::string& numeric, std::uint32_t cull, const Masks& ray_masks,
                       bool alpha, const Counts& counts) {
  const Source array(source);
  const BallotRays rays = array.rays();
  const std::size_t count = array.count();
  if (ray_masks && ray_masks->size() != count)
    throw Error(Code::Argument,
                "ray_masks has " + std::to_string(ray_masks->size()) + " numbers; expected " + std::to_string(count));
  if (counts.size() != count)
    throw Error(Code::Argument,
                "counts has " + std::to_string(counts.size()) + " numbers; expected " + std::to_string(count));
  Crossings all = watched(self.use(), std::move(progress), [=](const Scene& s, Watch& watch) {
    static_cast<void>(array);  // kept, as is what the other pointers lead to
    Crossings found;
    found.watch = &watch;
    auto to = BALLOT_INIT(BallotLists);
    to.most = most;
    to.numeric = numeric.c_str();
    to.cull = cull;
    to.alpha = alpha;
    if (ray_masks) to.ray_masks = ray_masks->data();
    to.user = &found;
    to.progress = &Crossings::progress;
    if (lists) to.take = &Crossings::take;
    to.counts = counts.data();
    auto times = BALLOT_INIT(BallotTimes);
    check(ballot_list_crossings(s.handle(), &rays, &to, &times));
    found.times = detail::times_of(times);
    return found;
  });
  const TimesTuple times = tuple_of(all.times);
  return nb::make_tuple(std::move(all).array(), times);
}

}  // namespace

void bind_points(nb::class_<SceneObject>& scene) {
  const auto none = [](const char* name) { return nb::arg(name).noconvert().none() = nb::none(); };
  scene.def("query_points", &query_points, nb::arg("source"), nb::arg("assume_closed"), nb::arg("progress").none(),
            nb::arg("numeric"), nb::arg("sign"), none("distances"), none("nearest"), none("prims"), none("mesh_ids"),
            none("uvs"), none("normals"), none("signed_distances"), none("inside"));
  scene.def("list_crossings", &list_crossings, nb::arg("source"), nb::arg("most"), nb::arg("lists"),
            nb::arg("progress").none(), nb::arg("numeric"), nb::arg("cull"), nb::arg("ray_masks").noconvert().none(),
            nb::arg("alpha"), nb::arg("counts").noconvert());
}

}  // namespace ballot::python
