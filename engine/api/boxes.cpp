#include "engine/api/boxes.h"

#include <cmath>

namespace ballot::api {

namespace {

constexpr float kMost = std::numeric_limits<float>::max();

/// Returns a coordinate about an origin, rounded to float32 and away from the box: below with `side` -1, above with 1.
float outward(double coordinate, double origin, float side) {
  const double end = side * std::numeric_limits<double>::infinity();
  double from = coordinate - origin;
  if (from + origin != coordinate || coordinate - from != origin) from = std::nextafter(from, end);
  if (!(std::abs(from) < kMost)) return std::isnan(from) ? float(from) : from < 0 ? -kMost : kMost;
  const float rounded = float(from);
  return side * (rounded - from) < 0 ? std::nextafter(rounded, float(end)) : rounded;
}

}  // namespace

BoxArray::BoxArray(const BallotBoxes& boxes)
    : shape_(read_shape("boxes", boxes.shape)),
      low_(read_column({"boxes", "low", 3, true}, shape_, boxes.low), shape_),
      high_(read_column({"boxes", "high", 3, true}, shape_, boxes.high), shape_),
      filters_("boxes", shape_, boxes.mask, boxes.excluded, boxes.group) {}

void BoxArray::read(std::uint64_t first, std::span<ProbeBox> boxes) const {
  for_chunks(boxes.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    const std::span<ProbeBox> some = boxes.subspan(begin, end - begin);
    const auto corners = [&](const Lane& lane, glm::vec3 ProbeBox::*corner, float side) {
      lane.for_doubles(std::size_t(first) + begin, some.size(), [&](std::size_t i, const auto& v) {
        for (int k = 0; k < 3; ++k) (some[i].*corner)[k] = outward(v[std::size_t(k)], origin_[k], side);
      });
    };
    corners(low_, &ProbeBox::lo, -1);
    corners(high_, &ProbeBox::hi, 1);
  });
}

}  // namespace ballot::api
