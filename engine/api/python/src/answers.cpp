// Questions in Python, over arrays of the host or the device: answered at once or in the background.
#include <algorithm>
#include <chrono>
#include <thread>

#include "door.h"
#include "sources.h"

namespace ballot::python {

namespace {

using Clock = std::chrono::steady_clock;
using Query = Options<BallotQuery>;

Query query_of(const ObjectDict& options) { return {options, door::kQueryRows}; }

/// Runs call(scene, query, times), which asks the library, as a task, and returns the times. The call has to own what
/// it uses.
template <class Call>
Objects answered(const SceneObject& self, nb::object progress, const Query& query, bool short_, Call call) {
  const Times times = watched(
      self.use(), std::move(progress),
      [=](const Scene& s, Watch& watch) {
        BallotQuery asked = query.c;
        asked.progress = watch;
        Times spent;
        check(call(s.handle(), &asked, &spent));
        return spent;
      },
      short_);
  return tuple_of(&times, door::kTimesRows);
}

/// Returns how many hits a query has of each ray.
std::uint32_t hits_of_each(const BallotQuery& q) { return std::max({q.first, q.last, q.strongest, 1u}); }

Objects trace(const SceneObject& self, const Objects& source, const ObjectDict& columns, const ObjectDict& options,
              nb::object progress) {
  const Source from(source);
  const Query query = query_of(options);
  const Columns<BallotHits> to(columns, door::kHitRows, from.count() * hits_of_each(query.c));
  return answered(self, std::move(progress), query, from.count() <= kFew, [=](auto* scene, auto* asked, auto* times) {
    const BallotRays rays = from.rays();
    return ballot_trace(scene, &rays, &to.c, asked, times);
  });
}

Objects nearest(const SceneObject& self, const Objects& source, const ObjectDict& columns, const ObjectDict& options,
                nb::object progress) {
  const Source from(source);
  const Columns<BallotNearest> to(columns, door::kNearestRows, from.count());
  return answered(self, std::move(progress), query_of(options), from.count() <= kFew,
                  [=](auto* scene, auto* asked, auto* times) {
                    const BallotPoints points = from.points();
                    return ballot_query_points(scene, &points, &to.c, asked, times);
                  });
}

Objects clearance(const SceneObject& self, const SceneObject& other, const Objects& source, const ObjectDict& columns,
                  nb::object progress) {
  const Source from(source);
  const Columns<BallotClearance> to(columns, door::kClearanceRows, from.count());
  return answered(self, std::move(progress), query_of({}), false,
                  [=, second = other.use()](auto* scene, auto* asked, auto* times) {
                    const BallotPoses poses = from.poses();
                    return ballot_clearance(scene, second->handle(), &poses, &to.c, asked, times);
                  });
}

/// What a list has taken so far.
struct Listed {
  ResultBlock block;      // t, prim (its bits), u, v of each
  std::size_t bytes = 0;  // of these

