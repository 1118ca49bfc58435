// PLY, STL and NPY: the first byte chooses. NPY is read as triangles, rays, hits and points.
#include "engine/core/npy.h"
#include "engine/core/npy_points.h"
#include "engine/scene/scene.h"
#include "tests/fuzz/fuzz.h"

namespace ballot::fuzz {

namespace {

std::string npy(const std::string& descr, const std::string& shape, const std::string& data) {
  std::string header = "{'descr': " + descr + ", 'fortran_order': False, 'shape': " + shape + ", }";
  header.resize(117, ' ');
  return std::string("\x93NUMPY\1\0\x76\0", 10) + header + "\n" + data;
}

}  // namespace

std::vector<std::string> seeds() {
  const std::string corners = bytes_of(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0});
  const std::string head = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  std::string stl(80, ' ');
  stl += bytes_of(std::vector<std::uint32_t>{1}) + std::string(12, '\0') + corners + std::string(2, '\0');
  return {"pply\nformat ascii 1.0\n" + head + faces + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
          "pply\nformat binary_little_endian 1.0\n" + head + faces + corners + "\3" +
              bytes_of(std::vector<std::int32_t>{0, 1, 2}),
          "pply\nformat binary_big_endian 1.0\ncomment x\n" + head + faces + corners +
              std::string("\3\0\0\0\0\0\0\0\1\0\0\0\2", 13),
          "s" + stl,
          "ssolid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
          "0\nendloop\nendfacet\nendsolid\n",
          "n" + npy("'<f4'", "(1, 3, 3)", corners),
          "n" + npy("'<f8'", "(1, 6)", std::string(48, '\1')),
          "n" + npy("'<f4'", "(3, 3)", corners),
          "n" + npy("[('t', '<f4'), ('prim', '<u4'), ('u', '<f4'), ('v', '<f4')]", "(1,)", std::string(16, '\1'))};
}

std::vector<std::string> words() {
  return {"element ",
          "property ",
          "list ",
          "uchar ",
          "uint ",
          "double ",
          "float64 ",
          "vertex_index",
          "vertex_indices",
          "end_header\n",
          "format ",
          "binary_little_endian 1.0\n",
          "4294967295",
          "18446744073709551615",
          "-1",
          "facet normal ",
          "outer loop\n",
          "vertex ",
          "endloop\n",
          "endfacet\n",
          "solid ",
          "'<f4'",
          "'<f8'",
          "'|f4'",
          "True",
          "(",
          "9223372036854775807",
          "\x93NUMPY"};
}

void read(std::string_view input) {
  if (input.empty()) return;
  const char kind = input[0];
  const std::string_view content = input.substr(1);
  if (kind == 'n') {
    const std::filesystem::path path = put("s.npy", content);
    expect_plain([&] { load_scene(path); });
    expect_plain([&] { read_rays(path); });
    expect_plain([&] { read_hits(path); });
    expect_plain([&] { read_points(path); });
  } else {
    const std::filesystem::path path = put(kind == 's' ? "s.stl" : "s.ply", content);
    expect_plain([&] { load_scene(path); });
  }
}

}  // namespace ballot::fuzz
