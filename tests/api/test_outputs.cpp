// Columns of answers on the device: each has the bits of the column that the host gets.
#include <cmath>
#include <cstring>
#include <functional>

#include "api.h"

namespace {

template <class T>
std::vector<T> read(const ballot::Array<T>& array) {
  std::vector<T> all(array.size());
  array.read(all);
  return all;
}

/// Answers of n rays or points in the host's memory.
struct Here {
  explicit Here(std::size_t n)
      : hits(n),
        nearest(n),
        t(n),
        distances(n),
        signs(n),
        uvs(2 * n),
        normals(3 * n),
        points(3 * n),
        prims(n, 5),
        ids(n, 5),
        instances(n, 5),
        flags(n, 5) {}
  std::vector<ballot::Hit> hits;
  std::vector<ballot::NearestPoint> nearest;
  std::vector<float> t, distances, signs, uvs, normals, points;
  std::vector<std::uint32_t> prims, ids, instances;
  std::vector<std::uint8_t> flags;
};

/// The same on the device.
struct There {
  There(const ballot::Device& device, std::size_t n)
      : hits(device, n),
        nearest(device, n),
        t(device, n),
        signs(device, n),
        uvs(device, n),
        normals(device, n),
        points(device, n),
        prims(device, n),
        ids(device, n),
        instances(device, n),
        flag_words(device, n),
        flags(device, n) {}
  ballot::Array<ballot::Hit> hits;
  ballot::Array<ballot::NearestPoint> nearest;
  ballot::Array<float> t, signs;
  ballot::Array<std::array<float, 2>> uvs;
  ballot::Array<std::array<float, 3>> normals, points;
  ballot::Array<std::uint32_t> prims, ids, instances, flag_words;
  ballot::Array<std::uint8_t> flags;
};

template <class A, class B>
void expect_equal(const std::vector<A>& here, const ballot::Array<B>& there, std::size_t n, const char* what) {
  const std::vector<B> found = read(there);
  const auto* bytes = reinterpret_cast<const unsigned char*>(here.data());
  std::size_t same = 0;
  while (same < n && std::memcmp(bytes + same * sizeof(B), &found[same], sizeof(B)) == 0) ++same;
  EXPECT_EQ(same, n) << what;
}

class Outputs : public Api {
 protected:
  /// Rays into the unit cube and past it, n of them, which is no multiple of four.
  static std::vector<ballot::Ray> some_rays(std::size_t n = 1003) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> at(-1.5f, 1.5f);
    std::vector<ballot::Ray> rays(n);
    for (ballot::Ray& r : rays)
      r = {{3 * at(random), 3 * at(random), 3}, 0, {0, 0, -1}, 100}, r.dir[0] = 0.3f * at(random),
      r.dir[1] = at(random);
    for (ballot::Ray& r : rays)
      for (int k = 0; k < 3; ++k) r.origin[k] = at(random) - 3 * r.dir[k];
    return rays;
  }

