// Attributes that cannot be, and columns of them: one clear error each, and nothing has changed.
#include "api.h"

namespace {

class ApiBadValues : public Api {
 protected:
  /// Expects the attribute to be refused where a mesh is made, added, or gets it.
  void expect_refused(const ballot::Attribute& attribute, const std::string& part) {
    ballot::Mesh mesh = grid_.mesh();
    mesh.attributes = &attribute, mesh.attribute_count = 1;
    const auto check = [&](const char* where, const auto& call) {
      std::string text;
      EXPECT_EQ(code_of(call, &text), BALLOT_ERROR_ARGUMENT);
      EXPECT_NE(text.find(where), std::string::npos) << text;
      EXPECT_NE(text.find(part), std::string::npos) << text;
    };
    check("mesh 1", [&] { ballot::Scene(*device_, {grid_.mesh(), mesh}); });
    check("mesh", [&] { scene_.add_mesh(mesh); });
    check("mesh 0", [&] { scene_.replace_mesh(0, mesh); });
    check("mesh 0", [&] { scene_.set_attribute(0, attribute); });
  }
  const std::vector<float> heat_ = std::vector<float>(17 * 17, 1.0f), few_ = std::vector<float>(3, 1.0f);
  ballot::Scene scene_{*device_, {grid_.mesh()}};
};

TEST_F(ApiBadValues, WhatCannotBeIsNamed) {
  expect_refused(ballot::attribute("heat", few_), "attribute 'heat': 3 values, of 289 vertices");
  expect_refused(ballot::attribute("heat", few_, 1, BALLOT_OF_PRIMS), "3 values, of 512 triangles");
  expect_refused(ballot::attribute("heat", few_, 1, BALLOT_OF_MESH), "3 values, of 1 mesh");
  expect_refused(ballot::attribute("normals", heat_), "called 'normals', as a column");
  expect_refused(ballot::attribute("", heat_), "has 0 bytes; expected 1 to 255");
  expect_refused(ballot::attribute(std::string(256, 'x').c_str(), heat_), "has 256 bytes");
  ballot::Attribute wrong = ballot::attribute("heat", heat_);
  wrong.name = nullptr;
  expect_refused(wrong, "the name of an attribute is NULL");
  wrong = ballot::attribute("heat", heat_), wrong.components = 5;
  expect_refused(wrong, "5 components; expected 1 to 4");
  wrong = ballot::attribute("heat", heat_), wrong.data = nullptr;
  expect_refused(wrong, "none of data and buffer is set");
  wrong = ballot::attribute("heat", heat_), wrong.stride = 2;
  expect_refused(wrong, "stride");
  wrong = ballot::attribute("heat", heat_), wrong.of = BallotValuesOf(3);
  expect_refused(wrong, "of is 3; expected BALLOT_OF_VERTICES");
  wrong = ballot::attribute("heat", few_, 3, BALLOT_OF_MESH), wrong.nearest = 1;
  expect_refused(wrong, "nearest is 1, but its values are not of vertices");
  wrong = ballot::attribute("heat", heat_), wrong.size = 3;
  EXPECT_EQ(code_of([&] { scene_.set_attribute(0, wrong); }), BALLOT_ERROR_ARGUMENT);
  scene_.commit();
  EXPECT_EQ(scene_.meshes()[0].attributes, 0u);
}

TEST_F(ApiBadValues, ArraysOnTheDeviceAreNamed) {
  ballot::Array<float> few(*device_, 288), heat(*device_, 289);
  ballot::Array<std::array<float, 2>> pairs(*device_, 289);
  ballot::Attribute wrong = ballot::attribute("heat", few);
  wrong.count = 289;
  expect_refused(wrong, "the buffer of values has 288 records; expected 289");
  wrong = ballot::attribute("heat", pairs), wrong.components = 1;
  expect_refused(wrong, "the buffer of values holds other records");
  wrong = ballot::attribute("heat", heat), wrong.data = heat_.data();
  expect_refused(wrong, "both of data and buffer are set");
  wrong = ballot::attribute("heat", heat), wrong.stride = 4;
  expect_refused(wrong, "expected 0 beside buffer");
  const ballot::Device other;
  const ballot::Array<float> elsewhere(other, 289);
  expect_refused(ballot::attribute("heat", elsewhere), "another device");
}

TEST_F(ApiBadValues, NamesStandForOneKindOfValue) {
  const ballot::Attribute twice[]{ballot::attribute("heat", heat_), ballot::attribute("heat", heat_)};
  ballot::Mesh mesh = grid_.mesh();
  mesh.attributes = twice, mesh.attribute_count = 2;
  std::string text;
  EXPECT_EQ(code_of([&] { ballot::Scene(*device_, {mesh}); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("mesh 0: two attributes are called 'heat'"), std::string::npos) << text;
  mesh.attribute_count = 1;
  const ballot::Attribute three = ballot::attribute("heat", few_, 3, BALLOT_OF_MESH);
  ballot::Mesh other = grid_.mesh();
  other.attributes = &three, other.attribute_count = 1;
  EXPECT_EQ(code_of([&] { ballot::Scene(*device_, {mesh, other}); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("mesh 1, attribute 'heat': it has 3 components, but 1 in mesh 0"), std::string::npos) << text;
  ballot::Scene scene(*device_, {mesh, grid_.mesh()});
  EXPECT_EQ(code_of([&] { scene.set_attribute(1, three); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("but 1 in mesh 0"), std::string::npos) << text;
  EXPECT_EQ(code_of([&] { scene.add_mesh(other); }), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(code_of([&] { scene.replace_mesh(1, other); }), BALLOT_ERROR_ARGUMENT);
  scene.set_attribute(0, three);  // the only one that has it
  scene.set_attribute(1, three);
  scene.commit();
  EXPECT_EQ(scene.attributes(0)[0].components, 3u);
  scene.remove_mesh(1);
  scene.set_attribute(0, ballot::attribute("heat", heat_));
  scene.commit();
  EXPECT_EQ(scene.attributes(0)[0].components, 1u);
  EXPECT_EQ(code_of([&] { scene.set_attribute(1, three); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("mesh 1: the scene has no mesh"), std::string::npos) << text;
}

TEST_F(ApiBadValues, ShapesHaveNoneOfVertices) {
  const std::vector<float> center{0, 0, 0}, radius{1};
  const ballot::Attribute one = ballot::attribute("heat", radius);
  ballot::Mesh ball = ballot::shapes("spheres", center, radius);
  ball.attributes = &one, ball.attribute_count = 1;
  std::string text;
  EXPECT_EQ(code_of([&] { ballot::Scene(*device_, {ball}); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("of vertices, but the mesh has spheres"), std::string::npos) << text;
}

TEST_F(ApiBadValues, ColumnsOfUnknownAttributes) {
  scene_.set_attribute(0, ballot::attribute("heat", heat_));
  scene_.commit();
  const auto rays = rays_down(10);
  std::vector<float> to(10, 7), t(10, 7);
  ballot::Results results{.t = t.data()};
  const auto expect_refused = [&](const std::vector<ballot::Values>& values, const std::string& part) {
    results.values = values.data(), results.value_count = values.size();
    std::string text;
    EXPECT_EQ(code_of([&] { scene_.trace(rays, results); }, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_EQ(t, std::vector<float>(10, 7));
  };
  expect_refused({{"cold", to.data()}}, "no mesh has an attribute 'cold'; there are: heat");
  expect_refused({{"heat", to.data()}, {"heat", t.data()}}, "attribute 'heat' is wanted twice");
  expect_refused({{nullptr, to.data()}}, "attribute of values is NULL");
  expect_refused({{"heat", nullptr}}, "data of values is NULL");
  results.values = nullptr, results.value_count = 1;
  EXPECT_EQ(code_of([&] { scene_.trace(rays, results); }), BALLOT_ERROR_ARGUMENT);
  ballot::Array<ballot::Ray> in(*device_, 10);
  in.write(rays);
  ballot::Array<float> one(*device_, 10), few(*device_, 9);
  ballot::Array<std::array<float, 2>> two(*device_, 10);
  const auto refused_there = [&](const ballot::Output& output, const std::string& part) {
    std::string text;
    EXPECT_EQ(code_of([&] { scene_.trace(in, {output}, 10); }, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  refused_there({"cold", one}, "no column or attribute is called 'cold'");
  refused_there({"heat", two}, "the buffer of heat holds other records; expected float32");
  refused_there({"heat", few}, "9 records; expected 10");
  results.values = nullptr, results.value_count = 0;
  scene_.trace(rays, results);
}

}  // namespace
