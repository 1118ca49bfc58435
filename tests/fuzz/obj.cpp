// OBJ with a material file: what follows the first zero byte is m.mtl.
#include "engine/scene/scene.h"
#include "tests/fuzz/fuzz.h"

namespace ballot::fuzz {

namespace {

using namespace std::string_literals;

std::vector<std::string> obj_seeds() {
  const std::string corners = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.5\nvn 0 0 1\nvt 0 0\n";
  const std::string materials =
      "\0newmtl a\nKd 1 0 0\nKe 0 1 0\nNs 10\nd 0.5\nillum 7\nmap_Kd x.png\nnewmtl b\nKs 1 1 1\n"s;
  return {corners + "usemtl a\nf 1//1 2//1 3//1\nf -1 -2 -3\n" + materials,
          corners + "s 1\nf 1 2 4 3\ns off\ng x\no y\nusemtl b\nf 1/1/1 2/1/1 \\\n 4/1/1\n" + materials,
          "v 1e38 -1e38 0x1p3\nv nan 0 0\nf 1 2 2147483647\n"};
}

std::vector<std::string> obj_words() {
  return {"v ",     "vn ",     "vt ",   "f ",         "usemtl ",     "mtllib ", "m.mtl",
          "s on\n", "newmtl ", "Kd ",   "Ke ",        "Tr ",         "Tf ",     "Ni ",
          "-1",     "//",      "1e400", "2147483648", "-2147483649", "\\\n",    "map_Kd -o 1 2 3 ",
          "\r\n",   "#"};
}

void read_obj(std::string_view input) {
  const std::size_t end = std::min(input.find('\0'), input.size());
  put("m.mtl", input.substr(std::min(end + 1, input.size())));
  const std::filesystem::path path = put("s.obj", input.substr(0, end));
  expect_plain([&] { load_scene(path); });
}

}  // namespace

Target obj_target() { return {"obj", Form::Bytes, obj_seeds(), obj_words(), read_obj}; }

}  // namespace ballot::fuzz
