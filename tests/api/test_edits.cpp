// Edits of scenes: whatever is edited, a scene answers as one that is made so from the beginning.
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <thread>

#include "tests/api/api.h"

namespace {

using Numbers = std::vector<std::uint32_t>;
using Matrix = std::array<float, 12>;

constexpr Matrix kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// A scene beside what it should be.
class Model {
 public:
  struct Part {
    std::vector<float> positions;
    Numbers indices;
    std::uint32_t id;
  };
  struct Place {
    std::uint32_t mesh;
    Matrix matrix;
    std::uint32_t mask;
  };

  ballot::Mesh mesh(const Part& p) const {
    ballot::Mesh made = ballot::mesh(p.positions, p.indices);
    made.id = p.id;
    return made;
  }

  /// Makes the scene anew.
  ballot::Scene made(const ballot::Device& device, const char* layout) const {
    std::vector<ballot::Mesh> meshes;
    std::map<std::uint32_t, std::uint32_t> index;
    for (const auto& [number, part] : parts) {
      index[number] = std::uint32_t(meshes.size());
      meshes.push_back(mesh(part));
    }
    std::vector<float> transforms;
    Numbers which, masks;
    for (const auto& [number, p] : places) {
      transforms.insert(transforms.end(), p.matrix.begin(), p.matrix.end());
      which.push_back(index.at(p.mesh));
      masks.push_back(p.mask);
    }
    return {device, meshes, ballot::instances(transforms, which, masks), {.layout = layout}};
  }

  std::map<std::uint32_t, Part> parts;
  std::map<std::uint32_t, Place> places;
};

/// Random meshes, matrices and edits.
class Editor {
 public:
  explicit Editor(unsigned seed) : random_(seed) {}

  std::uint32_t below(std::uint32_t n) { return std::uint32_t(random_() % n); }
  float at(float lo, float hi) { return std::uniform_real_distribution<float>(lo, hi)(random_); }

  Model::Part part(std::uint32_t id) {
    Grid grid(1 + below(6));
    for (float& x : grid.positions) x += at(-0.1f, 0.1f);
    return {grid.positions, grid.indices, id};
  }
  Matrix matrix() {
    const float a = at(-3, 3), s = at(0.5f, 1.5f);
    return {s * std::cos(a),
            -s * std::sin(a),
            0,
            at(-2, 2),
            s * std::sin(a),
            s * std::cos(a),
            0,
            at(-2, 2),
            at(-0.2f, 0.2f),
            0,
            below(2) ? 1.f : -1.f,
            at(-1, 1)};
  }
  template <class Map>
  std::uint32_t some(const Map& map) {
    return std::next(map.begin(), below(std::uint32_t(map.size())))->first;
  }

  /// Makes an edit of the scene and of the model.
  void edit(ballot::Scene& scene, Model& model) {
    const std::uint32_t kind = below(9);
    if (kind == 0 || model.parts.empty()) {
      const Model::Part made = part(below(100));
      model.parts.insert_or_assign(scene.add_mesh(model.mesh(made)), made);
    } else if (kind == 1 || model.places.empty()) {
      const std::uint32_t mesh = some(model.parts), mask = below(3) ? 0xFFFFFFFF : 1 + below(3);
      const Matrix m = below(3) ? matrix() : kIdentity;
      const Numbers number = scene.add_instances(ballot::instances(m, Numbers{mesh}, Numbers{mask}));
      model.places.insert_or_assign(number[0], Model::Place{mesh, m, mask});
    } else if (kind == 2 && model.parts.size() > 1) {
      const std::uint32_t mesh = some(model.parts);
      scene.remove_mesh(mesh);
      model.parts.erase(mesh);
      std::erase_if(model.places, [&](const auto& p) { return p.second.mesh == mesh; });
      positions_.erase(mesh);
    } else if (kind == 3) {
      const std::uint32_t place = some(model.places);
      scene.remove_instances(Numbers{place});
      model.places.erase(place);
    } else if (kind == 4) {
      const std::uint32_t mesh = some(model.parts);
      const Model::Part made = part(model.parts.at(mesh).id);
      scene.replace_mesh(mesh, model.mesh(made));
      model.parts.at(mesh) = made;
    } else if (kind == 5) {
      const std::uint32_t place = some(model.places), mask = below(3);
      scene.set_masks(Numbers{place}, Numbers{mask});
      model.places.at(place).mask = mask;
    } else {
      move(scene, model, kind);
    }
  }

