// OBJ with a material file: what follows the first zero byte is m.mtl.
#include "engine/files/load.h"
#include "tests/fuzz/fuzz.h"

namespace ballot::fuzz {

namespace {

using namespace std::string_literals;

std::vector<std::string> obj_seeds() {
  const std::string corners = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.5\nvn 0 0 1\nvt 0 0\n";
  const std::string materials =
      "\0newmtl a\nKd 1 0 0\nKe 0 1 0\nNs 10\nd 0.5\nillum 7\nmap_Kd x.png\nnewmtl b\nKs 1 1 1\n"s;
  return {
      corners + "usemtl a\nf 1//1 2//1 3//1\nf -1 -2 -3\n" + materials,
      corners + "s 1\nf 1 2 4 3\ns off\ng x\no y\nusemtl b\nf 1/1/1 2/1/1 \\\n 4/1/1\n" + materials,
      "\xEF\xBB\xBFmtllib m.mtl\rusemtl a\rv 0 0 0\rv 1 0 0\rv 0 1 0\rv 1 1 0\rvt 0 1\rfo 1/1 2/-1 3/0 3 4 1 2\rl 1 2\r"
      "\0newmtl a\rTr 1\rKd xyz 1 1 1\rmap_Kd -s 1 2 -clamp on p.png\rmap_d x\rnewmtl a\rKd 0.5\rKd spectral x\r"s,
      "v 1e38 -1e38 0x1p3\nv nan 0 0\nf 1 2 2147483647\n",
      corners + "f 1 2 3\ng a b\nf 1 2 3\no c#d # e\nf 1 2 4 3\ng\nf 1 2 3\ng a b\nf 1 2 3\ng none\n"};
}

std::vector<std::string> obj_words() {
  return {"v ",           "vn ",      "vt ",   "f ",         "usemtl ",     "mtllib ", "m.mtl",
          "s on\n",       "newmtl ",  "Kd ",   "Ke ",        "Tr ",         "Tf ",     "Ni ",
          "-1",           "//",       "1e400", "2147483648", "-2147483649", "\\\n",    "map_Kd -o 1 2 3 ",
          "\xEF\xBB\xBF", "\xFF\xFE", "\r",    "fo ",        "p.png",       "xyz ",    "spectral ",
          "\r\n",         "#",        "g ",    "o "};
}

/// Returns a TGA of one white pixel: readers of textures tell formats by their content.
std::vector<std::uint8_t> one_pixel() { return {0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 24, 0, 255, 255, 255}; }

void read_obj(std::string_view input) {
  // A picture of one pixel, for map_Kd.
  static const std::filesystem::path picture = put("p.png", bytes_of(one_pixel()));
  const std::size_t end = std::min(input.find('\0'), input.size());
  put("m.mtl", input.substr(std::min(end + 1, input.size())));
  const std::filesystem::path path = put("s.obj", input.substr(0, end));
  expect_plain([&] { load_scene(path); });
}

}  // namespace

Target obj_target() { return {"obj", Form::Bytes, obj_seeds(), obj_words(), read_obj}; }

}  // namespace ballot::fuzz
