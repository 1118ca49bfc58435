// Tests the note about files whose numbers float32 cannot hold.
#include <cstring>

#include "gltf_builder.h"

namespace ballot::test {
namespace {

constexpr double kNorth = 4649776, kEast = 500000;  // float32 numbers are 0.5 apart there
constexpr const char* kNote = "Far from the origin, up to 4649777";

/// Returns a triangle of 1 m at a place, with a corner `finer` beside a whole number, as a file has it.
Scene far_file(const std::string& name, double east, double north, double finer) {
  const auto text = [&](const char* start) {
    return fmt::format("{}{} {} 0\n{}{} {} 0\n{}{} {} 0\n", start, east, north + finer, start, east + 1, north, start,
                       east, north + 1);
  };
  std::string content;
  if (name.ends_with(".obj")) content = text("v ") + "f 1 2 3\n";
  if (name.ends_with(".stl"))
    content = "solid a\nfacet normal 0 0 1\nouter loop\n" + text("vertex ") + "endloop\nendfacet\nendsolid a\n";
  if (name.ends_with(".ply"))
    content =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n" +
        text("") + "3 0 1 2\n";
  if (name.ends_with(".npy")) {
    const std::array<double, 9> numbers{east, north + finer, 0, east + 1, north, 0, east, north + 1, 0};
    std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 3, 3), }";
    header.append(117 - header.size(), ' ').append("\n");
    content = std::string("\x93NUMPY\x01\0\x76\0", 10) + header;
    content.append(reinterpret_cast<const char*>(numbers.data()), sizeof numbers);
  }
  const TemporaryFolder folder;
  return load_scene(folder.write(name, content));
}
std::vector<std::string> notes_of(const std::string& name, double east, double north, double finer) {
  return far_file(name, east, north, finer).notes;
}

TEST(FarFiles, NumbersThatFloat32DoesNotHoldAreCountedFromAnOrigin) {
  for (const char* name : {"a.npy", "a.obj", "a.ply"}) {
    SCOPED_TRACE(name);
    const Scene scene = far_file(name, kEast, kNorth, 0.4);
    EXPECT_TRUE(scene.notes.empty());
    EXPECT_NEAR(scene.origin.x, kEast, 1);
    EXPECT_NEAR(scene.origin.y, kNorth, 1);
    EXPECT_NEAR(double(scene.triangles[0][0].y) + scene.origin.y, kNorth + 0.4, 1e-7);
    EXPECT_EQ(far_file(name, 1, 1, 0.4).origin, glm::dvec3(0));
    EXPECT_EQ(far_file(name, 1, 1, 0.4).triangles[0][0].y, 1.4f);
  }
  for (const char* name : {"a.obj", "a.ply"})  // float32 holds whole numbers
    EXPECT_EQ(far_file(name, kEast, kNorth, 0).origin, glm::dvec3(0)) << name;
}

// One vertex at zero ends it: the scene reaches from there.
TEST(FarFiles, AnOriginIsOfScenesThatLieFarFromZeroAsAWhole) {
  const TemporaryFolder folder;
  const std::string far_away = fmt::format("v {0} {1} 0\nv {0}.5 {1} 0\nv {0} {1}.25 0.1\n", kEast, kNorth);
  EXPECT_NE(load_scene(folder.write("a.obj", far_away + "f 1 2 3\n")).origin.y, 0);
  EXPECT_EQ(load_scene(folder.write("b.obj", far_away + "v 0 0 0\nf 1 2 3\n")).origin, glm::dvec3(0));
  EXPECT_EQ(load_scene(folder.write("c.obj", "v 0 0 0\n" + far_away + "f 2 3 4\n")).origin, glm::dvec3(0));
}

TEST(FarFiles, TextThatIsRoundedIsTold) {
  const std::vector<std::string> notes = notes_of("a.stl", kEast, kNorth, 0.4);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_TRUE(notes[0].starts_with(kNote)) << notes[0];
  EXPECT_NE(notes[0].find("by up to 0.25, which is 2.5e-01 of the scene's size of 1;"), std::string::npos) << notes[0];
  EXPECT_NE(notes[0].find("subtract (500000.5, 4649776.5, 0)"), std::string::npos) << notes[0];
  EXPECT_TRUE(notes_of("a.stl", kEast, kNorth, 0).empty());  // whole numbers are held
  EXPECT_TRUE(notes_of("a.stl", 5, 4, 0.4).empty());
}

}  // namespace
}  // namespace ballot::test
