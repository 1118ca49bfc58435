// What tests of kernels of users share: their runs, and the answers of the built-in kernels to hold them to.
#pragma once

#include "engine/answer/point_queries.h"
#include "engine/answer/user_kernel.h"
#include "tests/device/crossing_test.h"

namespace ballot {

/// A kernel over rays that calls what is told.
inline UserText over_rays(const char* type, const std::string& answer, const std::string& before = "") {
  UserText text;
  text.text =
      fmt::format("readonly buffer Rays {{ Ray rays[]; }}; {}\nbuffer Answers {{ {} answers[]; }};\n", before, type) +
      "void main(uint index) { answers[index] = " + answer + "; }";
  return text;
}

class UserKernelTest : public CrossingTest {
 protected:
  struct Answers {
    std::vector<Hit> hits;
    std::vector<std::uint32_t> occluded, counts;
    std::vector<Nearest> near;
  };

  /// What the built-in kernels find.
  static Answers built_in(Tracer& tracer, std::span<const Ray> rays, std::span<const ProbePoint> points) {
    Answers a;
    a.hits.resize(rays.size());
    tracer.trace(rays, a.hits, {.method = "while-while"});
    for (const Hit& hit : a.hits) a.occluded.push_back(hit.prim != NO_HIT);
    RayQueries crossings(*gpu_, tracer.tree());
    a.counts = counts(crossings, rays);
    PointQueries nearest(*gpu_, tracer.tree());
    a.near.resize(points.size());
    nearest.nearest(points, a.near);
    return a;
  }

  template <class T>
  static Buffer<T> on_device(std::span<const T> data, const char* name) {
    Buffer<T> buffer(*gpu_, data.size(), Access::Storage, name);
    buffer.upload(data);
    return buffer;
  }
  template <class T>
  static std::vector<T> read(const Buffer<T>& buffer) {
    std::vector<T> data(buffer.size());
    buffer.download(std::span(data));
    return data;
  }
  template <class T>
  static std::size_t different(const std::vector<T>& a, const std::vector<T>& b) {
    EXPECT_EQ(a.size(), b.size());
    std::size_t n = 0;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) n += std::memcmp(&a[i], &b[i], sizeof(T)) != 0;
    return n;
  }

  template <class T>
  static std::vector<T> answers(DeviceTree& tree, UserText text, std::span<const Ray> rays) {
    UserKernel kernel(*gpu_, tree, std::move(text));
    const Buffer<Ray> asked = on_device(rays, "rays");
    Buffer<T> found(*gpu_, rays.size(), Access::Storage, "answers");
    kernel.bind("rays", asked);
    kernel.bind("answers", found);
    kernel.run(std::uint32_t(rays.size()));
    return read(found);
  }
};

}  // namespace ballot
