// Loads a NumPy array of triangles: shape (n, 3, 3) or (n, 9), x y z of three vertices, float32 or float64.
#include <vector>

#include "engine/core/npy_file.h"
#include "engine/scene/loaders.h"

namespace ballot {

Scene load_npy(const std::filesystem::path& path, const LoadOptions&) {
  NpyFile file(path);
  const NpyHeader& header = file.header();
  const bool f4 = header.descr == "'<f4'", f8 = header.descr == "'<f8'";
  const std::vector<std::uint64_t> shape = header.shape.value_or(std::vector<std::uint64_t>{});
  const bool threes = shape.size() == 3 && shape[1] == 3 && shape[2] == 3, nines = shape.size() == 2 && shape[1] == 9;
  if ((!f4 && !f8) || (!threes && !nines) || header.fortran_order.value_or(false))
    fail_in(path, "has {}; expected triangles: float32 or float64 of shape (n, 3, 3), in C order", file.found());
  const std::uint64_t count = shape[0];
  if (count > kMaxTriangles)
    fail_in(path, "has {} triangles; expected at most {}; use a smaller scene", count, kMaxTriangles);
  file.expect_items(count, 9 * (f4 ? sizeof(float) : sizeof(double)));
  Scene scene;
  scene.triangles.resize(count);
  if (f4) {
    file.read(scene.triangles.data(), count * sizeof(Triangle));
  } else {
    std::array<double, 9> values;
    for (Triangle& t : scene.triangles) {
      file.read(values.data(), sizeof values);
      for (std::size_t i = 0; i < 9; ++i) t[i / 3][int(i % 3)] = float(values[i]);
    }
  }
  complete_mesh(path, scene);
  return scene;
}

}  // namespace ballot