  /// A closed box that is turned about, so that its normals have all kinds of numbers.
  static std::vector<float> box(float x, float size, float turn) {
    std::vector<float> corners;
    for (int i = 0; i < 8; ++i) {
      const float p = size * float(i & 1 ? 1 : -1), q = size * float(i & 2 ? 1 : -1), r = size * float(i & 4 ? 1 : -1);
      corners.insert(corners.end(), {x + p * std::cos(turn) - q * std::sin(turn),
                                     p * std::sin(turn) + q * std::cos(turn) + 0.3f * r, r - 0.1f * p});
    }
    return corners;
  }
  static inline const std::vector<std::uint32_t> kBox{0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                                      2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  static ballot::Mesh mesh_of(const std::vector<float>& positions, std::uint32_t id) {
    ballot::Mesh mesh = ballot::mesh(positions, kBox);
    mesh.id = id;
    return mesh;
  }

  /// Compares all columns of hits and points of a scene with the host's.
  static void compare(const ballot::Scene& scene, const char* what, const ballot::Query& query = {}) {
    SCOPED_TRACE(what);
    compare_hits(scene, query);
    for (const char* sign : {"parity", "pseudonormal"}) compare_points(scene, {.numeric = query.numeric, .sign = sign});
  }
  static void compare_hits(const ballot::Scene& scene, const ballot::Query& query) {
    const auto rays = some_rays();
    const std::size_t n = rays.size();
    Here here(n);
    There there(*device_, n);
    ballot::Array<ballot::Ray> in(*device_, n);
    in.write(rays);
    const ballot::Times times = scene.trace(rays,
                                            {.hits = here.hits.data(),
                                             .t = here.t.data(),
                                             .prims = here.prims.data(),
                                             .mesh_ids = here.ids.data(),
                                             .uvs = here.uvs.data(),
                                             .normals = here.normals.data(),
                                             .occluded = here.flags.data(),
                                             .instances = here.instances.data()},
                                            query);
    EXPECT_GT(times.hits, n / 20);
    const std::vector<ballot::Output> all{{"hits", there.hits},      {"t", there.t},
                                          {"prims", there.prims},    {"mesh_ids", there.ids},
                                          {"uvs", there.uvs},        {"normals", there.normals},
                                          {"occluded", there.flags}, {"instances", there.instances}};
    const auto expect_all = [&](std::size_t first, std::size_t last) {
      const std::function<void()> checks[] = {[&] { expect_equal(here.hits, there.hits, n, "hits"); },
                                              [&] { expect_equal(here.t, there.t, n, "t"); },
                                              [&] { expect_equal(here.prims, there.prims, n, "prims"); },
                                              [&] { expect_equal(here.ids, there.ids, n, "mesh_ids"); },
                                              [&] { expect_equal(here.uvs, there.uvs, n, "uvs"); },
                                              [&] { expect_equal(here.normals, there.normals, n, "normals"); },
                                              [&] { expect_equal(here.flags, there.flags, n, "occluded"); },
                                              [&] { expect_equal(here.instances, there.instances, n, "instances"); }};
      for (std::size_t i = first; i < last; ++i) checks[i]();
    };
    EXPECT_EQ(scene.trace(in, all, n, query).hits, 0u);
    expect_all(0, all.size());
    there = There(*device_, n);
    const std::vector<ballot::Output> again{{"hits", there.hits},      {"t", there.t},
                                            {"prims", there.prims},    {"mesh_ids", there.ids},
                                            {"uvs", there.uvs},        {"normals", there.normals},
                                            {"occluded", there.flags}, {"instances", there.instances}};
    for (std::size_t i = 0; i < again.size(); ++i) {  // each by itself
      scene.submit(in, {again[i]}, n, query).wait();
      expect_all(i, i + 1);
    }
  }
  static void compare_points(const ballot::Scene& scene, const ballot::Query& query) {
    std::vector<ballot::Point> asked;
    std::vector<float> given;
    for (const ballot::Ray& r : some_rays()) {
      asked.push_back({{r.origin[0], r.origin[1], r.origin[2]}, INFINITY});
      given.insert(given.end(), r.origin, r.origin + 3);
    }
    const std::size_t n = asked.size();
    Here here(n);
    There there(*device_, n);
    ballot::Array<ballot::Point> in(*device_, n);
    in.write(asked);
    scene.nearest(given,
                  {.distances = here.distances.data(),
                   .points = here.points.data(),
                   .prims = here.prims.data(),
                   .mesh_ids = here.ids.data(),
                   .uvs = here.uvs.data(),
                   .normals = here.normals.data(),
                   .signed_distances = here.signs.data(),
                   .inside = here.flags.data(),
                   .nearest = here.nearest.data()},
                  query);
    scene.nearest(in,
                  {{"distances", there.t},
                   {"points", there.points},
                   {"prims", there.prims},
                   {"mesh_ids", there.ids},
                   {"uvs", there.uvs},
                   {"normals", there.normals},
                   {"signed_distances", there.signs},
                   {"inside", there.flags},
                   {"nearest", there.nearest}},
                  n, query);
    expect_equal(here.distances, there.t, n, "distances");
    expect_equal(here.points, there.points, n, "points");
    expect_equal(here.prims, there.prims, n, "prims");
    expect_equal(here.ids, there.ids, n, "mesh_ids");
    expect_equal(here.uvs, there.uvs, n, "uvs");
    expect_equal(here.normals, there.normals, n, "normals");
    expect_equal(here.signs, there.signs, n, "signed_distances");
    expect_equal(here.flags, there.flags, n, "inside");
    for (ballot::NearestPoint& p : here.nearest) p.spare = 0;
    std::vector<ballot::NearestPoint> found = read(there.nearest);
    for (ballot::NearestPoint& p : found) p.spare = 0;
    EXPECT_EQ(std::memcmp(here.nearest.data(), found.data(), n * sizeof found[0]), 0) << "nearest";
    scene.nearest(in, {{"inside", there.flag_words}}, n, query);
    const std::vector<std::uint32_t> words = read(there.flag_words);
    EXPECT_TRUE(std::equal(words.begin(), words.end(), here.flags.begin())) << "inside as words";
  }
};

TEST_F(Outputs, OfFlatScenesThatMove) {
  const std::vector<float> left = box(-0.6f, 0.5f, 0.4f), right = box(0.7f, 0.4f, 1.3f), moved = box(0.9f, 0.45f, 2.1f);
  for (const char* builder : {"balanced", "device"}) {
    ballot::Scene scene(*device_, {mesh_of(left, 70), mesh_of(right, 9)}, {.builder = builder, .updates = "refit"});
    compare(scene, builder);
    compare(scene, "exact", {.numeric = "exact"});
    move(scene, 1, moved);
    compare(scene, "refitted");
  }
}

TEST_F(Outputs, OfShapesAmongTriangles) {
  const std::vector<float> solid = box(-0.2f, 0.3f, 0.4f), ends{0.2f, -0.4f, 0, 0.5f, 0.1f, 0.6f, -0.7f, 0.5f, -0.2f},
                           radii{0.3f, 0.1f, 0.25f}, corners{-0.9f, -0.9f, -0.9f, -0.4f, -0.5f, -0.6f};
  const std::vector<std::uint32_t> segments{0, 1, 1, 2};
  const std::vector<float> places{1,    0,    0.2f, -0.7f, 0,     1,    0, 0,     0, 0, 1,      0,     // of triangles
                                  0.9f, 0.3f, 0,    0.4f,  -0.3f, 0.9f, 0, 0.4f,  0, 0, 0.949f, 0.1f,  // of spheres
                                  -1,   0,    0,    0.5f,  0,     1,    0, -0.2f, 0, 0, 1,      0};    // a mirror
  ballot::Mesh spheres = ballot::shapes("spheres", ends, radii),
               cones = ballot::shapes("capsules", ends, radii, segments);
  spheres.id = 70, cones.id = 9;
  for (const char* builder : {"balanced", "device"}) {
    ballot::Scene scene(*device_, {mesh_of(solid, 3), spheres, cones, ballot::shapes("boxes", corners)},
                        {.builder = builder});
    compare(scene, builder);
    const std::vector<std::uint32_t> of{0, 1, 2};
    scene.add_instances(ballot::instances(places, of));
    scene.commit();
    compare_hits(scene, {});
    std::vector<float> moved = ends;
    moved[0] = -0.5f;
    move(scene, 1, moved);
    compare_hits(scene, {});
  }
}

TEST_F(Outputs, OfInstancesThatMoveAndAreEdited) {
  const std::vector<float> left = box(-0.2f, 0.3f, 0.4f), right = box(0.1f, 0.4f, 1.3f), moved = box(0.2f, 0.25f, 2.1f);
  const std::vector<float> places{1,    0,    0.2f, -0.7f, 0,     1, 0, 0,     0, 0, 1, 0,     // of mesh 0
                                  0.9f, 0.3f, 0,    0.6f,  -0.3f, 1, 0, 0.4f,  0, 0, 1, 0.1f,  // of mesh 1
                                  -1,   0,    0,    0.5f,  0,     1, 0, -0.8f, 0, 0, 1, 0};    // a mirror
  const std::vector<std::uint32_t> meshes{0, 1, 0};
  for (const char* builder : {"balanced", "device"}) {
    ballot::Scene scene(*device_, {mesh_of(left, 70), mesh_of(right, 9)}, ballot::instances(places, meshes),
                        {.builder = builder, .updates = "refit"});
    compare(scene, builder);
    std::vector<float> turned = places;
    turned[3] = -0.4f, turned[13] = 0.5f;
    place(scene, turned);
    compare(scene, "placed");
    move(scene, 1, moved);
    compare(scene, "moved");
    const std::uint32_t added = scene.add_mesh(mesh_of(left, 3)), first = 0;
    scene.add_instances(ballot::instances(std::span(places).subspan(12, 12), std::span(&added, 1)));
    scene.remove_instances(std::span(&first, 1));
    scene.commit();
    compare(scene, "edited");
  }
}

// Jobs share what lies between their kernels, which grows from one to the next.
TEST_F(Outputs, JobsFollowEachOther) {
  const ballot::Scene scene(*device_, {grid_.mesh()});
  const std::size_t sizes[] = {1000, 5000, 3000, 20000, 20000, 7};
  std::vector<ballot::Array<ballot::Ray>> in;
  std::vector<There> there;
  std::vector<ballot::Job> jobs;
  const auto all = some_rays(20000);
  for (const std::size_t n : sizes) {
    in.emplace_back(*device_, n).write(std::span(all).last(n));
    There& to = there.emplace_back(*device_, n);
    jobs.push_back(scene.submit(in.back(), {{"t", to.t}, {"normals", to.normals}, {"occluded", to.flags}}, n,
                                {.ray_class = "diffuse"}));
  }
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    const std::size_t n = sizes[i];
    Here here(n);
    scene.trace(std::span(all).last(n),
                {.t = here.t.data(), .normals = here.normals.data(), .occluded = here.flags.data()});
    jobs[i].wait();
    expect_equal(here.t, there[i].t, n, "t");
    expect_equal(here.normals, there[i].normals, n, "normals");
    expect_equal(here.flags, there[i].flags, n, "occluded");
  }
}