 private:
  void move(ballot::Scene& scene, Model& model, std::uint32_t kind) {
    if (kind == 6) {
      const std::uint32_t place = some(model.places);
      model.places.at(place).matrix = matrix();
      scene.set_transforms(Numbers{place}, model.places.at(place).matrix);
    } else if (kind == 7) {
      all_.clear();
      for (auto& [number, p] : model.places) {
        p.matrix = matrix();
        all_.insert(all_.end(), p.matrix.begin(), p.matrix.end());
      }
      scene.set_transforms(all_);
    } else {
      const std::uint32_t mesh = some(model.parts);
      Model::Part& p = model.parts.at(mesh);
      for (float& x : p.positions) x += at(-0.1f, 0.1f);
      positions_[mesh] = p.positions;
      scene.set_vertices(mesh, positions_[mesh]);
    }
  }

  std::mt19937 random_;
  std::vector<float> all_;  // what a scene reads when it commits
  std::map<std::uint32_t, std::vector<float>> positions_;
};

class ApiEdits : public Api {
 protected:
  /// Everything that rays and points find, with prims, numbers of instances as ranks, and ids.
  struct Answers {
    explicit Answers(const ballot::Scene& scene) {
      std::mt19937 random(3);
      std::uniform_real_distribution<float> at(-3, 3);
      std::vector<ballot::Ray> rays(200);
      for (ballot::Ray& r : rays) r = {{at(random), at(random), 4}, 0, {at(random) / 9, at(random) / 9, -1}, INFINITY};
      hits.resize(rays.size()), ids.resize(rays.size()), instances.resize(rays.size()), blocked.resize(rays.size());
      scene.trace(rays, {.hits = hits.data(), .mesh_ids = ids.data(), .instances = instances.data()});
      scene.trace(rays, {.occluded = blocked.data()}, {.any = true});
      const Numbers of_rays(rays.size(), 1);
      ballot::RayView masked = ballot::rays(rays);
      masked.masks = of_rays;
      counts = scene.count_crossings(masked);
      std::vector<float> points;
      for (int i = 0; i < 90; ++i) points.push_back(at(random));
      distances.resize(30);
      if (scene.info().instance_triangles) scene.nearest(points, {.distances = distances.data()});
      ballot::PointView seen{points};
      seen.masks = std::span<const std::uint32_t>(of_rays).first(30);
      seen_distances.resize(30);
      scene.nearest(seen, {.distances = seen_distances.data()});
      seen.limit = 2;
      near = scene.within(seen).counts;
      std::map<std::uint32_t, std::uint32_t> rank{{ballot::kMiss, ballot::kMiss}};
      for (const auto& i : scene.instances()) rank.emplace(i.instance, std::uint32_t(rank.size() - 1));
      for (std::uint32_t& i : instances) i = rank.at(i);
    }
    std::vector<ballot::Hit> hits;
    Numbers ids, instances;
    std::vector<std::int64_t> counts, near;
    std::vector<std::uint8_t> blocked;
    std::vector<float> distances, seen_distances;
  };

