// Scenes in Python: made of arrays, loaded, moved, described.
#include "door.h"
#include "vectors.h"

namespace ballot::python {

namespace {

using Indices = nb::ndarray<const std::uint32_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Numbers = nb::ndarray<const float, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Indices16 = nb::ndarray<const std::uint16_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

/// An attribute as Python gives it: (name, number of what its values are of, components, nearest, (n, c) values or an
/// array on the device). Keeps its array.
struct AttributeArray {
  using Values = nb::ndarray<const float, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
  explicit AttributeArray(const nb::tuple& given)
      : name(std::make_shared<std::string>(nb::cast<std::string>(given[0]))) {
    attribute.name = name->c_str();
    attribute.of = BallotValuesOf(nb::cast<int>(given[1]));
    attribute.components = nb::cast<std::uint32_t>(given[2]);
    attribute.nearest = nb::cast<bool>(given[3]);
    const ArrayObject* array = nullptr;
    if (nb::try_cast<const ArrayObject*>(given[4], array, false) && array) {
      there = array->use();
      attribute.buffer = there->get(), attribute.count = array->count;
    } else {
      values = nb::cast<Values>(given[4], false);
      if (values.shape(1) != attribute.components)
        throw Error(BALLOT_ERROR_ARGUMENT, *name + ": expected as many numbers of a value as components");
      attribute.data = values.data(), attribute.count = values.shape(0);
    }
  }
  std::shared_ptr<std::string> name;  // lies where it is while this is copied
  Values values;
  std::shared_ptr<Buffer> there;
  Attribute attribute;
};

/// A mesh as Python gives it: (vertices, flat indices or None, id, normals or None, kind of shapes or None, radii or
/// None, name or None, attributes, origin or None, grid or None), the first two also as arrays on the device. Of
/// heights the vertices are these, and there is a grid: columns, spacing, corner. Keeps its arrays.
struct MeshArrays {
  explicit MeshArrays(const nb::tuple& given) {
    if (!given[9].is_none()) {
      heights = nb::cast<Numbers>(given[0], false);
      const auto number = [&](int i) { return nb::cast<double>(given[9][i]); };
      mesh = ballot::heights({heights.data(), heights.size()}, nb::cast<std::size_t>(given[9][0]),
                             {number(1), number(2)}, {number(3), number(4)});
    } else if (const auto* there = array_there(given[0], vertices_there)) {
      mesh.vertex_buffer = vertices_there->get(), mesh.vertex_count = there->count;
    } else {
      vertices.emplace(given[0]);
      constexpr std::span<const std::uint32_t> kInTurn;
      mesh = vertices->doubles.empty() ? ballot::mesh(vertices->numbers, kInTurn, vertices->stride)
                                       : ballot::mesh(vertices->doubles, kInTurn, vertices->stride);
    }
    if (const auto* there = array_there(given[1], indices_there)) {
      mesh.index_buffer = indices_there->get(), mesh.index_count = there->count;
    } else if (!given[1].is_none()) {
      const bool are_long = nb::try_cast<Indices>(given[1], indices, false);
      if (!are_long) indices16 = nb::cast<Indices16>(given[1], false);
      mesh.indices = are_long ? static_cast<const void*>(indices.data()) : indices16.data();
      mesh.index_count = are_long ? indices.size() : indices16.size();
      mesh.index_type = are_long ? BALLOT_INDEX_U32 : BALLOT_INDEX_U16;
    }
    mesh.id = nb::cast<std::uint32_t>(given[2]);
    if (!given[4].is_none()) kind = std::make_shared<std::string>(nb::cast<std::string>(given[4])), mesh.shapes = *kind;
    if (!given[5].is_none()) {
      radii = nb::cast<Numbers>(given[5], false);
      if (radii.size() != mesh.vertex_count) throw Error(BALLOT_ERROR_ARGUMENT, "radii: expected as many as vertices");
      mesh.radii = radii.data();
    }
    if (!given[6].is_none()) name = std::make_shared<std::string>(nb::cast<std::string>(given[6])), mesh.name = *name;
    for (const nb::handle one : nb::cast<nb::list>(given[7])) {
      attributes->emplace_back(nb::cast<nb::tuple>(one));
      listed->push_back(attributes->back().attribute);
    }
    mesh.attributes = listed->data(), mesh.attribute_count = listed->size();
    for (int axis = 0; axis < 3 && !given[8].is_none(); ++axis) mesh.origin[axis] = nb::cast<double>(given[8][axis]);
    if (given[3].is_none()) return;
    normals.emplace(given[3]);
    if (!normals->doubles.empty() || normals->count() != mesh.vertex_count)
      throw Error(BALLOT_ERROR_ARGUMENT, "normals: expected float32, as many as vertices");
    mesh.normals = normals->numbers.data(), mesh.normal_stride = normals->stride;
  }
  /// Returns an array on the device, which `use` keeps then; null: the host's.
  static const ArrayObject* array_there(const nb::handle& given, std::shared_ptr<Buffer>& use) {
    const ArrayObject* there = nullptr;
    if (nb::try_cast<const ArrayObject*>(given, there, false) && there) use = there->use();
    return there;
  }
  std::optional<Vectors> vertices;
  std::shared_ptr<Buffer> vertices_there, indices_there;
  Indices indices;
  Indices16 indices16;
  std::optional<Vectors> normals;
  std::shared_ptr<std::string> kind, name;  // these lie where they are while this is copied
  std::shared_ptr<std::vector<AttributeArray>> attributes = std::make_shared<std::vector<AttributeArray>>();
  std::shared_ptr<std::vector<Attribute>> listed = std::make_shared<std::vector<Attribute>>();
  Numbers radii, heights;
  Mesh mesh;
};

std::vector<MeshArrays> arrays_of(const nb::list& meshes) {
  std::vector<MeshArrays> arrays;
  arrays.reserve(meshes.size());
  for (const nb::handle mesh : meshes) arrays.emplace_back(nb::cast<nb::tuple>(mesh));
  return arrays;
}

std::vector<Mesh> meshes_of(const std::vector<MeshArrays>& arrays) {
  std::vector<Mesh> list;
  for (const MeshArrays& a : arrays) list.push_back(a.mesh);
  return list;
}

/// Instances as Python gives them: (matrices, numbers of their meshes, masks or None, groups or None). Keeps its
/// arrays.
struct InstanceArrays {
  explicit InstanceArrays(const nb::tuple& given) : transforms(given[0]), meshes(nb::cast<Indices>(given[1], false)) {
    if (!given[2].is_none()) masks = nb::cast<Indices>(given[2], false);
    if (!given[3].is_none()) groups = nb::cast<Indices>(given[3], false);
    const auto placed = [&](auto matrices) {
      return ballot::instances(matrices, {meshes.data(), meshes.size()}, {masks.data(), masks.size()}, 0,
                               {groups.data(), groups.size()});
    };
    instances = transforms.doubles.empty() ? placed(transforms.numbers) : placed(transforms.doubles);
  }
  MatrixArray transforms;
  Indices meshes, masks, groups;
  Instances instances;
};

using SceneSettings = Options<BallotSceneOptions>;

/// `instances`: as InstanceArrays has them; None: each mesh lies in the world, once.
void make_scene(SceneObject* self, const DeviceObject& device, const ObjectList& meshes, const nb::object& instances,
                const ObjectDict& options) {
  std::optional<InstanceArrays> placed;
  if (!instances.is_none()) placed.emplace(nb::cast<nb::tuple>(instances));
  const auto call = [=, arrays = arrays_of(meshes), how = SceneSettings(options, door::kSceneRows)](const Device& d,
                                                                                                    Watch& watch) {
    BallotSceneOptions given = how.c;
    given.progress = watch;
    const std::vector<Mesh> all = meshes_of(arrays);
    if (placed) return std::make_shared<Scene>(d, std::span<const Mesh>(all), placed->instances, given);
    return std::make_shared<Scene>(d, std::span<const Mesh>(all), given);
  };
  new (self) SceneObject(watched(device.use(), nb::none(), call));
}

/// `path`: as the system has it, in any encoding.
void load_scene(SceneObject* self, const DeviceObject& device, const nb::bytes& path, const ObjectDict& options) {
  const auto call = [name = std::string(path.c_str(), path.size()), how = SceneSettings(options, door::kSceneRows)](
                        const Device& d, Watch& watch) {
    BallotSceneOptions given = how.c;
    given.progress = watch;
    return std::make_shared<Scene>(Scene::load(d, name, given));
  };
  new (self) SceneObject(watched(device.use(), nb::none(), call));
}

Objects info_of(const SceneObject& self) {
  const SceneInfo info = watched(self.use(), nb::none(), [](const Scene& s, Watch&) { return s.info(); });
  return tuple_of(&info, door::kSceneInfoRows);
}

template <class Info>
ObjectList tuples_of(const std::vector<Info>& infos, Rows rows) {
  ObjectList all = nb::list();
  for (const Info& info : infos) all.append(tuple_of(&info, rows));
  return all;
}

ObjectList meshes(const SceneObject& self) {
  return tuples_of(watched(self.use(), nb::none(), [](const Scene& s, Watch&) { return s.meshes(); }),
                   door::kMeshInfoRows);
}

ObjectList instances(const SceneObject& self) {
  return tuples_of(watched(self.use(), nb::none(), [](const Scene& s, Watch&) { return s.instances(); }),
                   door::kInstanceInfoRows);
}

/// Calls what edits a scene, and returns what that returns.
template <class Edit>
auto edit(const SceneObject& self, const Edit& how) {
  return watched(self.use(), nb::none(), [&](Scene& s, Watch&) { return how(s); });
}

std::uint32_t add_mesh(const SceneObject& self, const Objects& mesh) {
  return edit(self, [arrays = MeshArrays(mesh)](Scene& s) { return s.add_mesh(arrays.mesh); });
}

void replace_mesh(const SceneObject& self, std::uint32_t mesh, const Objects& with) {
  edit(self, [=, arrays = MeshArrays(with)](Scene& s) { return s.replace_mesh(mesh, arrays.mesh), true; });
}

void remove_mesh(const SceneObject& self, std::uint32_t mesh) {
  edit(self, [=](Scene& s) { return s.remove_mesh(mesh), true; });
}

void set_attribute(const SceneObject& self, std::uint32_t mesh, const Objects& attribute) {
  edit(self, [=, given = AttributeArray(attribute)](Scene& s) { return s.set_attribute(mesh, given.attribute), true; });
}

/// Returns (number of the mesh, name, number of what its values are of, components, nearest, place) of each attribute.
ObjectList attributes(const SceneObject& self) {
  struct Told {
    std::uint32_t mesh, place;
    AttributeInfo info;
  };
  const auto all = watched(self.use(), nb::none(), [](const Scene& s, Watch&) {
    std::vector<Told> told;
    for (const MeshInfo& mesh : s.meshes())
      for (std::uint32_t i = 0; i < mesh.attributes; ++i) {
        Told& one = told.emplace_back(Told{mesh.mesh, i, {}});
        check(ballot_scene_attribute(s.handle(), mesh.mesh, i, &one.info));
      }
    return told;
  });
  ObjectList list = nb::list();
  for (const Told& a : all)
    list.append(
        nb::make_tuple(a.mesh, std::string(a.info.name), a.info.of, a.info.components, a.info.nearest != 0, a.place));
  return list;
}

auto attribute_values(const SceneObject& self, std::uint32_t mesh, std::size_t place) {
  std::vector<float> all =
      watched(self.use(), nb::none(), [=](const Scene& s, Watch&) { return s.attribute_values(mesh, place); });
  const std::size_t count = all.size();
  return array_of(std::move(all), {count});
}

std::vector<std::uint32_t> find_meshes(const SceneObject& self, const std::string& name) {
  return watched(self.use(), nb::none(), [=](const Scene& s, Watch&) { return s.find_meshes(name); });
}

/// The caller keeps the array until the next commit.
void set_vertices(const SceneObject& self, std::uint32_t mesh, const nb::object& vertices) {
  edit(self, [=, v = Vectors(vertices)](Scene& s) {
    v.doubles.empty() ? s.set_vertices(mesh, v.numbers, v.stride) : s.set_vertices(mesh, v.doubles, v.stride);
    return true;
  });
}

void set_heights(const SceneObject& self, std::uint32_t mesh, const Numbers& heights) {
  edit(self, [=](Scene& s) { return s.set_heights(mesh, {heights.data(), heights.size()}), true; });
}

auto heights(const SceneObject& self, std::uint32_t mesh) {
  std::vector<float> all = without_gil(self.use(), [=](const Scene& s) { return s.heights(mesh); });
  const std::size_t count = all.size();
  return array_of(std::move(all), {count});
}

void set_transform_array(const SceneObject& self, const ArrayObject& transforms) {
  edit(self, [from = transforms.use()](Scene& s) {
    check(ballot_scene_set_transform_buffer(s.handle(), from->get()));
    return true;
  });
}

void set_mask_array(const SceneObject& self, const ArrayObject& masks) {
  edit(self, [from = masks.use()](Scene& s) {
    check(ballot_scene_set_mask_buffer(s.handle(), from->get()));
    return true;
  });
}

void set_vertex_array(const SceneObject& self, std::uint32_t mesh, const ArrayObject& vertices) {
  edit(self, [=, from = vertices.use()](Scene& s) {
    check(ballot_scene_set_vertex_buffer(s.handle(), mesh, from->get()));
    return true;
  });
}

auto add_instances(const SceneObject& self, const Objects& instances) {
  std::vector<std::uint32_t> numbers =
      edit(self, [given = InstanceArrays(instances)](Scene& s) { return s.add_instances(given.instances); });
  const std::size_t count = numbers.size();
  return array_of(std::move(numbers), {count});
}

void remove_instances(const SceneObject& self, const Indices& numbers) {
  edit(self, [=](Scene& s) { return s.remove_instances({numbers.data(), numbers.size()}), true; });
}

/// `numbers`: of the instances; None: all, and the caller keeps the matrices until the next commit.
void set_transforms(const SceneObject& self, const nb::object& matrices, const nb::object& numbers) {
  const MatrixArray all(matrices);
  if (numbers.is_none()) {
    edit(self, [=](Scene& s) {
      return all.doubles.empty() ? s.set_transforms(all.numbers) : s.set_transforms(all.doubles), true;
    });
    return;
  }
  edit(self, [=, which = nb::cast<Indices>(numbers, false)](Scene& s) {
    const std::span<const std::uint32_t> some{which.data(), which.size()};
    return all.doubles.empty() ? s.set_transforms(some, all.numbers) : s.set_transforms(some, all.doubles), true;
  });
}

void set_masks(const SceneObject& self, const Indices& numbers, const Indices& masks) {
  edit(self, [=](Scene& s) {
    return s.set_masks({numbers.data(), numbers.size()}, {masks.data(), masks.size()}), true;
  });
}

void set_groups(const SceneObject& self, const Indices& numbers, const Indices& groups) {
  edit(self, [=](Scene& s) {
    return s.set_groups({numbers.data(), numbers.size()}, {groups.data(), groups.size()}), true;
  });
}

/// `reads`: the arrays that the commit reads.
void commit(const SceneObject& self, const ObjectList& reads) {
  edit(self, [=](Scene& s) {
    static_cast<void>(reads);  // kept until then
    return s.commit(), true;
  });
}

void discard(const SceneObject& self) {
  edit(self, [](Scene& s) { return s.discard(), true; });
}

ObjectList animations(const SceneObject& self) {
  return tuples_of(without_gil(self.use(), [](const Scene& s) { return s.animations(); }), door::kAnimationInfoRows);
}

void set_time(const SceneObject& self, std::size_t animation, double seconds) {
  watched(self.use(), nb::none(), [=](Scene& s, Watch&) {
    s.set_time(animation, seconds);
    return true;
  });
}

auto triangles(const SceneObject& self) {
  std::vector<float> all = watched(self.use(), nb::none(), [](const Scene& s, Watch&) { return s.triangles(); });
  const std::size_t count = all.size() / 9;
  return array_of(std::move(all), {count, 3, 3});
}

auto indices(const SceneObject& self, std::uint32_t mesh) {
  std::vector<std::uint32_t> all = without_gil(self.use(), [=](const Scene& s) { return s.indices(mesh); });
  const std::size_t count = all.size();
  return array_of(std::move(all), {count});
}

}  // namespace

void bind_scenes(nb::module_& m) {
  nb::class_<SceneObject> scene(m, "Scene");
  scene.def("__init__", &make_scene, nb::arg(), nb::arg(), nb::arg().none(), nb::arg())
      .def("__init__", &load_scene)
      .def("close", &SceneObject::close)
      .def_prop_ro("closed", &SceneObject::closed)
      .def("info", &info_of)
      .def("meshes", &meshes)
      .def("instances", &instances)
      .def("add_mesh", &add_mesh)
      .def("replace_mesh", &replace_mesh)
      .def("remove_mesh", &remove_mesh)
      .def("find_meshes", &find_meshes)
      .def("set_attribute", &set_attribute)
      .def("attributes", &attributes)
      .def("attribute_values", &attribute_values)
      .def("set_vertices", &set_vertices)
      .def("set_vertex_array", &set_vertex_array)
      .def("set_heights", &set_heights)
      .def("heights", &heights)
      .def("set_transform_array", &set_transform_array)
      .def("set_mask_array", &set_mask_array)
      .def("add_instances", &add_instances)
      .def("remove_instances", &remove_instances)
      .def("set_transforms", &set_transforms, nb::arg(), nb::arg().none())
      .def("set_masks", &set_masks)
      .def("set_groups", &set_groups)
      .def("commit", &commit)
      .def("discard", &discard)
      .def("animations", &animations)
      .def("set_time", &set_time)
      .def("triangles", &triangles)
      .def("indices", &indices);
  bind_pictures(scene);
  bind_answers(m, scene);
}

}  // namespace ballot::python
