#include "engine/files/npy.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/parallel.h"
#include "engine/files/npy_file.h"
#include "engine/model/hit_geometry.h"

namespace ballot {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kHitDescr = "[('t', '<f4'), ('prim', '<u4'), ('u', '<f4'), ('v', '<f4')]";
constexpr std::string_view kHitInDoubleDescr = "[('t', '<f8'), ('prim', '<u4'), ('u', '<f4'), ('v', '<f4')]";
constexpr float kNoBound = std::numeric_limits<float>::max();

/// Returns a number that stays finite as float32 if it is.
double held(double value) {
  constexpr double limit = std::numeric_limits<float>::max();
  return std::isfinite(value) ? std::clamp(value, -limit, limit) : value;
}

/// Makes a ray of a row of 8 or 6 numbers.
template <class Number>
RayInDouble ray_of(const Number* row, bool bounded) {
  const auto f = [&](int i) { return held(double(row[i])); };
  if (!bounded) return {.origin = {f(0), f(1), f(2)}, .dir = {f(3), f(4), f(5)}};
  return {{f(0), f(1), f(2)}, f(3), {f(4), f(5), f(6)}, f(7)};
}

void write_array(const fs::path& path, std::string_view descr, const std::string& shape,
                 std::span<const std::byte> bytes) {
  const std::string start = npy_start(descr, shape);
  write_atomically(path, [&](OutputFile& out) {
    out.write(start.data(), start.size());
    out.write(bytes.data(), bytes.size());
  });
}

}  // namespace

DeadRays count_dead(std::span<const Ray> rays) {
  constexpr std::uint32_t kInfinity = 0x7F800000, kSmallest = 0x00800000;  // the smallest float that is not denormal
  std::atomic<std::uint64_t> not_finite = 0, no_direction = 0;
  for_chunks(rays.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    std::uint64_t infinite = 0, still = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const auto words = std::bit_cast<std::array<std::uint32_t, 8>>(rays[i]);
      const auto at = [&](std::size_t w) { return words[w] & 0x7FFFFFFF; };
      const std::uint32_t direction = std::max({at(4), at(5), at(6)});
      const bool bad = std::max({at(0), at(1), at(2), at(3), direction, at(7)}) >= kInfinity;
      infinite += bad;
      still += !bad && direction < kSmallest;
    }
    not_finite += infinite;
    no_direction += still;
  });
  return {not_finite, no_direction};
}

RayFile::RayFile(const fs::path& path) : file_(std::make_unique<NpyFile>(path)) {
  const NpyHeader& header = file_->header();
  wide_ = header.descr == "'<f8'";
  if (!wide_ && header.descr != "'<f4'")
    file_->stop(file_->found() +
                "; expected float32 '<f4' or float64 '<f8' of shape (n, 8); "
                "convert with numpy.ascontiguousarray(a, '<f4')");
  const auto& shape = *header.shape;
  if (shape.size() != 2 || (shape[1] != 8 && shape[1] != 6))
    file_->stop(file_->found() +
                "; expected shape (n, 8): origin x y z, t_min, direction x y z, t_max; or (n, 6): origin, direction");
  count_ = left_ = shape[0];
  columns_ = shape[1];
  const std::size_t number = wide_ ? sizeof(double) : sizeof(float);
  file_->expect_items(count_, columns_ * number, number);
}

RayFile::RayFile(RayFile&&) noexcept = default;
RayFile::~RayFile() = default;

void RayFile::choose_part(std::uint64_t index, std::uint64_t parts) {
  const auto first_of = [&](std::uint64_t i) {  // count_ * i / parts without overflow
    return count_ / parts * i + count_ % parts * i / parts;
  };
  const std::uint64_t first = first_of(index);
  file_->skip(first * columns_ * (wide_ ? sizeof(double) : sizeof(float)));
  count_ = left_ = first_of(index + 1) - first;
}

void RayFile::count(std::span<const Ray> rays) {
  const DeadRays dead = count_dead(rays);
  dead_.not_finite += dead.not_finite;
  dead_.no_direction += dead.no_direction;
}

std::size_t RayFile::read(std::span<Ray> rays) {
  const auto make = [&](const RayInDouble& ray, Ray& to, double& moved) {
    to = recentring_ ? recentring_->ray(ray, moved) : rounded(ray);
  };
  const bool as_it_is = !wide_ && columns_ == 8 && !recentring_ && !moved_->keeps_rays();
  const std::size_t some = as_it_is ? read_as_it_is(rays) : read_rows(rays, make);
  count(rays.first(some));
  return some;
}

std::size_t RayFile::read(std::span<RayInDouble> rays) {
  const std::size_t some = read_rows(rays, [&](const RayInDouble& ray, RayInDouble& to, double&) {
    to = recentring_ ? recentring_->about(ray) : ray;
  });
  constexpr std::size_t kTogether = 4096;
  std::vector<Ray> as_single;
  for (std::size_t first = 0; first < some; first += kTogether) {
    as_single.clear();
    for (const RayInDouble& ray : rays.subspan(first, std::min(kTogether, some - first)))
      as_single.push_back(rounded(ray));
    count(as_single);
  }
  return some;
}

