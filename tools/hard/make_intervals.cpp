// Hard cases of ray intervals: origins on triangles and at an offset from them; t_min and t_max at, just before and
// just after a hit.
#include <cmath>
#include <glm/geometric.hpp>

#include "tools/hard/generate.h"

namespace ballot::hard {
namespace {

float before(float x) { return std::nextafter(x, -kInf); }
float after(float x) { return std::nextafter(x, kInf); }

glm::vec3 unit_normal(const Triangle& t) {
  const glm::vec3 n = glm::cross(t[1] - t[0], t[2] - t[0]);
  return n / std::sqrt(glm::dot(n, n));
}

}  // namespace

// A floor of unit squares at y = 0 and its copy at y = -8.
HardScene on_surfaces(bool quick) {
  Triangles mesh = plane_grid(8, 4, 0);
  append(mesh, plane_grid(8, 4, -8));
  std::vector<HardRays> sets{{.name = "inside triangles, steep"},
                             {.name = "edges and vertices, steep", .closed = true},
                             {.name = "inside triangles, all directions"},
                             {.name = "of a soup, all directions"}};
  Random random(100);
  for (std::size_t i = 0; i < many(quick); ++i) {
    const std::size_t cell = random.below(64);
    const glm::vec3 corner(static_cast<float>(cell % 8) - 4, 0, static_cast<float>(cell / 8) - 4);
    const bool second = random.flip();
    const glm::vec3 p = corner + (second ? glm::vec3(0.75f, 0, 0.25f) : glm::vec3(0.25f, 0, 0.75f));
    const glm::vec3 steep(random.in(-0.9f, 0.9f), random.sign(), random.in(-0.9f, 0.9f));
    sets[0].rays.push_back({p, 0, steep, kFar});
    sets[0].answers.push_back(static_cast<std::uint32_t>(2 * cell + (second ? 1 : 0)));
    const float s = static_cast<float>(random.below(9)) / 8;
    const glm::vec3 along[] = {{s, 0, 0}, {0, 0, s}, {s, 0, s}};
    sets[1].rays.push_back({corner + along[random.below(3)], 0, steep, kFar});
    sets[2].rays.push_back({p, 0, random.direction(), kFar});
  }
  const Triangles cloud = moved(soup(1000, 0.2f, 101), 4, {0, 20, 0});
  for (std::size_t i = 0; i < many(quick); ++i)
    sets[3].rays.push_back({target(cloud, random), 0, random.direction(), kFar});
  append(mesh, cloud);
  return {scene_of("on-surfaces", std::move(mesh)), std::move(sets)};
}

HardScene interval_ends(bool quick) {
  Triangles mesh = plane_grid(8, 4, 0);
  const Triangles cloud = moved(soup(1000, 0.2f, 102), 4, {-20, -20, -20});
  std::vector<HardRays> sets{{.name = "a wall at t = 4"},
                             {.name = "a wall at t = 4, any hit", .want = Want::Any},
                             {.name = "t_max at a soup"},
                             {.name = "t_min at a soup"}};
  struct Ends {
    float t_min, t_max;
    std::uint32_t answer;
  };
  const Ends ends[] = {{0, before(4), NO_HIT},
                       {0, 4, kSomePrim},
                       {0, after(4), kSomePrim},
                       {before(4), 8, kSomePrim},
                       {4, 8, kSomePrim},
                       {after(4), 8, NO_HIT},
                       {-8, 4, kSomePrim},
                       {4, after(4), kSomePrim},
                       {before(4), 4, kSomePrim},
                       {-8, -4, NO_HIT},
                       {before(4), after(4), kSomePrim}};
  Random random(103);
  for (HardRays* set : {&sets[0], &sets[1]})
    for (std::size_t i = 0; i < many(quick); ++i) {
      const Ends& e = ends[random.below(std::size(ends))];
      const float length = static_cast<float>(1 + random.below(2)), side = random.sign();
      const glm::vec3 cell(static_cast<float>(random.below(8)) - 4, 0, static_cast<float>(random.below(8)) - 4);
      const glm::vec3 from = cell + glm::vec3(0.25f, 4 * length * side, 0.75f);
      set->rays.push_back({from, e.t_min, {0, -length * side, 0}, e.t_max});
      set->answers.push_back(e.answer);
    }
  for (std::size_t i = 0; i < many(quick); ++i) {
    const float at[] = {before(1), 1, after(1), 1 - 1e-4f, 1 + 1e-4f, before(before(1)), after(after(1))};
    const glm::vec3 p = target(cloud, random), d = random.direction();
    sets[2].rays.push_back({p - d, 0, d, at[random.below(7)]});
    sets[3].rays.push_back({p - d, at[random.below(7)], d, kFar});
  }
  append(mesh, cloud);
  return {scene_of("interval-ends", std::move(mesh)), std::move(sets)};
}

// Shells of radius 1, 1e2, 1e5 and 1e7 about one centre. A ray that starts at an offset of 10^-k, times the shell's
// radius, from a shell must hit one of them.
HardScene offset_origins(bool quick) {
  Triangles mesh;
  std::vector<HardRays> sets;
  Random random(104);
  for (const float scale : {1.f, 1e2f, 1e5f}) {
    const Triangles shell = moved(octasphere(quick ? 2 : 4), scale, {0, 0, 0});
    float offset = scale;
    for (int k = 0; k < 8; ++k, offset /= 10) {
      HardRays set{.name = fmt::format("scale {:g}, offset 1e-{}", scale, k), .closed = true};
      for (std::size_t i = 0; i < many(quick) / 10; ++i) {
        const Triangle& t = shell[random.below(shell.size())];
        const float u = random.in(0, 1), v = random.in(0, 1 - u);
        const glm::vec3 n = unit_normal(t), p = point_of(t, u, v);
        glm::vec3 dir = random.direction();
        if (glm::dot(dir, n) < 0 && random.below(4) != 0) dir = -dir;  // most rays point away from the shell
        set.rays.push_back({p + n * offset * (glm::dot(n, p) > 0 ? 1.f : -1.f), 0, dir, kFar});
      }
      sets.push_back(std::move(set));
    }
    append(mesh, shell);
  }
  append(mesh, moved(octasphere(3), 1e7f, {0, 0, 0}));
  return {scene_of("offset-origins", std::move(mesh)), std::move(sets)};
}

// The numbers of pbrt's test. The vertices lie on one line, so the ray hits nothing. Beside it lies the same triangle
// with one vertex an ulp off the line.
HardScene collinear_report(bool quick) {
  const Triangle line{{{-1113.45459f, -79.049614f, -56.2431908f},
                       {-1113.45459f, -87.0922699f, -56.2431908f},
                       {-1113.45459f, -79.2090149f, -56.2431908f}}};
  const Ray reported{{-1081.47925f, 99.9999542f, 87.7701111f}, 0, {-32.1072998f, -183.355865f, -144.607635f}, 0.9999f};
  Triangle thin = line;
  for (glm::vec3& v : thin) v.z += 64;
  thin[2].x = after(thin[2].x);
  HardRays exact{.name = "as reported"}, about{.name = "at an ulp's width"};
  exact.rays = {reported};
  exact.answers = {NO_HIT};
  Random random(105);
  for (std::size_t i = 0; i < many(quick); ++i) about.rays.push_back(towards(reported.origin, target({thin}, random)));
  return {scene_of("collinear-report", {line, thin}), {std::move(exact), std::move(about)}};
}

}  // namespace ballot::hard