  static void expect_same(const Answers& a, const Answers& b) {
    ASSERT_EQ(std::memcmp(a.hits.data(), b.hits.data(), a.hits.size() * sizeof a.hits[0]), 0);
    EXPECT_EQ(a.ids, b.ids);
    EXPECT_EQ(a.instances, b.instances);
    EXPECT_EQ(a.blocked, b.blocked);
    EXPECT_EQ(a.counts, b.counts);
    EXPECT_EQ(a.distances, b.distances);
    EXPECT_EQ(a.seen_distances, b.seen_distances);
    EXPECT_EQ(a.near, b.near);
  }
};

/// Vertices of an array on the device give the scene that those of the host give; wrong ones change nothing.
TEST_F(ApiEdits, VerticesOnTheDevice) {
  for (const char* updates : {"refit", "rebuild"}) {
    ballot::Scene here(*device_, {grid_.mesh()}, {.updates = updates});
    ballot::Scene there(*device_, {grid_.mesh()}, {.updates = updates});
    const Grid moved(16, 0.25f);
    std::vector<ballot::Vertex> vertices(moved.positions.size() / 3);
    std::memcpy(vertices.data(), moved.positions.data(), moved.positions.size() * sizeof(float));
    std::optional<ballot::Array<ballot::Vertex>> array(std::in_place, *device_, vertices.size());
    array->write(vertices);
    here.set_vertices(0, moved.positions);
    there.set_vertices(0, *array);
    array.reset();  // the edit keeps it
    here.commit(), there.commit();
    const std::vector<ballot::Ray> rays = rays_down(500);
    std::vector<ballot::Hit> expected(rays.size()), hits(rays.size());
    here.trace(rays, expected), there.trace(rays, hits);
    EXPECT_EQ(std::memcmp(hits.data(), expected.data(), hits.size() * sizeof(ballot::Hit)), 0);
    EXPECT_EQ(there.triangles(), here.triangles());
    ballot::Array<ballot::Vertex> wrong(*device_, vertices.size());
    vertices[5].at[1] = INFINITY;
    wrong.write(vertices);
    there.set_vertices(0, wrong);
    std::string text;
    EXPECT_EQ(code_of([&] { there.commit(); }, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find("mesh 0: vertex 5"), std::string::npos) << text;
    there.trace(rays, hits);
    EXPECT_EQ(std::memcmp(hits.data(), expected.data(), hits.size() * sizeof(ballot::Hit)), 0);
    const ballot::Array<ballot::Vertex> few(*device_, 3);
    EXPECT_EQ(code_of([&] { there.set_vertices(0, few); }), BALLOT_ERROR_ARGUMENT);
  }
}

TEST_F(ApiEdits, AnswersAreThoseOfAFreshScene) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    SCOPED_TRACE(seed);
    Editor editor(seed);
    const char* layout = std::array{"auto", "merge", "separate"}[seed % 3];
    Model model;
    for (std::uint32_t m = 0; m < 3; ++m) {
      model.parts[m] = editor.part(m);
      model.places[m] = {m, kIdentity, 0xFFFFFFFF};
    }
    std::vector<ballot::Mesh> meshes;
    for (const auto& [number, part] : model.parts) meshes.push_back(model.mesh(part));
    ballot::Scene scene(*device_, meshes, {.layout = layout});
    for (int step = 0; step < 12; ++step) {
      SCOPED_TRACE(step);
      for (std::uint32_t edits = 1 + editor.below(4); edits > 0; --edits) editor.edit(scene, model);
      scene.commit();
      const ballot::Scene fresh = model.made(*device_, layout);
      expect_same(Answers(scene), Answers(fresh));
      ASSERT_EQ(scene.meshes().size(), model.parts.size());
      for (const auto& i : scene.instances()) EXPECT_EQ(model.places.at(i.instance).mask, i.mask);
    }
  }
}