std::size_t RayFile::read_as_it_is(std::span<Ray> rays) {
  const std::size_t count = std::size_t(std::min<std::uint64_t>(rays.size(), left_));
  left_ -= count;
  file_->read(rays.data(), count * sizeof(Ray));
  for_chunks(count, 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (Ray& ray : rays.subspan(begin, end - begin)) ray.t_max = std::min(ray.t_max, kNoBound);
  });
  return count;
}

template <class Kind, class Make>
std::size_t RayFile::read_rows(std::span<Kind> rays, const Make& make) {
  const std::size_t count = std::size_t(std::min<std::uint64_t>(rays.size(), left_));
  left_ -= count;
  constexpr std::size_t kRows = 4096;
  std::vector<double> rows(kRows * columns_);  // float rows fit too
  for (std::size_t first = 0; first < count; first += kRows) {
    const std::size_t some = std::min(kRows, count - first);
    file_->read(rows.data(), some * columns_ * (wide_ ? sizeof(double) : sizeof(float)));
    if (wide_)
      make_rays(rows.data(), rays.subspan(first, some), make);
    else
      make_rays(reinterpret_cast<const float*>(rows.data()), rays.subspan(first, some), make);
  }
  return count;
}

template <class Number, class Kind, class Make>
void RayFile::make_rays(const Number* rows, std::span<Kind> rays, const Make& make) {
  const bool keeps = moved_->keeps_rays();
  std::vector<double> moved(recentring_ || keeps ? rays.size() : 0);
  std::vector<RayInDouble> kept(keeps ? rays.size() : 0);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const RayInDouble ray = ray_of(rows + i * columns_, columns_ == 8);
    double by = 0;
    make(ray, rays[i], by);
    if (!moved.empty()) moved[i] = by;
    if (!keeps) continue;
    kept[i] = recentring_ ? recentring_->about(ray) : ray;
    kept[i].origin += by * ray.dir;
  }
  moved_->add(moved, kept);
}

std::shared_ptr<MovedRays> RayFile::ask(const Recentring& scene) {
  if (wide_ || scene.origin() != glm::dvec3(0)) recentring_ = scene;
  return moved_;
}

void MovedRays::add(std::span<const double> moved, std::span<const RayInDouble> rays) {
  const std::lock_guard lock(mutex_);
  moved_.insert(moved_.end(), moved.begin(), moved.end());
  rays_.insert(rays_.end(), rays.begin(), rays.end());
}

std::vector<double> MovedRays::take(std::size_t count) {
  const std::lock_guard lock(mutex_);
  const auto end = moved_.begin() + std::ptrdiff_t(std::min(count, moved_.size()));
  std::vector<double> taken(moved_.begin(), end);
  moved_.erase(moved_.begin(), end);
  return taken;
}

void MovedRays::tell_as_given(std::span<const std::uint32_t> counts, std::span<Hit> hits) {
  const std::vector<double> moved = take(counts.size());
  for (std::size_t i = 0, at = 0; i < moved.size(); at += counts[i++])
    for (Hit& hit : hits.subspan(at, counts[i])) hit.t = float(double(hit.t) + moved[i]);
}

void MovedRays::tell_as_given(std::span<Hit> hits) { tell_as_given(std::vector<std::uint32_t>(hits.size(), 1), hits); }

std::vector<double> MovedRays::t_in_double(std::span<const Hit> hits, const TriangleOf& triangle_of) {
  std::vector<double> all = take(hits.size());
  all.resize(hits.size());
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const std::optional<Triangle> triangle = hits[i].prim == NO_HIT ? std::nullopt : triangle_of(hits[i]);
    all[i] += triangle ? t_of(rays_[i], *triangle, double(hits[i].t)) : double(hits[i].t);
  }
  rays_.erase(rays_.begin(), rays_.begin() + std::ptrdiff_t(hits.size()));
  return all;
}

std::vector<Ray> read_rays(const fs::path& path) {
  RayFile file(path);
  std::vector<Ray> rays(file.count());
  file.read(rays);
  return rays;
}

void write_rays(const fs::path& path, std::span<const Ray> rays) {
  write_array(path, "'<f4'", fmt::format("({}, 8)", rays.size()), std::as_bytes(rays));
}

void write_hits(const fs::path& path, std::span<const Hit> hits) {
  write_array(path, kHitDescr, fmt::format("({},)", hits.size()), std::as_bytes(hits));
}

std::string hits_start(std::uint64_t count) { return npy_start(kHitDescr, fmt::format("({},)", count)); }

std::string hits_in_double_start(std::uint64_t count) {
  return npy_start(kHitInDoubleDescr, fmt::format("({},)", count));
}

std::vector<Hit> read_hits(const fs::path& path) {
  NpyFile file(path);
  const NpyHeader& header = file.header();
  if (header.descr != kHitDescr || header.shape->size() != 1)
    file.stop(fmt::format("{}; expected dtype {} of shape (n,)", file.found(), kHitDescr));
  const std::uint64_t count = (*header.shape)[0];
  file.expect_items(count, sizeof(Hit), sizeof(Hit));
  std::vector<Hit> hits(count);
  file.read(hits.data(), count * sizeof(Hit));
  return hits;
}

void write_triangles(const fs::path& path, std::span<const Triangle> triangles) {
  write_array(path, "'<f4'", fmt::format("({}, 3, 3)", triangles.size()), std::as_bytes(triangles));
}

}  // namespace ballot
