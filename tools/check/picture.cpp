#include "tools/check/picture.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace ballot::cli {

namespace {

const glm::vec3 kRed(0.9f, 0.05f, 0.05f), kOrange(1, 0.45f, 0), kBlue(0.1f, 0.3f, 1), kYellow(1, 0.9f, 0.1f);

/// A picture with depths, seen along a direction without perspective.
class Drawing {
 public:
  Drawing(const Bounds& bounds, std::uint32_t size)
      : size_(size), color_(std::size_t(size) * size, glm::vec3(1)), depth_(color_.size(), INFINITY) {
    const glm::dvec3 to_eye = glm::normalize(glm::dvec3(0.5, 0.45, 1));
    axes_[2] = to_eye;
    axes_[0] = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), to_eye));
    axes_[1] = glm::cross(to_eye, axes_[0]);
    middle_ = 0.5 * glm::dvec3(bounds.lo) + 0.5 * glm::dvec3(bounds.hi);
    const double radius = 0.5 * glm::length(glm::dvec3(bounds.hi) - glm::dvec3(bounds.lo));
    scale_ = 0.48 * size / std::max(radius, 1e-300);
  }

  /// Returns pixels from the left and from the top, and the depth, in pixels too.
  glm::dvec3 at(const glm::vec3& v) const {
    const glm::dvec3 p = glm::dvec3(v) - middle_;
    return {0.5 * size_ + scale_ * glm::dot(p, axes_[0]), 0.5 * size_ - scale_ * glm::dot(p, axes_[1]),
            -scale_ * glm::dot(p, axes_[2])};
  }

  void fill(const Triangle& t, const glm::vec3& color) {
    const glm::dvec3 a = at(t[0]), b = at(t[1]), c = at(t[2]), normal = glm::cross(b - a, c - a);
    if (normal.z == 0) return;
    const float light = 0.35f + 0.6f * float(std::abs(normal.z) / glm::length(normal));
    const auto [x0, x1] = range(a.x, b.x, c.x);
    const auto [y0, y1] = range(a.y, b.y, c.y);
    const auto side = [](const glm::dvec3& p, const glm::dvec3& q, double x, double y) {
      return (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
    };
    for (std::int64_t y = y0; y <= y1; ++y)
      for (std::int64_t x = x0; x <= x1; ++x) {
        const double px = double(x) + 0.5, py = double(y) + 0.5;
        const double u = side(b, c, px, py) / normal.z, v = side(c, a, px, py) / normal.z;
        if (u < 0 || v < 0 || u + v > 1) continue;
        const std::size_t i = std::size_t(y) * size_ + std::size_t(x);
        const float z = float(u * a.z + v * b.z + (1 - u - v) * c.z);
        if (z >= depth_[i]) continue;
        depth_[i] = z;
        color_[i] = light * color;
      }
  }

  /// Draws a line, thick where the mesh does not hide it.
  void line(const glm::vec3& from, const glm::vec3& to, const glm::vec3& color) {
    const glm::dvec3 a = at(from), b = at(to);
    const int steps = 1 + int(std::ceil(std::max(std::abs(b.x - a.x), std::abs(b.y - a.y))));
    for (int i = 0; i <= steps; ++i) {
      const glm::dvec3 p = a + (b - a) * (double(i) / steps);
      const auto x = std::int64_t(std::floor(p.x)), y = std::int64_t(std::floor(p.y));
      const bool hidden = inside(x, y) && depth_[std::size_t(y) * size_ + std::size_t(x)] < float(p.z) - 2;
      const int width = hidden ? 0 : 1;
      for (int dy = -width; dy <= width; ++dy)
        for (int dx = -width; dx <= width; ++dx)
          if (inside(x + dx, y + dy)) color_[std::size_t(y + dy) * size_ + std::size_t(x + dx)] = color;
    }
  }

  Image image() const {
    Image image{.width = size_, .height = size_};
    for (int k = 0; k < 3; ++k) {
      Channel channel;
      channel.name = std::string(1, "RGB"[k]);
      channel.floats.reserve(color_.size());
      for (const glm::vec3& c : color_) channel.floats.push_back(c[k]);
      image.channels.push_back(std::move(channel));
    }
    return image;
  }

 private:
  bool inside(std::int64_t x, std::int64_t y) const { return x >= 0 && y >= 0 && x < size_ && y < size_; }
  std::pair<std::int64_t, std::int64_t> range(double a, double b, double c) const {
    return {std::max(std::int64_t(0), std::int64_t(std::min({a, b, c}))),
            std::min(std::int64_t(size_) - 1, std::int64_t(std::max({a, b, c})))};
  }

  std::uint32_t size_;
  std::vector<glm::vec3> color_;
  std::vector<float> depth_;
  glm::dvec3 axes_[3], middle_;
  double scale_;
};

}  // namespace

void draw_faults(const std::string& to, std::span<const Triangle> triangles, const MeshFaults& faults,
                 std::uint32_t size) {
  Drawing drawing(bounds_of_vertices(triangles, "the mesh"), size);
  std::vector<bool> crossed(triangles.size());
  for (const std::uint32_t prim : faults.crossed.prims) crossed[prim] = true;
  for (std::size_t i = 0; i < triangles.size(); ++i)
    drawing.fill(triangles[i], crossed[i] ? kYellow : glm::vec3(0.75f));
  const auto lines = [&](const std::vector<FaultyEdge>& edges, const glm::vec3& color) {
    for (const FaultyEdge& e : edges) drawing.line(e.from, e.to, color);
  };
  lines(faults.topology.first_flipped, kBlue);
  lines(faults.topology.first_nonmanifold, kOrange);
  lines(faults.topology.first_boundary, kRed);
  write_png(to, drawing.image());
}

}  // namespace ballot::cli
