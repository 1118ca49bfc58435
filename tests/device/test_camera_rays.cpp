// Tests of traversal kernels that generate the camera rays themselves. Their hits equal, bit for bit, the hits of rays
// that a generator kernel wrote.
#include "engine/render/batch/ray_kinds.h"
#include "engine/render/data/camera.h"
#include "tests/cpu/shapes.h"
#include "tests/device/fixture.h"

namespace ballot {
namespace {

using namespace harness;

constexpr std::uint32_t kWidth = 37, kHeight = 21;

class CameraRaysTest : public DeviceTest {
 protected:
  /// Returns a list of pixels in scattered order. Some of them lie outside the picture.
  static std::vector<std::uint32_t> pixels() {
    std::vector<std::uint32_t> list;
    for (std::uint32_t y = 0; y < kHeight + 2; ++y)
      for (std::uint32_t x = 0; x < kWidth + 3; ++x) list.push_back(LISTED_PIXEL(x, y));
    for (std::size_t i = 0; i < list.size(); ++i) std::swap(list[i], list[i * 7919 % list.size()]);
    return list;
  }

  static View view(bool orthographic) {
    View v{.name = "", .orthographic = orthographic, .ymag = 1.5};
    v.world_from_camera[3] = {0.1, 0.2, 4, 1};
    return v;
  }

  /// Returns a camera for `together` samples of each listed pixel, beginning with the second sample and the fourth
  /// pixel.
  PrimaryPush camera(bool orthographic, std::uint32_t together) const {
    PrimaryPush push = camera_push(view(orthographic), kWidth, kHeight);
    push.first = 3;
    push.together = together;
    push.sample_index = 1;
    push.sample_count = 40;
    push.count = std::uint32_t(pixels().size() - push.first) * together;
    return push;
  }

  /// Generates the rays with a kernel of their own and traces them.
  std::vector<Hit> by_rays_read(Tracer& tracer, const PrimaryPush& push, const Query& query) {
    Buffer<Ray> rays(*gpu_, push.count, Access::Storage, "rays");
    Buffer<Hit> hits(*gpu_, push.count, Access::Storage, "hits");
    Kernel primary(*gpu_, primary_source(true, through({}, view(push.orthographic))));
    primary.bind(BIND_LISTED, listed_);
    primary.bind(BIND_RAYS, rays);
    gpu_->submit("primary", [&](Commands& cmd) { primary.dispatch(cmd, (push.count + 63) / 64, push); });
    tracer.trace(rays, hits, push.count, query);
    return downloaded(hits);
  }

  /// Traces rays that the traversal kernel generates.
  std::vector<Hit> by_rays_made(Tracer& tracer, const PrimaryPush& push, const Query& query) {
    Buffer<PrimaryPush> cameras(*gpu_, 2, Access::Storage, "cameras");
    cameras.upload(std::vector<PrimaryPush>{PrimaryPush{}, push});
    Buffer<Hit> hits(*gpu_, push.count, Access::Storage, "hits");
    hits.upload(std::vector<Hit>(push.count, Hit{-1, 77, -1, -1}));
    const PassScope scope(*gpu_);
    const CameraKind kind = push.orthographic ? CameraKind::Orthographic : CameraKind::Perspective;
    tracer.record(CameraRays{cameras, 1, listed_, kind}, hits, push.count, query, [](double) {});
    gpu_->finish();
    return downloaded(hits);
  }

  /// Expects equal hits either way. Where the driver does not allow generated rays, counts that in looked_at_.
  void expect_same(Tracer& tracer, const Query& query, bool orthographic, std::uint32_t together) {
    SCOPED_TRACE(tracer.variant(query).name());
    const PrimaryPush push = camera(orthographic, together);
    if (!tracer.can_record(query, push.count)) {
      ++looked_at_;
      return;
    }
    const std::vector<Hit> read = by_rays_read(tracer, push, query), made = by_rays_made(tracer, push, query);
    EXPECT_EQ(count_different(read, made), 0u);
    const auto met = std::ranges::count_if(made, [](const Hit& h) { return h.prim != NO_HIT; });
    EXPECT_GT(std::size_t(met), made.size() / 16);
    EXPECT_LT(std::size_t(met), made.size());
    ++compared_;
  }

  Buffer<std::uint32_t> listed_ = [this] {
    const std::vector<std::uint32_t> all = pixels();
    Buffer<std::uint32_t> buffer(*gpu_, all.size(), Access::Storage, "listed pixels");
    buffer.upload(all);
    return buffer;
  }();
  int compared_ = 0, looked_at_ = 0;

 private:
  static std::vector<Hit> downloaded(const Buffer<Hit>& buffer) {
    std::vector<Hit> hits(buffer.size());
    buffer.download(std::span(hits));
    return hits;
  }
};

TEST_F(CameraRaysTest, HitsAreThoseOfRaysThatAreRead) {
  const auto t = make(*gpu_, shapes::soup(300, 0.3f));
  for (const NumericMode& mode : kNumericModes) {
    if (mode.needs_float64 && !gpu_->info().float64) continue;
    for (const Method& method : kMethods) {
      if (method.chooses || (mode.name != kDefaultNumeric && method.name != std::string_view("while-while"))) continue;
      expect_same(*t->tracer, {Want::Nearest, std::string(method.name), std::string(mode.name), {}}, false, 3);
    }
  }
  for (const std::uint32_t together : {1u, 16u})
    expect_same(*t->tracer, {Want::Nearest, "while-while", "watertight", {}}, true, together);
  // Where a driver cuts loops short, the host has to check each dispatch for unfinished rays and trace those again. The
  // rays must then be in memory, so the traversal cannot generate them.
  EXPECT_EQ(looked_at_ == 0, compared_ > 0);
  EXPECT_EQ(compared_ > 0, !t->tracer->variant({Want::Nearest, "while-while", "watertight", {}}).config.loops_cut);
}

}  // namespace
}  // namespace ballot
