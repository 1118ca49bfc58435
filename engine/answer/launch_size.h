// How many rays one launch may take, so that it ends soon: systems give up devices whose launches take seconds, and
// screens stand still meanwhile.
#pragma once

#include <algorithm>
#include <cstdint>

namespace ballot {

/// The size of the next launch of a kernel, from how long the last one took.
class LaunchSize {
 public:
  static constexpr std::uint64_t kFirst = 1 << 14;    // rays of the first launch, of which nothing is known
  static constexpr std::uint64_t kTelling = 1 << 14;  // fewer rays do not fill a device and tell nothing of its speed
  static constexpr std::uint64_t kAligned = 1 << 14;  // larger launches are multiples of this, so packets stay whole
  static constexpr std::uint64_t kLeast = 1 << 10;    // rays
  static constexpr double kGrowth = 64;  // largest ratio of a launch to the last: later rays may be as much slower

  LaunchSize() = default;
  /// Of a kernel that may do any work for a ray: its launches begin with `least` rays, and may become as small.
  explicit LaunchSize(std::uint64_t least) : least_(least), first_(least) {}

  /// Returns the most rays for a launch that should take at most `target_ms` on the device.
  std::uint64_t most(double target_ms) const {
    if (rays_ == 0) return first_;
    const double wanted = double(rays_) * std::min(target_ms / std::max(ms_, 1e-3), kGrowth);
    const auto rays = std::uint64_t(std::clamp(wanted, double(least_), double(std::uint64_t{1} << 32)));
    return rays > kAligned ? rays / kAligned * kAligned : rays / least_ * least_;
  }
  /// Notes that a launch of so many rays took so long on the device; 0 if their number is unknown.
  void add(std::uint64_t rays, double ms) {
    if (rays == 0) return;
    if (rays < kTelling && ms < kTellingMs) {
      first_ = std::max(first_, std::min(kFirst, rays * std::uint64_t(kGrowth)));
      if (rays >= rays_) rays_ = 0;  // fewer rays took longer before: the driver compiled meanwhile
      return;
    }
    rays_ = rays;
    ms_ = ms;
  }
  bool is_known() const { return rays_ > 0; }

 private:
  static constexpr double kTellingMs = 5;          // a launch of few rays that takes this long tells, too
  std::uint64_t least_ = kLeast, first_ = kFirst;  // rays of a launch; of the first ones, that tell nothing
  std::uint64_t rays_ = 0;
  double ms_ = 0;
};

}  // namespace ballot
