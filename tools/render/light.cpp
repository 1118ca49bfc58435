#include "tools/render/light.h"

#include <cmath>

namespace ballot::cli {

namespace {

constexpr const char* kLampForm =
    "X,Y,Z:R,G,B or eye:R,G,B, which are the position in scene units (eye is the camera's) and the radiant intensity, "
    "0 or more, e.g. 0,2,0:5,5,5";

glm::vec3 triple_of(const std::string& lamp, const std::string& text, bool below_zero) {
  glm::vec3 v(0);
  const char* at = text.c_str();
  for (int i = 0; i < 3; ++i) {
    char* end = nullptr;
    v[i] = std::strtof(at, &end);
    if (end == at || *end != (i < 2 ? ',' : '\0') || !std::isfinite(v[i]) || (!below_zero && v[i] < 0))
      fail(Failure::Arguments, "--lamp {}: expected {}", lamp, kLampForm);
    at = end + 1;
  }
  return v;
}

/// Returns the names of the integrators that see lights: "whitted and path".
std::string lit_integrators() {
  std::string names;
  for (const Integrator& i : kIntegrators)
    if (i.sees == Sees::Materials) names += fmt::format("{}{}", names.empty() ? "" : " and ", i.name);
  return names;
}

}  // namespace

void LightArgs::add_to(CLI::App& app) {
  const std::string lit = lit_integrators();
  app.add_option(
      "--sky", sky,
      "radiance of rays that leave the scene: none; R,G,B; gradient; gradient:ZENITH:HORIZON:GROUND, each R,G,B;\n"
      "or a FILE.exr twice as wide as high (longitude by latitude); e.g. --sky 0.5,0.7,1\n"
      "[auto: gradient for " +
          lit + " if the scene has no light and no unlit material, and no --lamp is given]");
  app.add_option("--lamp", lamps, fmt::format("a point light for {}, may be repeated: {}", lit, kLampForm));
}

void LightArgs::apply(Scene& scene, const std::vector<const View*>& views, const std::string& shading) const {
  for (const std::string& lamp : lamps) {
    const std::size_t colon = lamp.find(':');
    if (colon == std::string::npos) fail(Failure::Arguments, "--lamp {}: expected {}", lamp, kLampForm);
    const std::string where = lamp.substr(0, colon);
    Light light{.name = "lamp", .intensity = triple_of(lamp, lamp.substr(colon + 1), false)};
    if (where != "eye") {
      light.position = triple_of(lamp, where, true);
      scene.lights.push_back(light);
      continue;
    }
    for (const View* view : views) {
      light.position = glm::vec3(view->world_from_camera[3]);
      scene.lights.push_back(light);
    }
  }
  if (sky != "auto") {
    scene.sky = make_sky(sky);
    return;
  }
  const Integrator* integrator = find_integrator(shading);
  const SceneFeatures f = features_of(scene);
  if (integrator && integrator->sees == Sees::Materials && !f.emits && !f.lights && !f.unlit)
    scene.sky = make_sky("gradient");
}

}  // namespace ballot::cli
