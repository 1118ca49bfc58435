// Loads arrays of shapes: a row each.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "engine/files/loaders.h"
#include "engine/files/npy_shapes.h"
#include "engine/model/recentring.h"

namespace ballot {
namespace {

/// The columns of a kind of shapes, a letter each: p a coordinate of a position, n one of a normal, r a radius. One
/// radius is that of all positions of the row; without any it is the option's.
struct ShapeColumns {
  ShapeKind kind;
  std::string_view columns;
  std::string_view words;

  bool has_radius() const { return columns.back() == 'r'; }
};
constexpr ShapeColumns kColumns[] = {
    {ShapeKind::Spheres, "ppp", "center"},
    {ShapeKind::Spheres, "pppr", "center, radius"},
    {ShapeKind::Discs, "pppnnn", "center, normal"},
    {ShapeKind::Discs, "pppnnnr", "center, normal, radius"},
    {ShapeKind::Capsules, "pppppp", "both ends"},
    {ShapeKind::Capsules, "ppppppr", "both ends, radius"},
    {ShapeKind::Capsules, "pppppprr", "both ends, radius of each"},
    {ShapeKind::Boxes, "pppppp", "low, high"},
};

/// Returns true if rows of these columns need a radius from outside.
bool needs_radius(const ShapeColumns& c) { return info_of(c.kind).radii && !c.has_radius(); }

std::string text_of(const ShapeColumns& c) {
  return fmt::format("{} (n, {}): {}{}", info_of(c.kind).name, c.columns.size(), c.words,
                     needs_radius(c) ? " with a radius given" : "");
}

const ShapeColumns& columns_of(const NpyFile& file, const Rows& rows, const LoadOptions& options) {
  const ShapeColumns* found = nullptr;
  bool several = false;
  std::string fit, known;
  for (const ShapeColumns& c : kColumns) {
    if (options.shapes && &info_of(c.kind) != options.shapes) continue;
    known += (known.empty() ? "" : "; ") + text_of(c);
    if (c.columns.size() != rows.width || (needs_radius(c) && options.radius == 0)) continue;
    several = found != nullptr;
    fit += fmt::format("{}{} ({})", fit.empty() ? "" : " or ", info_of(c.kind).name, c.words);
    found = &c;
  }
  if (!found || !rows.are_floats()) refuse("{}; expected float32 or float64 of {}", file.found(), known);
  if (several) refuse("{}: its rows may be {}; say which of these shapes", file.found(), fit);
  return *found;
}

/// Returns the point that positions are counted from: 0 for numbers that are float32 already (origin_for()).
template <class Number>
glm::dvec3 origin_of(std::span<const Number> numbers, std::string_view columns) {
  if (sizeof(Number) == sizeof(float)) return glm::dvec3(0);
  glm::dvec3 lo(std::numeric_limits<double>::infinity()), hi = -lo;
  for (std::size_t i = 0; i < numbers.size(); ++i)
    if (const std::size_t c = i % columns.size(); columns[c] == 'p' && std::isfinite(numbers[i])) {
      lo[int(c % 3)] = std::min(lo[int(c % 3)], double(numbers[i]));
      hi[int(c % 3)] = std::max(hi[int(c % 3)], double(numbers[i]));
    }
  const bool any = lo.x <= hi.x && lo.y <= hi.y && lo.z <= hi.z;
  return any ? origin_for(lo, hi) : glm::dvec3(0);
}

template <class Number>
Scene scene_of(NpyFile& file, const Rows& rows, const ShapeColumns& of, float radius) {
  const ShapeInfo& info = info_of(of.kind);
  file.expect_items(rows.count, rows.width * rows.bytes, rows.bytes);
  need_memory_for(rows.count * rows.width * (sizeof(Number) + sizeof(float)), fmt::format("{} rows", rows.count));
  std::vector<Number> numbers(rows.count * rows.width);
  file.read(numbers.data(), numbers.size() * sizeof(Number));
  Scene scene;
  scene.origin = origin_of(std::span<const Number>(numbers), of.columns);
  std::vector<float> positions, normals, radii;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::size_t c = i % of.columns.size();
    if (of.columns[c] == 'p') positions.push_back(float(double(numbers[i]) - scene.origin[int(c % 3)]));
    if (of.columns[c] == 'n') normals.push_back(float(numbers[i]));
    if (of.columns[c] == 'r') radii.push_back(float(numbers[i]));
  }
  const std::size_t vertices = positions.size() / 3;
  if (info.radii && radii.empty()) radii.assign(vertices, radius);
  if (radii.size() < vertices && info.radii) {  // one for both ends
    std::vector<float> each;
    for (const float r : radii) each.insert(each.end(), info.vertices, r);
    radii = std::move(each);
  }
  const auto vectors = [](const std::vector<float>& v) {
    return std::span(reinterpret_cast<const glm::vec3*>(v.data()), v.size() / 3);
  };
  append_shapes(of.kind, {vectors(positions), radii, vectors(normals)}, scene);
  complete_shapes(of.kind, scene);
  return scene;
}

}  // namespace

std::string npy_shapes() {
  std::string known;
  for (const ShapeColumns& c : kColumns) known += (known.empty() ? "" : "; ") + text_of(c);
  return known;
}

Scene shapes_of(NpyFile& file, const LoadOptions& options) {
  const Rows rows = rows_of(file);
  const ShapeColumns& of = columns_of(file, rows, options);
  return rows.bytes == sizeof(double) ? scene_of<double>(file, rows, of, options.radius)
                                      : scene_of<float>(file, rows, of, options.radius);
}

}  // namespace ballot
