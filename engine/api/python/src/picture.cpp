// Rays and pictures of a view, in Python.
#include "door.h"

namespace ballot::python {

namespace {

/// (name, eye, target, up, yfov, ymag)
using ViewTuple = std::tuple<std::string, std::tuple<double, double, double>, std::tuple<double, double, double>,
                             std::tuple<double, double, double>, double, double>;

View view_of(const ViewTuple& given) {
  const auto& [name, eye, target, up, yfov, ymag] = given;
  View view{.yfov = yfov, .ymag = ymag};
  if (!name.empty()) view.name = name;
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

auto make_rays_double(const SceneObject& self, const ViewTuple& view, const std::string& kind, std::uint32_t width,
                      std::uint32_t height) {
  std::vector<RayDouble> rays = watched(self.use(), nb::none(), [=](const Scene& s, Watch&) {
    return s.make_rays_double(view_of(view), kind, width, height);
  });
  const std::size_t count = rays.size();
  return array_of(std::move(rays), {count, 8});
}

/// (width, height, samples, shading, sky, bounces, seed)
using PictureTuple =
    std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::string, std::string, std::int32_t, std::uint32_t>;

auto render(const SceneObject& self, const ViewTuple& view, const PictureTuple& given, const ObjectDict& options,
            nb::object progress) {
  std::vector<float> rgba =
      watched(self.use(), std::move(progress),
              [=, query = Options<BallotQuery>(options, door::kQueryRows)](const Scene& s, Watch& watch) {
                const auto& [width, height, samples, shading, sky, bounces, seed] = given;
                Picture picture{.width = width, .height = height, .samples = samples, .shading = shading};
                if (!sky.empty()) picture.sky = sky;
                picture.bounces = bounces, picture.seed = seed;
                BallotQuery asked = query.c;
                asked.progress = watch;
                return s.render(view_of(view), picture, asked);
              });
  return array_of(std::move(rgba), {std::get<1>(given), std::get<0>(given), 4});
}

}  // namespace

void bind_pictures(nb::class_<SceneObject>& scene) {
  scene.def("make_rays", &make_rays);
  scene.def("make_rays_double", &make_rays_double);
  scene.def("render", &render, nb::arg("view"), nb::arg("picture"), nb::arg("options"), nb::arg("progress").none());
}

}  // namespace ballot::python