  static int take(void* user, std::uint64_t, std::size_t questions, const std::uint32_t* counts,
                  const BallotHit* hits) {
    auto& self = *static_cast<Listed*>(user);
    std::size_t total = 0;
    for (std::size_t i = 0; i < questions; ++i) total += counts[i];
    const std::size_t more = total * sizeof(BallotHit);
    self.block.make_room(self.bytes + more, self.bytes);
    copy_memory(static_cast<std::byte*>(self.block.data()) + self.bytes, hits, more);
    self.bytes += more;
    return 0;
  }
  /// Returns the numbers of the hits. Few are copied, so that they hold no large block.
  auto array() && {
    const std::size_t numbers = bytes / sizeof(float);
    auto* first = static_cast<float*>(block.data());
    if (bytes < (std::size_t(1) << 20)) return array_of(std::vector<float>(first, first + numbers), {numbers});
    return nb::ndarray<nb::numpy, float>(first, {numbers}, std::move(block).owner());
  }
};

using Counts = nb::ndarray<std::int64_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

/// Writes the counts and returns (numbers of the hits, times). `what` is listed: "crossings" of rays, the triangles
/// "within" limits of points, or those "overlapping" boxes. Without `lists` they are only counted.
Objects list(const SceneObject& self, const Objects& source, const std::string& what, bool lists, const Counts& counts,
             const ObjectDict& options, nb::object progress) {
  const Source from(source);
  if (counts.size() != from.count())
    throw Error(BALLOT_ERROR_ARGUMENT,
                "counts has " + std::to_string(counts.size()) + " numbers; expected " + std::to_string(from.count()));
  const auto found = std::make_shared<Listed>();
  const nb::tuple times =
      answered(self, std::move(progress), query_of(options), false, [=](auto* scene, auto* asked, auto* spent) {
        BallotLists to{.counts = counts.data(), .user = found.get()};
        if (lists) to.take = &Listed::take;
        if (what == "overlapping") {
          const BallotBoxes boxes = from.boxes();
          return ballot_list_overlapping(scene, &boxes, &to, asked, spent);
        }
        if (what == "within") {
          const BallotPoints points = from.points();
          return ballot_list_within(scene, &points, &to, asked, spent);
        }
        const BallotRays rays = from.rays();
        return ballot_list_crossings(scene, &rays, &to, asked, spent);
      });
  return nb::make_tuple(std::move(*found).array(), times);
}

/// A trace in the background. Keeps its arrays.
struct JobObject : Kept<Job> {
  JobObject(std::shared_ptr<Job> job, nb::object arrays) : Kept("job", std::move(job), std::move(arrays)) {}
};

JobObject submit(const SceneObject& self, const Objects& source, const ObjectDict& columns, const ObjectDict& options,
                 nb::object arrays) {
  const Source from(source);
  const Query query = query_of(options);
  const Columns<BallotHits> to(columns, door::kHitRows, from.count() * hits_of_each(query.c));
  const BallotRays rays = from.rays();
  std::shared_ptr<Job> job = without_gil(self.use(), [&](const Scene& s) {
    BallotJob* submitted = nullptr;
    check(ballot_submit(s.handle(), &rays, &to.c, &query.c, &submitted));
    return std::make_shared<Job>(submitted);
  });
  return {std::move(job), std::move(arrays)};
}

/// Waits in short naps, so that Ctrl-C is noticed: a call that waits for the end returns to Python only then.
Objects wait(const JobObject& self) {
  const auto begin = Clock::now();
  while (!without_gil(self.use(), [&](const Job& job) {
    if (job.poll()) return true;
    std::this_thread::sleep_for(std::min<Clock::duration>((Clock::now() - begin) / 16, std::chrono::milliseconds(20)));
    return job.poll();
  }))
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
  const Times times = without_gil(self.use(), [](Job& job) { return job.wait(); });
  return tuple_of(&times, door::kTimesRows);
}

/// Columns of answers that go to arrays on the device, by their names. Keeps the arrays.
struct Outputs {
  explicit Outputs(const ObjectDict& columns) {
    for (const auto [name, array] : columns) {
      names.push_back(nb::cast<std::string>(name));
      arrays.push_back(nb::cast<const ArrayObject&>(array).use());
    }
  }
  std::vector<BallotOutput> c() const {
    std::vector<BallotOutput> all;
    for (std::size_t i = 0; i < names.size(); ++i) all.push_back({names[i].c_str(), arrays[i]->get()});
    return all;
  }
  std::vector<std::string> names;
  std::vector<std::shared_ptr<Buffer>> arrays;
};

std::shared_ptr<Buffer> use(const ArrayObject* array) { return array ? array->use() : nullptr; }
BallotBuffer* handle_of(const std::shared_ptr<Buffer>& buffer) { return buffer ? buffer->get() : nullptr; }

/// Words of questions on the device that filters read; each may be none. Keeps the arrays.
struct Words {
  Words(const ArrayObject* m, const ArrayObject* e, const ArrayObject* g)
      : masks(use(m)), excluded(use(e)), groups(use(g)) {}
  void set(BallotQuery& query) const {
    query.masks = handle_of(masks), query.excluded = handle_of(excluded), query.groups = handle_of(groups);
  }
  std::shared_ptr<Buffer> masks, excluded, groups;
};

/// Answers the first `count` questions of an array on the device by ask(scene, array, count, outputs, their number,
/// query, times).
template <auto kAsk>
Objects answered_there(const SceneObject& self, const ArrayObject& asked, std::uint64_t count,
                       const ObjectDict& columns, const ObjectDict& options, nb::object progress,
                       const ArrayObject* masks, const ArrayObject* excluded, const ArrayObject* groups,
                       const ArrayObject* weights) {
  return answered(self, std::move(progress), query_of(options), false,
                  [=, from = asked.use(), to = Outputs(columns), words = Words(masks, excluded, groups),
                   numbers = use(weights)](auto* scene, auto* query, auto* times) {
                    words.set(*query), query->weights = handle_of(numbers);
                    const std::vector<BallotOutput> outputs = to.c();
                    return kAsk(scene, from->get(), count, outputs.data(), outputs.size(), query, times);
                  });
}

/// Lists what is found for questions on the device, to arrays of which some may be None. Returns (number of all,
/// times).
Objects list_there(const SceneObject& self, const ArrayObject& asked, std::uint64_t count, const ArrayObject* counts,
                   const ArrayObject* offsets, const ArrayObject* hits, const ObjectDict& options, nb::object progress,
                   const ArrayObject* masks, const ArrayObject* excluded, const ArrayObject* groups) {
  const auto total = std::make_shared<std::uint64_t>(0);
  const nb::tuple times =
      answered(self, std::move(progress), query_of(options), false,
               [=, from = asked.use(), a = use(counts), b = use(offsets), c = use(hits),
                words = Words(masks, excluded, groups)](auto* scene, auto* query, auto* spent) {
                 words.set(*query);
                 BallotListBuffers to;
                 to.counts = handle_of(a), to.offsets = handle_of(b), to.hits = handle_of(c);
                 return ballot_list_buffers(scene, from->get(), count, &to, query, total.get(), spent);
               });
  return nb::make_tuple(*total, times);
}

std::uint64_t compact(const SceneObject& self, const ArrayObject& hits, std::uint64_t count, std::uint32_t first,
                      const ArrayObject& alone, const ArrayObject& rays) {
  return watched(self.use(), nb::none(),
                 [=, all = hits.use(), some = alone.use(), of = rays.use()](const Scene& s, Watch&) {
                   std::uint64_t found = 0;
                   check(ballot_compact_hits(s.handle(), all->get(), count, first, some->get(), of->get(), &found));
                   return found;
                 });
}

}  // namespace

void bind_answers(nb::module_& m, nb::class_<SceneObject>& scene) {
  nb::class_<JobObject>(m, "Job").def("wait", &wait).def("poll", [](const JobObject& self) {
    return without_gil(self.use(), [](const Job& job) { return job.poll(); });
  });
  const auto progress = nb::arg("progress").none();
  scene.def("trace", &trace, nb::arg("source"), nb::arg("columns"), nb::arg("options"), progress)
      .def("nearest", &nearest, nb::arg("source"), nb::arg("columns"), nb::arg("options"), progress)
      .def("clearance", &clearance, nb::arg("other"), nb::arg("source"), nb::arg("columns"), progress)
      .def("list", &list, nb::arg("source"), nb::arg("what"), nb::arg("lists"), nb::arg("counts").noconvert(),
           nb::arg("options"), progress)
      .def("submit", &submit, nb::arg("source"), nb::arg("columns"), nb::arg("options"), nb::arg("arrays"))
      .def("trace_there", &answered_there<ballot_trace_buffers>, nb::arg("rays"), nb::arg("count"), nb::arg("columns"),
           nb::arg("options"), progress, nb::arg("masks").none() = nb::none(), nb::arg("excluded").none() = nb::none(),
           nb::arg("groups").none() = nb::none(), nb::arg("weights").none() = nb::none())
      .def("nearest_there", &answered_there<ballot_query_point_buffers>, nb::arg("points"), nb::arg("count"),
           nb::arg("columns"), nb::arg("options"), progress, nb::arg("masks").none() = nb::none(),
           nb::arg("excluded").none() = nb::none(), nb::arg("groups").none() = nb::none(),
           nb::arg("weights").none() = nb::none())
      .def("list_there", &list_there, nb::arg("questions"), nb::arg("count"), nb::arg("counts").none(),
           nb::arg("offsets").none(), nb::arg("hits").none(), nb::arg("options"), progress,
           nb::arg("masks").none() = nb::none(), nb::arg("excluded").none() = nb::none(),
           nb::arg("groups").none() = nb::none())
      .def("compact", &compact, nb::arg("hits"), nb::arg("count"), nb::arg("first"), nb::arg("alone"), nb::arg("rays"));
}

}  // namespace ballot::python
