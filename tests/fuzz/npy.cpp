// NPY, read as triangles, rays, hits and points.
#include "engine/files/npy.h"

#include "engine/files/load.h"
#include "engine/files/npy_points.h"
#include "tests/fuzz/fuzz.h"

namespace ballot::fuzz {

namespace {

std::string npy(const std::string& descr, const std::string& shape, const std::string& data) {
  std::string header = "{'descr': " + descr + ", 'fortran_order': False, 'shape': " + shape + ", }";
  header.resize(117, ' ');
  return std::string("\x93NUMPY\1\0\x76\0", 10) + header + "\n" + data;
}

std::vector<std::string> npy_seeds() {
  const std::string corners = bytes_of(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0});
  return {npy("'<f4'", "(1, 3, 3)", corners), npy("'<f8'", "(1, 6)", std::string(48, '\1')),
          npy("'<f4'", "(1, 8)", std::string(32, '\1')), npy("'<f4'", "(3, 3)", corners),
          npy("[('t', '<f4'), ('prim', '<u4'), ('u', '<f4'), ('v', '<f4')]", "(1,)", std::string(16, '\1'))};
}

std::vector<std::string> npy_words() {
  return {"'descr'",
          "'fortran_order'",
          "'shape'",
          "'<f4'",
          "'<f8'",
          "'>f4'",
          "'|f4'",
          "'<u4'",
          "True",
          "(",
          ", 8)",
          ", 3)",
          "[('t'",
          "-1",
          "0",
          "4294967296",
          "1e3",
          "9223372036854775807",
          "18446744073709551615",
          "\x93NUMPY"};
}

void read_npy(std::string_view input) {
  const std::filesystem::path path = put("s.npy", input);
  expect_plain([&] { load_scene(path); });
  expect_plain([&] { read_rays(path); });
  expect_plain([&] { read_hits(path); });
  expect_plain([&] { read_points(path); });
  expect_plain([&] {
    RayFile file(path);
    file.choose_part(1, 2);
    std::vector<Ray> rays(2);
    while (file.read(rays) == rays.size()) {
    }
  });
}

}  // namespace

Target npy_target() { return {"npy", Form::Bytes, npy_seeds(), npy_words(), read_npy}; }

}  // namespace ballot::fuzz
