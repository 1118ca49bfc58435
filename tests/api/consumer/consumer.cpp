// A program of somebody else in C++: a square, nearest and any hits, a trace in the background, moved vertices.
#include <ballot/ballot.h>

#include <cmath>
#include <cstdio>

int main() {
  try {
    const ballot::Device device;
    const std::vector<float> square{-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0};
    const std::vector<std::uint32_t> indices{0, 1, 2, 0, 2, 3};
    ballot::Mesh plate = ballot::mesh(square, indices);
    plate.id = 7;
    ballot::Scene scene(device, {plate});
    std::vector<ballot::Ray> rays;
    for (int i = 0; i < 1000; ++i) rays.push_back({{float(i % 40) / 10 - 2, 0.1f, 3}, 0, {0, 0, -1}, 1e30f});
    std::vector<ballot::Hit> hits(rays.size());
    const ballot::Times times = scene.trace(rays, hits);
    std::vector<std::uint8_t> blocked(rays.size());
    std::vector<std::uint32_t> ids(rays.size());
    scene.trace(rays, {.mesh_ids = ids.data(), .occluded = blocked.data()}, {.any = true});
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const bool inside = rays[i].origin[0] >= -1 && rays[i].origin[0] <= 1;
      if ((hits[i].prim != ballot::kMiss) != inside || blocked[i] != inside || (ids[i] == 7) != inside) return 1;
    }
    std::vector<double> down;
    for (int i = 0; i < 100; ++i) down.insert(down.end(), {i / 50.0 - 1.51, 0.1, -1});
    std::vector<float> t(100);
    scene.trace({.origins = {0, 0, 1}, .directions = down, .t_max = 2}, {.t = t.data()});
    for (std::size_t i = 0; i < t.size(); ++i)
      if ((std::abs(t[i] - 1) < 1e-6f) != (std::abs(down[3 * i]) <= 1)) return 7;
    std::vector<float> moved = square;
    for (std::size_t i = 2; i < moved.size(); i += 3) moved[i] = 1;
    scene.set_vertices(0, moved), scene.commit();
    ballot::Job job = scene.submit(rays, {.hits = hits.data()});
    job.wait();
    if (hits[20].t != 2) return 2;
    std::printf("%s: %llu of %zu rays hit\n", ballot::version().c_str(), static_cast<unsigned long long>(times.hits),
                rays.size());
    ballot::Array<ballot::Ray> there(device, rays.size());
    ballot::Array<ballot::Hit> found(device, rays.size());
    there.write(rays);
    scene.trace(there, found, rays.size());
    ballot::Job first = scene.submit(there, found, rays.size());
    ballot::Job second = scene.submit(there, found, rays.size());
    while (!second.poll()) {
    }
    first.wait();
    std::vector<ballot::Hit> back(rays.size());
    found.read(back);
    for (std::size_t i = 0; i < rays.size(); ++i)
      if (back[i].t != hits[i].t || back[i].prim != hits[i].prim) return 3;
    try {
      scene.set_vertices(0, std::span(moved).first(9)), scene.commit();
      return 4;
    } catch (const ballot::Error& error) {
      if (error.code() != BALLOT_ERROR_ARGUMENT) return 5;
    }
  } catch (const ballot::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 6;
  }
  return 0;
}
