// The memory that loading a scene takes: at its peak little more than what stays. BALLOT_LOAD_TRIANGLES gives the size.
#include <malloc.h>

#include <cmath>
#include <cstdlib>

#include "engine/files/npy.h"
#include "tests/cpu/gltf_builder.h"

namespace ballot::test {
namespace {

constexpr double kNoiseMiB = 7;  // of the allocator, of code that is loaded, of buffers that do not grow with the scene

/// Returns a line of /proc/self/status in MiB.
double status_mib(std::string_view key) {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with(key)) return std::atof(line.c_str() + key.size()) / 1024;
  return 0;
}

/// A wavy grid: vertices and the three indices of each triangle.
struct LoadedGrid {
  std::vector<float> at, normals;
  std::vector<std::uint32_t> indices;

  explicit LoadedGrid(std::uint32_t side) {
    for (std::uint32_t y = 0; y <= side; ++y)
      for (std::uint32_t x = 0; x <= side; ++x) {
        at.insert(at.end(), {float(x) / 7, std::sin(float(x + y)), float(y) / 7});
        normals.insert(normals.end(), {0, 1, 0});
      }
    for (std::uint32_t y = 0; y < side; ++y)
      for (std::uint32_t x = 0; x < side; ++x) {
        const std::uint32_t a = y * (side + 1) + x, b = a + side + 1;
        indices.insert(indices.end(), {a, b, a + 1, a + 1, b, b + 1});
      }
  }
};

void write_glb(const TemporaryFolder& folder, const LoadedGrid& grid) {
  GltfBuilder b;
  b.mesh(b.vec3(grid.at));
  b.primitive()["attributes"]["NORMAL"] = b.vec3(grid.normals);
  b.primitive()["indices"] = b.accessor(b.view(grid.indices), 5125, grid.indices.size(), "SCALAR");
  b.node({{"mesh", 0}});
  folder.write("grid.glb", b.glb());
}

void write_obj(const TemporaryFolder& folder, const LoadedGrid& grid, bool quads) {
  std::ofstream out(folder.path() / (quads ? "quads.obj" : "grid.obj"));
  for (std::size_t i = 0; i < grid.at.size(); i += 3)
    out << fmt::format("v {} {} {}\n", grid.at[i], grid.at[i + 1], grid.at[i + 2]);
  const auto& n = grid.indices;
  for (std::size_t i = 0; i < n.size(); i += 6)
    if (quads)
      out << fmt::format("f {} {} {} {}\n", n[i] + 1, n[i + 1] + 1, n[i + 5] + 1, n[i + 2] + 1);
    else
      out << fmt::format("f {} {} {}\nf {} {} {}\n", n[i] + 1, n[i + 1] + 1, n[i + 2] + 1, n[i + 3] + 1, n[i + 4] + 1,
                         n[i + 5] + 1);
}

void write_ply(const TemporaryFolder& folder, const LoadedGrid& grid) {
  std::ofstream out(folder.path() / "grid.ply", std::ios::binary);
  out << fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
      "property float z\nelement face {}\nproperty list uchar uint vertex_indices\nend_header\n",
      grid.at.size() / 3, grid.indices.size() / 3);
  out.write(reinterpret_cast<const char*>(grid.at.data()), std::streamsize(grid.at.size() * 4));
  for (std::size_t i = 0; i < grid.indices.size(); i += 3) {
    out.put(3);
    out.write(reinterpret_cast<const char*>(&grid.indices[i]), 12);
  }
}

void write_stl(const TemporaryFolder& folder, const LoadedGrid& grid) {
  std::ofstream out(folder.path() / "grid.stl", std::ios::binary);
  out << std::string(80, ' ');
  const auto count = std::uint32_t(grid.indices.size() / 3);
  out.write(reinterpret_cast<const char*>(&count), 4);
  const std::string zeros(12, '\0');
  for (std::size_t i = 0; i < grid.indices.size(); ++i) {
    if (i % 3 == 0) out << zeros;
    out.write(reinterpret_cast<const char*>(&grid.at[3 * grid.indices[i]]), 12);
    if (i % 3 == 2) out << zeros.substr(0, 2);
  }
}

void write_npy(const TemporaryFolder& folder, const LoadedGrid& grid) {
  UnsetVector<Triangle> triangles(grid.indices.size() / 3);
  for (std::size_t i = 0; i < grid.indices.size(); ++i)
    std::memcpy(&triangles[i / 3][i % 3], &grid.at[3 * grid.indices[i]], 12);
  write_triangles(folder.path() / "grid.npy", triangles);
}

TEST(LoadMemory, PeaksStayNearWhatIsKept) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer keeps memory of its own";
#endif
  const char* given = std::getenv("BALLOT_LOAD_TRIANGLES");
  const double triangles = given ? std::atof(given) : 500'000;
  const TemporaryFolder folder;
  {
    const LoadedGrid grid(std::uint32_t(std::sqrt(triangles / 2)));
    write_glb(folder, grid);
    write_obj(folder, grid, false);
    write_obj(folder, grid, true);
    write_ply(folder, grid);
    write_stl(folder, grid);
    write_npy(folder, grid);
  }
  for (const char* name : {"grid.npy", "grid.glb", "grid.ply", "grid.stl", "grid.obj", "quads.obj"}) {
    ::malloc_trim(0);
    const double before = status_mib("VmRSS:");
    std::ofstream("/proc/self/clear_refs") << "5";  // the peak begins anew
    const Scene scene = load_scene(folder.path() / name);
    const double peak = status_mib("VmHWM:") - before;
    ::malloc_trim(0);
    const double kept = status_mib("VmRSS:") - before;
    fmt::print("{:<10} {} triangles: {:.1f} MiB kept, peak {:.1f} MiB, {:.2f} times\n", name, scene.triangles.size(),
               kept, peak, peak / kept);
    EXPECT_LE(peak, 1.5 * kept + kNoiseMiB) << name;
  }
}

}  // namespace
}  // namespace ballot::test
