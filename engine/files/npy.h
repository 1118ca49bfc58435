// NumPy .npy files of rays, hits and triangles.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/core/geometry.h"
#include "engine/model/recentring.h"
#include "shaders/shared/layout.h"

namespace ballot {

class NpyFile;

/// How many rays are no rays, and why: the first reason counts. They are reported as misses.
struct DeadRays {
  std::uint64_t not_finite = 0;    // a component is NaN or infinite
  std::uint64_t no_direction = 0;  // each component of the direction is zero or denormal
  std::uint64_t all() const { return not_finite + no_direction; }
};
/// Counts them. Rays whose range is empty are not among them.
DeadRays count_dead(std::span<const Ray> rays);

/// How far rays were moved along themselves before they were asked: by how much their t is less. In their order; what
/// was not added was not moved. Thread-safe.
class MovedRays {
 public:
  using TriangleOf = std::function<std::optional<Triangle>(const Hit&)>;  // none: a hit on a shape

  /// Has the rays in double kept as well, for t_in_double(). Call it before rays are read.
  void keep_rays() { keeps_ = true; }
  bool keeps_rays() const { return keeps_; }
  /// `rays`: where they start once they were moved, about the origin, if they are kept.
  void add(std::span<const double> moved, std::span<const RayInDouble> rays = {});
  /// Takes those of the next rays and gives their hits the t of the rays as they were: counts[i] hits of each.
  void tell_as_given(std::span<const std::uint32_t> counts, std::span<Hit> hits);
  /// The same for one hit of each ray.
  void tell_as_given(std::span<Hit> hits);
  /// Takes those of the next rays and returns the t of their hits in double (t_of() of hit_geometry.h), infinity of a
  /// miss.
  std::vector<double> t_in_double(std::span<const Hit> hits, const TriangleOf& triangle_of);

 private:
  std::vector<double> take(std::size_t count);

  std::mutex mutex_;
  std::deque<double> moved_;
  std::deque<RayInDouble> rays_;
  bool keeps_ = false;
};

/// A file of rays, read in parts: float32 or float64, little endian, of shape (n, 8), with the columns in the
/// order of Ray, or (n, 6): origin, direction, without bounds. float64 is rounded to float32; a finite value beyond its
/// range becomes the largest float32, because an infinite one would make the ray dead. So does an infinite t_max, which
/// is no bound either. Belongs to one thread at a time.
class RayFile {
 public:
  /// Reads the header. "-" is standard input. Throws Error(Work) that names the file, the dtype and shape found, and
  /// those expected.
  explicit RayFile(const std::filesystem::path& path);
  RayFile(RayFile&&) noexcept;
  ~RayFile();
  /// Returns the number of rays, of the part if one was chosen.
  std::uint64_t count() const { return count_; }
  /// Keeps part `index` of `parts` equal parts of the rays alone. Call it before read(). Throws Error(Work) if the file
  /// is standard input.
  void choose_part(std::uint64_t index, std::uint64_t parts);
  /// Asks a scene: what is read are then rays about its origin, those of float64 and of scenes with an origin moved as
  /// Recentring says. Call it before read(). Returns how far they are moved.
  std::shared_ptr<MovedRays> ask(const Recentring& scene);
  /// Returns true if float32 may not hold rays about a scene's origin: they are float64, or the scene has an origin.
  bool is_wide(const Recentring& scene) const { return wide_ || scene.origin() != glm::dvec3(0); }
  /// Reads the next rays and returns their number: fewer than rays.size() only at the end. In double they are not
  /// rounded, and not moved along themselves. Throws Error(Work).
  std::size_t read(std::span<Ray> rays);
  std::size_t read(std::span<RayInDouble> rays);
  /// Returns the dead ones of the rays that were read.
  const DeadRays& dead() const { return dead_; }

 private:
  std::size_t read_as_it_is(std::span<Ray> rays);
  /// Reads rows and makes rays of them by make(ray in the world, where it goes, how far it is moved).
  template <class Kind, class Make>
  std::size_t read_rows(std::span<Kind> rays, const Make& make);
  template <class Number, class Kind, class Make>
  void make_rays(const Number* rows, std::span<Kind> rays, const Make& make);
  void count(std::span<const Ray> rays);

  std::optional<Recentring> recentring_;
  std::shared_ptr<MovedRays> moved_ = std::make_shared<MovedRays>();
  std::unique_ptr<NpyFile> file_;
  std::uint64_t count_ = 0, left_ = 0, columns_ = 0;
  bool wide_ = false;
  DeadRays dead_;
};

/// Reads a whole file of rays. Throws as RayFile does.
std::vector<Ray> read_rays(const std::filesystem::path& path);
/// Writes rays as float32 of shape (n, 8), atomically. Throws Error(Work).
void write_rays(const std::filesystem::path& path, std::span<const Ray> rays);

/// Writes hits as a structured array [('t','<f4'),('prim','<u4'),('u','<f4'),('v','<f4')] of shape (n,), atomically.
/// Throws Error(Work).
void write_hits(const std::filesystem::path& path, std::span<const Hit> hits);
/// Returns the first bytes of such a file; the hits follow as they are in memory.
std::string hits_start(std::uint64_t count);

/// A hit whose t is a double, which files have side by side: [('t','<f8'),('prim','<u4'),('u','<f4'),('v','<f4')].
struct HitInDouble {
  std::array<std::uint32_t, 2> t;  // its bits, the lower half first
  std::uint32_t prim;
  float u, v;
};
static_assert(sizeof(HitInDouble) == 20);
std::string hits_in_double_start(std::uint64_t count);
/// Reads a file of write_hits(). Throws Error(Work) as read_rays() does.
std::vector<Hit> read_hits(const std::filesystem::path& path);

/// Writes triangles as float32 of shape (n, 3, 3): triangle, vertex, coordinate; atomically. Throws Error(Work).
void write_triangles(const std::filesystem::path& path, std::span<const Triangle> triangles);

}  // namespace ballot
