// Tracing in Python: at once and in the background, over arrays in the host's memory.
#include <chrono>
#include <thread>

#include "query.h"
#include "sources.h"

namespace ballot::python {

namespace {

using Clock = std::chrono::steady_clock;

TimesTuple trace(const SceneObject& self, const Objects& source, const ResultArrays& results, const QueryObject& asked,
                 nb::object progress) {
  const Source from(source);
  const BallotRays rays = from.rays();
  const BallotHits hits = detail::hits_of(results.results(from.count()));
  return watched(
      self.use(), std::move(progress),
      [=, query = asked.query, kept = std::pair(from, results)](const Scene& s, Watch& watch) mutable {
        query.progress = [&watch](double done) { return watch(done); };
        const detail::QueryArgument argument(query);
        auto times = BALLOT_INIT(BallotTimes);
        check(ballot_trace(s.handle(), &rays, &hits, argument.c(), &times));
        return tuple_of(detail::times_of(times));
      },
      from.count() <= kFew);
}

/// A trace in the background. Keeps its arrays.
struct JobObject : Kept<Job> {
  JobObject(std::shared_ptr<Job> job, nb::object arrays) : Kept("job", std::move(job), std::move(arrays)) {}
};

JobObject submit(const SceneObject& self, const Objects& source, const ResultArrays& results, const QueryObject& asked,
                 nb::object arrays) {
  const Source from(source);
  const BallotRays rays = from.rays();
  const BallotHits hits = detail::hits_of(results.results(from.count()));
  const detail::QueryArgument argument(asked.query);
  std::shared_ptr<Job> job = without_gil(self.use(), [&](const Scene& s) {
    BallotJob* submitted = nullptr;
    check(ballot_submit(s.handle(), &rays, &hits, argument.c(), &submitted));
    return std::make_shared<Job>(submitted);
  });
  return {std::move(job), std::move(arrays)};
}

/// Waits in short naps, so that Ctrl-C is noticed: a call that waits for the end returns to Python only then.
TimesTuple wait(const JobObject& self) {
  const auto begin = Clock::now();
  while (!without_gil(self.use(), [&](const Job& job) {
    if (job.poll()) return true;
    std::this_thread::sleep_for(std::min<Clock::duration>((Clock::now() - begin) / 16, std::chrono::milliseconds(20)));
    return job.poll();
  }))
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
  return without_gil(self.use(), [](Job& job) { return tuple_of(job.wait()); });
}

}  // namespace

void bind_traces(nb::module_& m, nb::class_<SceneObject>& scene) {
  nb::class_<QueryObject>(m, "Query")
      .def("__init__", [](QueryObject* self, bool any, std::string method, std::string numeric,
                          const std::vector<std::tuple<std::string, std::string>>& knobs, std::string ray_class) {
        Query q{.any = any, .method = std::move(method), .numeric = std::move(numeric)};
        for (const auto& [name, value] : knobs) q.knobs[name] = value;
        q.ray_class = std::move(ray_class);
        new (self) QueryObject{std::move(q)};
      });
  nb::class_<ResultArrays>(m, "Results")
      .def(nb::init<ResultArrays::Column<float>, ResultArrays::Column<float>, ResultArrays::Column<std::uint32_t>,
                    ResultArrays::Column<std::uint32_t>, ResultArrays::Column<float>, ResultArrays::Column<float>,
                    ResultArrays::Column<std::uint8_t>, ResultArrays::Column<std::uint32_t>>(),
           nb::arg("hits").noconvert().none() = nb::none(), nb::arg("t").noconvert().none() = nb::none(),
           nb::arg("prims").noconvert().none() = nb::none(), nb::arg("mesh_ids").noconvert().none() = nb::none(),
           nb::arg("uvs").noconvert().none() = nb::none(), nb::arg("normals").noconvert().none() = nb::none(),
           nb::arg("occluded").noconvert().none() = nb::none(), nb::arg("instances").noconvert().none() = nb::none());
  nb::class_<JobObject>(m, "Job").def("wait", &wait).def("poll", [](const JobObject& self) {
    return without_gil(self.use(), [](const Job& job) { return job.poll(); });
  });
  scene.def("trace", &trace, nb::arg("source"), nb::arg("results"), nb::arg("query"), nb::arg("progress").none());
  scene.def("submit", &submit, nb::arg("source"), nb::arg("results"), nb::arg("query"), nb::arg("arrays"));
}

}  // namespace ballot::python
