// Tests of .npz scenes. The zip files are made here, as NumPy makes them: stored (savez) or deflated
// (savez_compressed), with the sizes of local headers left to a ZIP64 field.
#include <fmt/format.h>
#include <zlib.h>

#include <cstring>

#include "tests/cpu/gltf_builder.h"

namespace ballot::test {
namespace {

template <class T>
void add_to_zip(std::string& to, T value) {
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <class T>
std::string npy_array(const char* descr, const std::string& shape, const std::vector<T>& values) {
  std::string text = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': {}, }}", descr, shape);
  text.resize(117, ' ');
  std::string bytes("\x93NUMPY\x01\x00", 8);
  add_to_zip(bytes, std::uint16_t(text.size() + 1));
  return bytes + text + "\n" + std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

std::string deflated(const std::string& text) {
  z_stream stream{};
  EXPECT_EQ(::deflateInit2(&stream, 9, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(::deflateBound(&stream, text.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = uInt(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = uInt(out.size());
  EXPECT_EQ(::deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  ::deflateEnd(&stream);
  return out;
}

using Arrays = std::vector<std::pair<std::string, std::string>>;

std::string zipped(const Arrays& arrays, bool compress = false) {
  std::string file, list;
  for (const auto& [name, content] : arrays) {
    const std::string packed = compress ? deflated(content) : content;
    const auto checksum = std::uint32_t(::crc32_z(0, reinterpret_cast<const Bytef*>(content.data()), content.size()));
    const std::size_t place = file.size();
    const auto common = [&, &name = name](std::string& to, std::uint32_t size, std::uint32_t whole,
                                          std::uint16_t extra) {
      for (const int word : {45, 0, compress ? 8 : 0, 0, 0x21}) add_to_zip(to, std::uint16_t(word));
      for (const std::uint32_t number : {checksum, size, whole}) add_to_zip(to, number);
      add_to_zip(to, std::uint16_t(name.size()));
      add_to_zip(to, extra);
    };
    add_to_zip(file, 0x04034B50u);
    common(file, 0xFFFFFFFF, 0xFFFFFFFF, 20);
    file += name;
    add_to_zip(file, std::uint16_t(1));
    add_to_zip(file, std::uint16_t(16));
    add_to_zip(file, std::uint64_t(content.size()));
    add_to_zip(file, std::uint64_t(packed.size()));
    file += packed;
    add_to_zip(list, 0x02014B50u);
    add_to_zip(list, std::uint16_t(45));
    common(list, std::uint32_t(packed.size()), std::uint32_t(content.size()), 0);
    for (int i = 0; i < 5; ++i) add_to_zip(list, std::uint16_t(0));
    add_to_zip(list, std::uint32_t(place));
    list += name;
  }
  std::string end;
  add_to_zip(end, 0x06054B50u);
  for (const std::size_t n : {std::size_t(0), std::size_t(0), arrays.size(), arrays.size()})
    add_to_zip(end, std::uint16_t(n));
  add_to_zip(end, std::uint32_t(list.size()));
  add_to_zip(end, std::uint32_t(file.size()));
  add_to_zip(end, std::uint16_t(0));
  return file + list + end;
}

Scene load_npz_of(const std::string& content) {
  const TemporaryFolder folder;
  return load_scene(folder.write("a.npz", content));
}

void refuse_npz(const std::string& content, std::initializer_list<std::string_view> parts) {
  expect_error(Failure::Work, parts, [&] { load_npz_of(content); });
}

const std::vector<float> kNpzCorners{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
const std::vector<float> kNpzSoup{0, 0, 0, 1, 0, 0, 0, 1, 0};
const Triangle kNpzTriangle{glm::vec3(0, 0, 0), glm::vec3(1, 0, 0), glm::vec3(0, 1, 0)};

TEST(Npz, TrianglesStoredAndDeflated) {
  for (const bool compress : {false, true}) {
    const std::string soup = npy_array("<f4", "(1, 3, 3)", kNpzSoup);
    EXPECT_EQ(load_npz_of(zipped({{"arr_0.npy", soup}}, compress)).triangles, UnsetVector<Triangle>{kNpzTriangle});
    EXPECT_EQ(load_npz_of(zipped({{"x.npy", "no"}, {"triangles.npy", soup}}, compress)).triangles,
              UnsetVector<Triangle>{kNpzTriangle});
  }
}

TEST(Npz, VerticesAndFaces) {
  const std::string vertices = npy_array("<f4", "(4, 3)", kNpzCorners);
  const std::vector<double> wide(kNpzCorners.begin(), kNpzCorners.end());
  const auto triangles_of = [&](const std::string& points, const std::string& name, const std::string& faces) {
    return load_npz_of(zipped({{"vertices.npy", points}, {name, faces}}, true)).triangles;
  };
  const UnsetVector<Triangle> expected{kNpzTriangle, {kNpzTriangle[1], glm::vec3(1, 1, 0), kNpzTriangle[2]}};
  EXPECT_EQ(
      triangles_of(vertices, "faces.npy", npy_array("<i8", "(2, 3)", std::vector<std::int64_t>{0, 1, 2, 1, 3, 2})),
      expected);
  EXPECT_EQ(triangles_of(npy_array("<f8", "(4, 3)", wide), "triangles.npy",
                         npy_array("|u1", "(2, 3)", std::vector<std::uint8_t>{0, 1, 2, 1, 3, 2})),
            expected);
}

// In Fortran order the first index runs fastest: what numpy.savez writes of array[:, columns].
TEST(Npz, FortranOrder) {
  const auto turned = [](std::string array) { return array.replace(array.find("False"), 5, "True "); };
  const std::vector<float> by_columns{0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0};  // kNpzCorners: all x, all y, all z
  const std::vector<std::int32_t> faces{0, 1, 1, 3, 2, 2};                  // (0, 1, 2), (1, 3, 2)
  EXPECT_EQ(load_npz_of(zipped({{"vertices.npy", turned(npy_array("<f4", "(4, 3)", by_columns))},
                                {"faces.npy", turned(npy_array("<i4", "(2, 3)", faces))}}))
                .triangles,
            (UnsetVector<Triangle>{kNpzTriangle, {kNpzTriangle[1], glm::vec3(1, 1, 0), kNpzTriangle[2]}}));
  // Two triangles of (n, 3, 3): number 9 n + 3 i + j of the second axis i and the third j.
  std::vector<float> soup(18);
  for (int n = 0; n < 2; ++n)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) soup[std::size_t(n + 2 * (i + 3 * j))] = float(9 * n + 3 * i + j);
  const auto both = load_npz_of(zipped({{"a.npy", turned(npy_array("<f4", "(2, 3, 3)", soup))}})).triangles;
  ASSERT_EQ(both.size(), 2u);
  for (int k = 0; k < 18; ++k) EXPECT_EQ(both[std::size_t(k / 9)][std::size_t(k / 3 % 3)][k % 3], float(k));
}

TEST(Npz, ArraysThatDoNotFit) {
  const std::string vertices = npy_array("<f4", "(4, 3)", kNpzCorners);
  const auto with = [&](const std::string& faces) {
    return zipped({{"vertices.npy", vertices}, {"faces.npy", faces}});
  };
  refuse_npz(with(npy_array("<i4", "(1, 3)", std::vector<std::int32_t>{0, 1, 4})),
             {"triangle 0 names vertex 4", "are 4"});
  refuse_npz(with(npy_array("<i4", "(1, 3)", std::vector<std::int32_t>{0, 1, -1})),
             {"triangle 0 names vertex -1, but there are 4"});
  refuse_npz(with(npy_array("<i8", "(1, 3)", std::vector<std::int64_t>{0, -7, 2})), {"names vertex -7,"});
  refuse_npz(with(npy_array("|i1", "(1, 3)", std::vector<std::int8_t>{0, 1, -128})), {"names vertex -128,"});
  refuse_npz(with(npy_array("|u1", "(1, 3)", std::vector<std::uint8_t>{0, 1, 255})), {"names vertex 255,"});
  refuse_npz(with(npy_array("<i4", "(1, 4)", std::vector<std::int32_t>{0, 1, 2, 3})),
             {"whole numbers of shape (n, 3)"});
  refuse_npz(with(npy_array("<f4", "(1, 3)", std::vector<float>{0, 1, 2})), {"whole numbers"});
  refuse_npz(with(npy_array("<i4", "(9, 3)", std::vector<std::int32_t>{0, 1, 2})), {"faces.npy", "12 bytes follow"});
  refuse_npz(zipped({{"vertices.npy", npy_array("<i4", "(1, 3)", std::vector<std::int32_t>{0, 1, 2})},
                     {"faces.npy", npy_array("<i4", "(0, 3)", std::vector<std::int32_t>{})}}),
             {"its vertices:", "float32 or float64 of shape (n, 3)"});
  refuse_npz(zipped({{"a.npy", vertices}, {"b.npy", vertices}}), {"has the arrays a.npy, b.npy; expected"});
  refuse_npz(zipped({{"a.npy", vertices}}), {"expected triangles"});
  refuse_npz(zipped({}), {"has the arrays (none)"});
}

TEST(Npz, DamagedFiles) {
  const std::string soup = npy_array("<f4", "(1, 3, 3)", kNpzSoup);
  const std::string good = zipped({{"a.npy", soup}}, true);
  refuse_npz("nonsense, and more of it than a list has", {"not a zip file"});
  refuse_npz(good.substr(0, good.size() - 30), {"cut short"});
  const auto changed = [&](std::size_t at, std::uint32_t value, std::size_t bytes) {
    std::string bad = good;
    std::memcpy(&bad[at], &value, bytes);
    return bad;
  };
  const std::size_t list = good.rfind("PK\x01\x02");
  refuse_npz(changed(list, 0, 4), {"entry 0 of its list is damaged"});
  refuse_npz(changed(list + 8, 1, 2), {"'a.npy' is encrypted"});
  refuse_npz(changed(list + 10, 12, 2), {"by method 12"});
  refuse_npz(changed(list + 16, 1, 4), {"'a.npy' is damaged"});
  refuse_npz(changed(list + 20, 1u << 30, 4), {"has 1073741824 bytes from byte"});
  refuse_npz(changed(list + 24, 20, 4), {"'a.npy' is damaged: 20 bytes"});
  refuse_npz(changed(list + 28, 0xFFFF, 2), {"cut short"});
  refuse_npz(changed(list + 42, 3, 4), {"'a.npy' is damaged"});
  refuse_npz(changed(60 + 20, 0, 4), {"'a.npy' is damaged"});  // of the compressed bytes
}

}  // namespace
}  // namespace ballot::test
