// PLY and STL: the first byte of an input chooses.
#include "engine/files/load.h"
#include "tests/fuzz/fuzz.h"

namespace ballot::fuzz {

namespace {

std::vector<std::string> mesh_seeds() {
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
          "pply\rformat ascii 1.0\relement tristrips 1\rproperty list int int vertex_index\r"
          "element vertex 5\rproperty float x\rproperty float y\rproperty float z\rend_header\r"
          "8 0 1 2 3 -1 2 3 4\r0 0 0 7\r1 0 0\r0 1 0\r1 1 0\r0 2 0 1 1\r",
          "pply\nformat ascii 1.0\n" + head + "element face 1\nproperty list int int vertex_indices\nend_header\n" +
              "0 0 0\n1 0 0\n0 1 0\n9 0 1 1 2 0 2 1 0 1\n",
          "s\xEF\xBB\xBF \nSOLID solid FACET\rFACET NORMAL 0 0 1 OUTER LOOP VERTEX 0 0 0 VERTEX 1 0 0 VERTEX 0 1 0 "
          "ENDLOOP ENDFACET ENDSOLID x\rsolid\rendsolid",
          "ssolid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
          "0\nendloop\nendfacet\nendsolid\n"};
}

std::vector<std::string> mesh_words() {
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
          "9223372036854775807",
          "tristrips",
          "endsolid",
          "SOLID",
          "\xEF\xBB\xBF",
          "\r"};
}

void read_mesh(std::string_view input) {
  if (input.empty()) return;
  const char kind = input[0];
  const std::string_view content = input.substr(1);
  const std::filesystem::path path = put(kind == 's' ? "s.stl" : "s.ply", content);
  expect_plain([&] { load_scene(path); });
}

}  // namespace

Target mesh_target() { return {"mesh", Form::Bytes, mesh_seeds(), mesh_words(), read_mesh}; }

}  // namespace ballot::fuzz
