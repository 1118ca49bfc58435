#include "tools/views_file.h"

#include <cmath>
#include <nlohmann/json.hpp>

namespace ballot::cli {

namespace {

using nlohmann::json;

json to_json(const View& view) {
  const glm::dquat q = glm::normalize(glm::quat_cast(glm::dmat3(view.world_from_camera)));
  const glm::dvec3 p(view.world_from_camera[3]);
  json j{{"name", view.name}, {"position", {p.x, p.y, p.z}}, {"orientation", {q.x, q.y, q.z, q.w}}};
  if (view.orthographic)
    j["ymag"] = view.ymag;
  else
    j["yfov"] = view.yfov;
  return j;
}

View from_json(const json& j) {
  View view;
  view.name = j.at("name").get<std::string>();
  const auto p = j.at("position").get<std::array<double, 3>>();
  const auto q = j.at("orientation").get<std::array<double, 4>>();
  const glm::dquat orientation(q[3], q[0], q[1], q[2]);
  if (view.name.empty()) throw std::runtime_error("a view has no name");
  if (!(std::abs(glm::length(orientation) - 1) < 1e-3))
    throw std::runtime_error("orientation of view '" + view.name + "' is not a unit quaternion (x, y, z, w)");
  for (const double x : p)
    if (!std::isfinite(x)) throw std::runtime_error("position of view '" + view.name + "' is not finite");
  view.world_from_camera = frame_of({p[0], p[1], p[2]}, orientation);
  view.orthographic = j.contains("ymag");
  if (view.orthographic)
    view.ymag = j.at("ymag").get<double>();
  else
    view.yfov = j.at("yfov").get<double>();
  if (!(view.yfov > 0 && view.yfov < 3.14))
    throw std::runtime_error("yfov of view '" + view.name + "' is not between 0 and 3.14 radians");
  if (!(view.ymag > 0)) throw std::runtime_error("ymag of view '" + view.name + "' is not above 0");
  return view;
}

}  // namespace

glm::dmat4 frame_of(const glm::dvec3& position, const glm::dquat& orientation) {
  glm::dmat4 frame = glm::mat4_cast(glm::normalize(orientation));
  frame[3] = glm::dvec4(position, 1);
  return frame;
}

View as_written(const View& view) { return from_json(to_json(view)); }

std::vector<View> read_views(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  try {
    const json j = json::parse(reinterpret_cast<const char*>(bytes.data()),
                               reinterpret_cast<const char*>(bytes.data()) + bytes.size());
    std::vector<View> views;
    for (const json& v : j.at("views")) {
      View view = from_json(v);
      for (const View& other : views)
        if (other.name == view.name) throw std::runtime_error("two views are called '" + view.name + "'");
      views.push_back(std::move(view));
    }
    if (views.empty()) throw std::runtime_error("it has no view");
    return views;
  } catch (const std::exception& error) {
    fail(Failure::Work,
         "{} is no views file: {}; expected {{\"views\": [{{\"name\", \"position\": [x, y, z], \"orientation\": [x, y, "
         "z, w], \"yfov\"}}]}}",
         path.string(), error.what());
  }
}

void write_views(const std::filesystem::path& path, const std::vector<View>& views) {
  json list = json::array();
  for (const View& v : views) list.push_back(to_json(v));
  write_file(path, json{{"views", list}}.dump(1) + "\n");
}

void append_view(const std::filesystem::path& path, const View& view) {
  std::vector<View> views;
  std::error_code error;
  if (std::filesystem::exists(path, error)) views = read_views(path);
  for (const View& v : views)
    if (v.name == view.name) fail(Failure::Work, "{} holds a view called '{}' already", path.string(), view.name);
  views.push_back(view);
  write_views(path, views);
}

}  // namespace ballot::cli
