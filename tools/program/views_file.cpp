#include "tools/program/views_file.h"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

namespace ballot::cli {

namespace {

using nlohmann::json;

/// A value of the file together with its place, so that error messages can name both.
class JsonPlace {
 public:
  /// Keeps a reference to `value`. `advice` ends error messages: what to do about a wrong file.
  JsonPlace(const nlohmann::json& value, std::string file, const char* advice, std::string place = {})
      : value_(&value), file_(std::move(file)), advice_(advice), place_(std::move(place)) {}

  // All functions below throw as wrong() does if the value has another type or range.

  std::optional<JsonPlace> find(const std::string& key) const {
    if (!value_->is_object()) wrong("an object");
    const auto found = value_->find(key);
    if (found == value_->end()) return std::nullopt;
    return JsonPlace(*found, file_, advice_, place_.empty() ? key : place_ + "." + key);
  }
  JsonPlace at(const std::string& key) const {
    if (const auto found = find(key)) return *found;
    wrong("an object with '" + key + "'");
  }
  std::vector<JsonPlace> items() const {
    if (!value_->is_array()) wrong("a list");
    std::vector<JsonPlace> all;
    for (std::size_t i = 0; i < value_->size(); ++i)
      all.emplace_back((*value_)[i], file_, advice_, fmt::format("{}[{}]", place_, i));
    return all;
  }
  std::string text() const {
    if (!value_->is_string()) wrong("a text");
    return value_->get<std::string>();
  }
  double number() const {
    if (!value_->is_number()) wrong("a number");
    return value_->get<double>();
  }
  double positive() const {
    const double n = number();
    if (!(n > 0) || !std::isfinite(n)) wrong("a number above 0");
    return n;
  }
  /// Throws Error(Work) that names file and place, the value found, shortened to 40 characters, and the one expected.
  [[noreturn]] void wrong(const std::string& expected) const {
    std::string found = value_->dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    if (found.size() > 40) found = found.substr(0, 40) + "...";
    fail(Failure::Work, "{}: {}: expected {}, found {}; {}", file_, place_.empty() ? "top level" : place_, expected,
         found, advice_);
  }

 private:
  const nlohmann::json* value_;
  std::string file_;
  const char* advice_;
  std::string place_;
};

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

constexpr const char* kAdvice =
    "it is no views file: write {\"views\": [{\"name\", \"position\": [x, y, z], \"orientation\": [x, y, z, w], "
    "\"yfov\"}]}";

/// Parses a file. Throws Error(Work) that names the byte at which it stops being JSON, or nests too deep.
json parsed(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  const std::string_view text = without_mark(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  check_json(path, text);
  try {
    return json::parse(text);
  } catch (const json::parse_error& error) {
    fail(Failure::Work, "{}: expected JSON, found something else at byte {} of {}; {}", path.string(), error.byte,
         text.size(), kAdvice);
  } catch (const json::out_of_range&) {  // such as 1e999
    fail(Failure::Work, "{}: expected JSON, found a number that no double can hold; {}", path.string(), kAdvice);
  }
}

/// Reads a list of N finite numbers.
template <std::size_t N>
std::array<double, N> numbers(const JsonPlace& from) {
  const std::string expected = fmt::format("a list of {} finite numbers", N);
  const std::vector<JsonPlace> items = from.items();
  if (items.size() != N) from.wrong(expected);
  std::array<double, N> all{};
  for (std::size_t i = 0; i < N; ++i) {
    all[i] = items[i].number();
    if (!std::isfinite(all[i])) from.wrong(expected);
  }
  return all;
}

View from_json(const JsonPlace& from) {
  View view;
  const JsonPlace orientation = from.at("orientation");
  view.name = from.at("name").text();
  if (view.name.empty()) from.at("name").wrong("a name of one letter or more");
  const auto p = numbers<3>(from.at("position"));
  const auto q = numbers<4>(orientation);
  const glm::dquat turn(q[3], q[0], q[1], q[2]);
  if (!(std::abs(glm::length(turn) - 1) < 1e-3)) orientation.wrong("a unit quaternion (x, y, z, w)");
  view.world_from_camera = frame_of({p[0], p[1], p[2]}, turn);
  const auto ymag = from.find("ymag");
  view.orthographic = ymag.has_value();
  if (ymag) {
    view.ymag = ymag->positive();
  } else {
    view.yfov = from.at("yfov").number();
    if (!(view.yfov > 0 && view.yfov < 3.14)) from.at("yfov").wrong("an angle between 0 and 3.14 radians");
  }
  return view;
}

}  // namespace

glm::dmat4 frame_of(const glm::dvec3& position, const glm::dquat& orientation) {
  glm::dmat4 frame = glm::mat4_cast(glm::normalize(orientation));
  frame[3] = glm::dvec4(position, 1);
  return frame;
}

View as_written(const View& view) {
  const json written = to_json(view);
  return from_json({written, "view " + view.name, "give it finite numbers"});
}

std::vector<View> read_views(const std::filesystem::path& path) { return views_in(path, read_argument(path)); }

std::vector<View> views_in(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  const json whole = parsed(path, bytes);
  std::vector<View> views;
  std::set<std::string> names;
  const JsonPlace list = JsonPlace(whole, path.string(), kAdvice).at("views");
  for (const JsonPlace& each : list.items()) {
    views.push_back(from_json(each));
    if (!names.insert(views.back().name).second) each.at("name").wrong("another name, because two views have this one");
  }
  if (views.empty()) list.wrong("at least one view");
  return views;
}

std::string views_text(const std::vector<View>& views) {
  json list = json::array();
  for (const View& v : views) list.push_back(to_json(v));
  return json_text({{"views", list}});
}

void write_views(const std::filesystem::path& path, const std::vector<View>& views, Links links) {
  write_file(path, views_text(views), links);
}

void append_view(const std::filesystem::path& path, const View& view, Links links) {
  std::vector<View> views;
  std::error_code error;
  if (std::filesystem::exists(path, error)) views = read_views(path);
  for (const View& v : views)
    if (v.name == view.name) fail(Failure::Work, "{} holds a view called '{}' already", path.string(), view.name);
  views.push_back(view);
  write_views(path, views, links);
}

}  // namespace ballot::cli
