// FLIP. Notation and constants are those of the paper named in image_error.h, sections 4 and 5.
#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "engine/files/image_error.h"

namespace ballot {

namespace {

constexpr float kPixelsPerDegree = 67.0206f;  // seen from 0.7 m, on a screen that is 3840 pixels and 0.7 m wide
constexpr float kPi = 3.14159265f;

using Plane = std::vector<glm::vec3>;

// The matrix from linear Rec.709 to CIE 1931 XYZ, column by column, and the white point D65.
const glm::mat3 kXyzFromRgb(0.4124564f, 0.2126729f, 0.0193339f, 0.3575761f, 0.7151522f, 0.1191920f, 0.1804375f,
                            0.0721750f, 0.9503041f);
const glm::vec3 kWhite = kXyzFromRgb * glm::vec3(1);

glm::vec3 opponent_of(const glm::vec3& rgb) {
  const glm::vec3 xyz = kXyzFromRgb * rgb / kWhite;
  return {116 * xyz.y - 16, 500 * (xyz.x - xyz.y), 200 * (xyz.y - xyz.z)};
}

glm::vec3 rgb_of(const glm::vec3& c) {
  const float y = (c.x + 16) / 116;
  return glm::inverse(kXyzFromRgb) * (glm::vec3(c.y / 500 + y, y, y - c.z / 200) * kWhite);
}

/// Returns a colour in CIELab, adjusted for the Hunt effect.
glm::vec3 lab_of(const glm::vec3& rgb) {
  glm::vec3 f = kXyzFromRgb * rgb / kWhite;
  constexpr float d = 6.0f / 29;
  for (int i = 0; i < 3; ++i) f[i] = f[i] > d * d * d ? std::cbrt(f[i]) : f[i] / (3 * d * d) + 4.0f / 29;
  const float l = 116 * f.y - 16;
  return {l, 0.01f * l * 500 * (f.x - f.y), 0.01f * l * 200 * (f.y - f.z)};
}

float hyab(const glm::vec3& a, const glm::vec3& b) { return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z); }

/// A square filter of (2 radius + 1)^2 weights for each of three channels.
struct Filter {
  int radius;
  std::vector<glm::vec3> weights;

  template <class Weight>
  Filter(int r, Weight weight) : radius(r) {
    for (int y = -r; y <= r; ++y)
      for (int x = -r; x <= r; ++x) weights.push_back(weight(float(x), float(y)));
  }
};

/// Returns the contrast sensitivity filter: sums of Gaussians of width b (square degrees). The weights of each channel
/// add up to 1.
Filter sensitivity() {
  const auto gauss = [](float a, float b, float d2) { return a * std::sqrt(kPi / b) * std::exp(-kPi * kPi * d2 / b); };
  const int radius = int(std::ceil(3 * std::sqrt(0.04f / (2 * kPi * kPi)) * kPixelsPerDegree));
  Filter filter(radius, [&](float x, float y) {
    const float d2 = (x * x + y * y) / (kPixelsPerDegree * kPixelsPerDegree);
    return glm::vec3(gauss(1, 0.0047f, d2), gauss(1, 0.0053f, d2), gauss(34.1f, 0.04f, d2) + gauss(13.5f, 0.025f, d2));
  });
  glm::vec3 sum(0);
  for (const glm::vec3& w : filter.weights) sum += w;
  for (glm::vec3& w : filter.weights) w /= sum;
  return filter;
}

/// Returns the first (edges) or second (points) derivative of a Gaussian: along x in the first channel, along y in the
/// second. The positive weights add up to 1, the negative ones to -1.
Filter features(bool points) {
  const float sd = 0.5f * 0.082f * kPixelsPerDegree;
  Filter filter(int(std::ceil(3 * sd)), [&](float x, float y) {
    const float g = std::exp(-(x * x + y * y) / (2 * sd * sd));
    const auto along = [&](float c) { return points ? (c * c / (sd * sd) - 1) * g : -c * g; };
    return glm::vec3(along(x), along(y), 0);
  });
  glm::vec3 above(0), below(0);
  for (const glm::vec3& w : filter.weights) above += glm::max(w, 0.0f), below -= glm::min(w, 0.0f);
  for (glm::vec3& w : filter.weights)
    for (int c = 0; c < 2; ++c) w[c] /= w[c] > 0 ? above[c] : below[c];
  return filter;
}

Plane filtered(const Plane& plane, int width, int height, const Filter& filter) {
  Plane out(plane.size());
  const int r = filter.radius;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      glm::vec3 sum(0);
      const glm::vec3* weight = filter.weights.data();
      for (int j = -r; j <= r; ++j)
        for (int i = -r; i <= r; ++i, ++weight)
          sum += *weight * plane[std::size_t(std::clamp(y + j, 0, height - 1)) * std::size_t(width) +
                                 std::size_t(std::clamp(x + i, 0, width - 1))];
      out[std::size_t(y) * std::size_t(width) + std::size_t(x)] = sum;
    }
  return out;
}

Plane opponents_of(const Image& image) {
  const auto &r = image.channel("R").floats, &g = image.channel("G").floats, &b = image.channel("B").floats;
  Plane plane;
  for (std::size_t i = 0; i < r.size(); ++i)
    plane.push_back(opponent_of(glm::clamp(glm::vec3(r[i], g[i], b[i]), 0.0f, 1.0f)));
  return plane;
}

/// The filtered planes of one picture that the comparison needs.
struct Seen {
  Plane lab;
  Plane edges, points;  // along x and y

  Seen(const Image& image, const Filter& csf, const Filter& edge, const Filter& point) {
    const int w = int(image.width), h = int(image.height);
    Plane plane = opponents_of(image);
    lab = filtered(plane, w, h, csf);
    for (glm::vec3& c : lab) c = lab_of(glm::clamp(rgb_of(c), 0.0f, 1.0f));
    for (glm::vec3& c : plane) c = glm::vec3((c.x + 16) / 116);
    edges = filtered(plane, w, h, edge);
    points = filtered(plane, w, h, point);
  }
};

/// Maps a HyAB distance to [0, 1]. Small distances take most of the range.
float spread_out(float distance) {
  static const float most = std::pow(hyab(lab_of({0, 1, 0}), lab_of({0, 0, 1})), 0.7f);
  constexpr float pc = 0.4f, pt = 0.95f;
  const float e = std::pow(distance, 0.7f);
  if (e < pc * most) return pt / (pc * most) * e;
  return pt + (e - pc * most) / (most - pc * most) * (1 - pt);
}

}  // namespace

double mean_flip(const Image& image, const Image& reference) {
  const Filter csf = sensitivity(), edge = features(false), point = features(true);
  const Seen a(image, csf, edge, point), b(reference, csf, edge, point);
  double sum = 0;
  for (std::size_t i = 0; i < a.lab.size(); ++i) {
    const float color = std::clamp(spread_out(hyab(a.lab[i], b.lab[i])), 0.0f, 1.0f);
    const float off = std::max(std::abs(glm::length(a.edges[i]) - glm::length(b.edges[i])),
                               std::abs(glm::length(a.points[i]) - glm::length(b.points[i])));
    const float feature = std::sqrt(std::clamp(off / std::sqrt(2.0f), 0.0f, 1.0f));
    sum += std::pow(color, 1 - feature);
  }
  return a.lab.empty() ? 0 : sum / double(a.lab.size());
}

}  // namespace ballot
