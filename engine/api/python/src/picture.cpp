// Rays and pictures of a view, in Python.
#include "common.h"
#include "query.h"

namespace ballot::python {

namespace {

/// (name, eye, target, up, yfov, ymag)
using ViewTuple = std::tuple<std::string, std::tuple<double, double, double>, std::tuple<double, double, double>,
                             std::tuple<double, double, double>, double, double>;

View view_of(const ViewTuple& given) {
  const auto& [name, eye, target, up, yfov, ymag] = given;
  View view{.name = name, .yfov = yfov, .ymag = ymag};
  const auto copy = [](const std::tuple<double, double, double>& from, double(&to)[3]) {
    std::tie(to[0], to[1], to[2]) = from;
  };
  copy(eye, view.eye), copy(target, view.target), copy(up, view.up);
  return view;
}

auto make_rays(const SceneObject& self, const ViewTuple& view, const std::string& kind, std::uint32_t width,
               std::uint32_t height) {
  std::vector<Ray> rays = watched(
      self.use(), nb::none(), [=](const Scene& s, Watch&) { return s.make_rays(view_of(view), kind, width, height); });
  const std::size_t count = rays.size();
  return array_of(std::move(rays), {count, 8});
}

/// (width, height, samples, shading, sky, bounces, seed)
using PictureTuple =
    std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::string, std::string, std::int32_t, std::uint32_t>;

auto render(const SceneObject& self, const ViewTuple& view, const PictureTuple& given, const QueryObject& asked,
            nb::object progress) {
  Picture picture;
  std::tie(picture.width, picture.height, picture.samples, picture.shading, picture.sky, picture.bounces,
           picture.seed) = given;
  if (picture.samples == 0) throw Error(Code::Argument, "samples is 0; expected 1 to 65536");
  std::vector<float> rgba =
      watched(self.use(), std::move(progress), [=, query = asked.query](const Scene& s, Watch& watch) mutable {
        query.progress = [&watch](double done) { return watch(done); };
        return s.render(view_of(view), picture, query);
      });
  return array_of(std::move(rgba), {picture.height, picture.width, 4});
}

}  // namespace

void bind_pictures(nb::class_<SceneObject>& scene) {
  scene.def("make_rays", &make_rays);
  scene.def("render", &render, nb::arg("view"), nb::arg("picture"), nb::arg("query"), nb::arg("progress").none());
}

}  // namespace ballot::python
