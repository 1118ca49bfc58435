// Makes a wavy grid of 2 SIDE^2 triangles, and rays whose hits follow from their numbers alone; checks the hits that
// were found:
//   ballot_big_grid make SIDE GRID.npy RAYS.npy --rays N        2 SIDE^2 triangles
//   ballot trace GRID.npy --build device --rays RAYS.npy --out HITS.npy
//   ballot_big_grid check SIDE RAYS.npy HITS.npy
#include <atomic>
#include <cmath>

#include "engine/core/error.h"
#include "engine/core/parallel.h"
#include "engine/files/npy.h"
#include "tests/speed/program.h"

namespace ballot::speed {
namespace {

struct Args {
  std::uint32_t side = 0;
  std::uint64_t rays = 1'000'000;
  std::string grid, rays_file, hits;
};

/// The grid over [-1, 1] x [-1, 1].
struct Grid {
  std::uint32_t side;

  std::uint64_t triangles() const { return 2ull * side * side; }
  glm::vec3 at(std::uint64_t x, std::uint64_t z) const {
    const double u = 2.0 * double(x) / side - 1, v = 2.0 * double(z) / side - 1;
    return glm::vec3(u, 0.1 * std::sin(9 * u + 4 * v) + 0.05 * std::sin(23 * v - 7 * u), v);
  }
  Triangle triangle(std::uint64_t prim) const {
    const std::uint64_t x = prim / 2 % side, z = prim / 2 / side;
    if (prim % 2 == 0) return {at(x, z), at(x, z + 1), at(x + 1, z)};
    return {at(x + 1, z), at(x, z + 1), at(x + 1, z + 1)};
  }
};

/// Returns a number in [0, 1) for a place in a sequence (Steele, Lea and Flood, Fast splittable pseudorandom number
/// generators, OOPSLA 2014).
double random_at(std::uint64_t i) {
  i = 0x9E3779B97F4A7C15ull * (i + 1);
  i = (i ^ i >> 30) * 0xBF58476D1CE4E5B9ull;
  i = (i ^ i >> 27) * 0x94D049BB133111EBull;
  return double((i ^ i >> 31) >> 11) * 0x1p-53;
}

std::uint64_t target_of(const Grid& grid, std::uint64_t ray) {
  return std::uint64_t(random_at(3 * ray) * double(grid.triangles()));
}

/// Returns a ray that goes straight down into the middle part of a random triangle.
Ray ray_to(const Grid& grid, std::uint64_t i) {
  const Triangle t = grid.triangle(target_of(grid, i));
  double v = random_at(3 * i + 1), w = random_at(3 * i + 2);
  if (v + w > 1) v = 1 - v, w = 1 - w;
  v = 0.2 + 0.4 * v, w = 0.2 + 0.4 * w;
  const glm::dvec3 at = (1 - v - w) * glm::dvec3(t[0]) + v * glm::dvec3(t[1]) + w * glm::dvec3(t[2]);
  return {{float(at.x), 1, float(at.z)}, 0, {0, -1, 0}, 10};
}

void make(const Args& args) {
  const Grid grid{args.side};
  UnsetVector<Triangle> triangles(grid.triangles());
  for_chunks(triangles.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) triangles[i] = grid.triangle(i);
  });
  write_triangles(args.grid, triangles);
  triangles = {};
  std::vector<Ray> rays(args.rays);
  for_chunks(rays.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) rays[i] = ray_to(grid, i);
  });
  write_rays(args.rays_file, rays);
  fmt::print("{} triangles, {} rays\n", grid.triangles(), rays.size());
}

void check(const Args& args) {
  const Grid grid{args.side};
  const std::vector<Hit> hits = read_hits(args.hits);
  const std::vector<Ray> rays = read_rays(args.rays_file);
  if (rays.size() != hits.size()) fail(Failure::Work, "{} rays, but {} hits", rays.size(), hits.size());
  std::atomic<std::uint64_t> wrong = 0, far = 0;
  for_chunks(hits.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint64_t prim = target_of(grid, i);
      if (hits[i].prim != prim) {
        ++wrong;
        continue;
      }
      const Triangle t = grid.triangle(prim);
      const float lo = std::min({t[0].y, t[1].y, t[2].y}), hi = std::max({t[0].y, t[1].y, t[2].y}), y = 1 - hits[i].t;
      far += !(y >= lo - 1e-6f && y <= hi + 1e-6f);
    }
  });
  fmt::print("{} rays: {} hits name another triangle or none, {} another distance\n", rays.size(), wrong.load(),
             far.load());
  if (wrong + far > 0) fail(Failure::Work, "the hits are wrong");
}

}  // namespace
}  // namespace ballot::speed

int main(int argc, char** argv) {
  ballot::speed::Args args;
  CLI::App app("Makes a large grid with rays whose hits are known, and checks the hits");
  app.require_subcommand(1);
  CLI::App *make = app.add_subcommand("make", "writes the grid and the rays"),
           *check = app.add_subcommand("check", "checks the hits of the rays");
  for (CLI::App* command : {make, check})
    command->add_option("SIDE", args.side, "cells along a side")->required()->check(CLI::Range(1, 30000));
  make->add_option("GRID.npy", args.grid, "triangles, float32 (n,3,3)")->required();
  for (CLI::App* command : {make, check})
    command->add_option("RAYS.npy", args.rays_file, "rays, float32 (n,8)")->required();
  make->add_option("--rays", args.rays, "number of rays [1000000]");
  check->add_option("HITS.npy", args.hits, "hits of ballot trace")->required();
  return ballot::speed::run_program(app, argc, argv, "ballot_big_grid", [&] {
    if (make->parsed())
      ballot::speed::make(args);
    else
      ballot::speed::check(args);
  });
}