// More points than are answered at a time. Most are beyond their limit of every triangle.
TEST_F(Outputs, PartsFollowEachOther) {
  const std::vector<float> corners = box(0, 1, 0);
  const ballot::Scene scene(*device_, {mesh_of(corners, 4)});
  const std::size_t n = (1u << 22) + 1003;
  std::vector<ballot::Point> points(n, {{40, 40, 40}, 0.5f});
  const std::size_t near[] = {5, n - 1003, n - 1};
  for (const std::size_t i : near) points[i] = {{0, 0, 0}, 5};
  ballot::Array<ballot::Point> in(*device_, n);
  in.write(points);
  ballot::Array<float> signs(*device_, n);
  ballot::Array<std::uint32_t> ids(*device_, n);
  ballot::Array<std::uint8_t> inside(*device_, n);
  for (const char* sign : {"parity", "pseudonormal"}) {
    scene.nearest(in, {{"signed_distances", signs}, {"mesh_ids", ids}, {"inside", inside}}, n, {.sign = sign});
    const std::vector<float> distances = read(signs);
    for (const std::size_t i : near)
      EXPECT_TRUE(distances[i] < -0.5f && distances[i] == distances[5] && read(ids)[i] == 4 && read(inside)[i]) << i;
    EXPECT_EQ(std::ranges::count(distances, INFINITY), std::ptrdiff_t(n - 3));
    EXPECT_EQ(std::ranges::count(read(inside), 1), 3);
  }
}

