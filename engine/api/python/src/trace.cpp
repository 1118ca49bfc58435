// Tracing in Python: at once and in the background, over arrays in the host's memory.
#include <chrono>
#include <thread>

#include "query.h"

namespace ballot::python {

namespace {

using RayRows = nb::ndarray<const float, nb::ndim<2>, nb::device::cpu>;
using Clock = std::chrono::steady_clock;

/// Describes an array of rays: rows of 8 or 6 numbers side by side.
BallotRays rays_of(const RayRows& array) {
  if (array.shape(1) != 8 && array.shape(1) != 6)
    throw Error(Code::Argument, "rays: rows of " + std::to_string(array.shape(1)) + " numbers; expected 8 or 6");
  if (array.stride(1) != 1 || (array.shape(0) > 1 && array.stride(0) < std::int64_t(array.shape(1))))
    throw Error(Code::Argument, "rays: the numbers of a row must lie side by side, and rows must not overlap");
  auto rays = BALLOT_INIT(BallotRays);
  rays.data = array.data();
  rays.count = array.shape(0);
  rays.stride = rays.count > 1 ? std::size_t(array.stride(0)) * sizeof(float) : 0;
  rays.format = array.shape(1) == 8 ? BALLOT_RAYS_FULL : BALLOT_RAYS_UNBOUNDED;
  return rays;
}

TimesTuple trace(const SceneObject& self, const RayRows& array, const ResultArrays& results, const QueryObject& asked,
                 nb::object progress) {
  const BallotRays rays = rays_of(array);
  const BallotHits hits = detail::hits_of(results.results(rays.count));
  return watched(self.use(), std::move(progress),
                 [=, query = asked.query, kept = std::pair(array, results)](const Scene& s, Watch& watch) mutable {
                   query.progress = [&watch](double done) { return watch(done); };
                   const detail::QueryArgument argument(query);
                   auto times = BALLOT_INIT(BallotTimes);
                   check(ballot_trace(s.handle(), &rays, &hits, argument.c(), &times));
                   return tuple_of(detail::times_of(times));
                 });
}

/// A trace in the background. Keeps its arrays.
struct JobObject : Kept<Job> {
  JobObject(std::shared_ptr<Job> job, nb::object arrays) : Kept("job", std::move(job), std::move(arrays)) {}
};

JobObject submit(const SceneObject& self, const RayRows& array, const ResultArrays& results, const QueryObject& asked,
                 nb::object arrays) {
  const BallotRays rays = rays_of(array);
  const BallotHits hits = detail::hits_of(results.results(rays.count));
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
  scene.def("trace", &trace, nb::arg("rays").noconvert(), nb::arg("results"), nb::arg("query"),
            nb::arg("progress").none());
  scene.def("submit", &submit, nb::arg("rays").noconvert(), nb::arg("results"), nb::arg("query"), nb::arg("arrays"));
}

}  // namespace ballot::python