TEST_F(ApiEdits, FailuresLeaveTheSceneAsItWas) {
  for (const char* layout : {"merge", "separate"}) {
    const Grid high(4, 1);
    ballot::Scene scene(*device_, {grid_.mesh(), high.mesh(1)}, {.layout = layout});
    const Answers before(scene);
    std::vector<float> lifted = grid_.positions, wrong = high.positions;
    for (std::size_t i = 2; i < lifted.size(); i += 3) lifted[i] += 0.5f;
    wrong[4] = NAN;
    Matrix singular{};
    std::string text;
    const auto expect_no_change = [&](const char* what) {
      EXPECT_EQ(code_of([&] { scene.commit(); }, &text), BALLOT_ERROR_ARGUMENT) << what;
      EXPECT_NE(text.find(what), std::string::npos) << text;
      expect_same(Answers(scene), before);
      scene.commit();  // the edits are gone
      expect_same(Answers(scene), before);
    };
    scene.set_vertices(0, lifted);
    scene.set_vertices(1, wrong);
    expect_no_change("mesh 1: vertex 1 is");
    scene.set_vertices(0, lifted);
    scene.set_transforms(Numbers{1}, singular);
    expect_no_change("instance 1: column 0 of the transform");
    const std::uint32_t added = scene.add_mesh(high.mesh());
    EXPECT_EQ(added, 2u);
    scene.add_instances(ballot::instances(singular, Numbers{added}));
    expect_no_change("instance 2: column 0 of the transform");
    EXPECT_EQ(code_of([&] { scene.remove_mesh(added); }, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_EQ(scene.add_mesh(high.mesh()), 3u);
    scene.discard();
    scene.set_vertices(0, lifted);
    scene.discard();
    scene.commit();
    expect_same(Answers(scene), before);
    scene.set_vertices(0, lifted);
    scene.commit();
    EXPECT_EQ(scene.meshes()[0].lo[2], 0.5f);
  }
}

// Only all edits together can be: an instance is made small, and its mesh so large that it was refused before.
TEST_F(ApiEdits, MovesAreMadeTogether) {
  ballot::Scene scene(*device_, {grid_.mesh()}, ballot::instances(kIdentity));
  std::vector<float> huge = grid_.positions;
  for (float& x : huge) x *= 1e12f;
  Matrix large = kIdentity, small = kIdentity;
  large[0] = large[5] = large[10] = 4;
  small[0] = small[5] = small[10] = 0.5e-12f;
  scene.set_transforms(large);
  scene.commit();
  scene.set_vertices(0, huge);
  EXPECT_EQ(code_of([&] { scene.commit(); }), BALLOT_ERROR_ARGUMENT);
  scene.set_vertices(0, huge);
  scene.set_transforms(small);
  scene.commit();
  EXPECT_EQ(scene.instances()[0].hi[0], 0.5f);
  const ballot::Ray down{{0.25f, 0.25f, 2}, 0, {0, 0, -1}, 10}, beside{{0.75f, 0.25f, 2}, 0, {0, 0, -1}, 10};
  const ballot::Ray rays[] = {down, beside};
  float t[2];
  scene.trace(rays, {.t = t});
  EXPECT_EQ(t[0], 2);
  EXPECT_EQ(t[1], INFINITY);
}

TEST_F(ApiEdits, WrongEditsAddNothing) {
  ballot::Scene scene(*device_, {grid_.mesh(), grid_.mesh(1)});
  const Answers before(scene);
  std::string text;
  const auto expect_refused = [&](const auto& edit, const char* what) {
    EXPECT_EQ(code_of(edit, &text), BALLOT_ERROR_ARGUMENT) << what;
    EXPECT_NE(text.find(what), std::string::npos) << text;
  };
  const Matrix unit = kIdentity;
  expect_refused([&] { scene.remove_mesh(2); }, "mesh 2: the scene has no mesh of this number");
  expect_refused([&] { scene.replace_mesh(9, grid_.mesh()); }, "mesh 9: the scene has no mesh");
  expect_refused([&] { scene.add_mesh({}); }, "positions is NULL");
  expect_refused([&] { scene.set_vertices(0, std::vector<float>(6)); }, "2 vertices, but the mesh was made with");
  expect_refused([&] { scene.set_vertices(4, grid_.positions); }, "mesh 4: the scene has no mesh");
  expect_refused([&] { scene.add_instances(ballot::instances(unit, Numbers{7})); }, "mesh 7: the scene has no");
  expect_refused([&] { scene.remove_instances(Numbers{0, 5}); }, "instance 5: the scene has no instance");
  expect_refused([&] { scene.remove_instances(Numbers{1, 1}); }, "instance 1: it is named twice");
  expect_refused([&] { scene.set_transforms(unit); }, "1 transforms, but the scene has 2 instances");
  expect_refused([&] { scene.set_transforms(Numbers{0, 1}, unit); }, "1 matrices, but 2 numbers");
  expect_refused([&] { scene.set_masks(Numbers{3}, Numbers{1}); }, "instance 3: the scene has no instance");
  scene.commit();
  expect_same(Answers(scene), before);
  EXPECT_EQ(scene.info().trees, 0u);
  // What follows a refused edit counts.
  scene.remove_mesh(1);
  expect_refused([&] { scene.remove_mesh(1); }, "mesh 1: the scene has no mesh of this number, or it is removed");
  expect_refused([&] { scene.set_masks(Numbers{1}, Numbers{1}); }, "instance 1: the scene has no instance");
  scene.commit();
  EXPECT_EQ(scene.meshes().size(), 1u);
  scene.remove_mesh(0);
  scene.commit();
  EXPECT_EQ(scene.info().triangles, 0u);
  EXPECT_EQ(scene.trace(rays_down(8), ballot::Results{}).hits, 0u);
  EXPECT_EQ(scene.add_mesh(grid_.mesh()), 2u);
  EXPECT_EQ(scene.add_instances(ballot::instances(unit, Numbers{2})), Numbers{2});
  scene.commit();
  EXPECT_GT(scene.trace(rays_down(100), ballot::Results{}).hits, 0u);
}

// Other threads trace while a mesh comes and goes: they find it, or not.
TEST_F(ApiEdits, ThreadsTraceMeanwhile) {
  const Grid high(8, 1);
  ballot::Scene scene(*device_, {grid_.mesh()});
  const auto rays = rays_down(500);
  std::vector<ballot::Hit> low(rays.size());
  scene.trace(rays, low);
  std::thread other([&] {
    std::vector<ballot::Hit> hits(rays.size());
    for (int i = 0; i < 30; ++i) {
      scene.trace(rays, hits);
      for (std::size_t r = 0; r < rays.size(); ++r)
        EXPECT_TRUE(hits[r].t == low[r].t || hits[r].t == low[r].t - 1) << hits[r].t;
    }
  });
  for (int i = 0; i < 10; ++i) {
    const std::uint32_t mesh = scene.add_mesh(high.mesh());
    scene.add_instances(ballot::instances(kIdentity, Numbers{mesh}));
    scene.commit();
    scene.remove_mesh(mesh);
    scene.commit();
  }
  other.join();
}

}  // namespace