TEST_F(Outputs, WrongOnesAreRefused) {
  const ballot::Scene scene(*device_, {grid_.mesh()});
  const auto rays = rays_down(10);
  ballot::Array<ballot::Ray> in(*device_, 10);
  in.write(rays);
  There there(*device_, 10);
  there.t.write(std::vector<float>(10, 7));
  const ballot::Device other;
  ballot::Array<float> elsewhere(other, 10), few(*device_, 9);
  const auto refused = [&](const std::vector<ballot::Output>& outputs, const char* part) {
    std::string text;
    EXPECT_EQ(code_of([&] { scene.trace(in, outputs, 10); }, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_EQ(code_of([&] { scene.submit(in, outputs, 10); }), BALLOT_ERROR_ARGUMENT);
  };
  refused({}, "no output; expected some of hits, t, prims");
  refused({{"distances", there.t}}, "'distances'");
  refused({{nullptr, there.t}}, "column");
  refused({{"t", there.t}, {"uvs", there.normals}}, "uvs holds other records; expected float32x2");
  refused({{"t", there.t}, {"occluded", there.signs}}, "expected uint8 or uint32");
  refused({{"t", there.t}, {"t", there.signs}}, "t is given twice");
  refused({{"prims", there.prims}, {"mesh_ids", there.prims}}, "one array is given for mesh_ids and another");
  refused({{"t", there.t}, {"hits", in}}, "what is asked");
  refused({{"t", elsewhere}}, "another device");
  refused({{"t", few}}, "9 records; expected 10");
  EXPECT_EQ(code_of([&] { scene.trace(in, {{"t", BallotTarget()}}, 10); }), BALLOT_ERROR_CLOSED);
  EXPECT_EQ(ballot_trace_buffers(scene.handle(), in.handle(), 10, nullptr, 1, nullptr, nullptr), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(read(there.t), std::vector<float>(10, 7));
  scene.trace(in, {{"t", there.t}}, 3);  // the rest stays
  EXPECT_EQ(read(there.t)[3], 7);
  there.flags.write(std::vector<std::uint8_t>(10, 7));
  scene.trace(in, {{"occluded", there.flags}}, 6);
  EXPECT_EQ(read(there.flags)[6], 7);
  EXPECT_LT(read(there.flags)[5], 2);
  scene.trace(in, {{"occluded", there.flags}}, 0);
}

}  // namespace
