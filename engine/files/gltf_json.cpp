#include "engine/files/gltf_json.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/core/json_limits.h"
#include "engine/core/memory.h"
#include "engine/files/loaders.h"

namespace ballot {
namespace {

enum class JsonType { Index, Text, List, Object, Number };

constexpr std::array<const char*, 5> kJsonTypeWords{"a whole number, not below 0", "a text", "an array", "an object",
                                                    "a number"};

/// Returns true if a value is of this type.
bool is_of(const GltfJson& value, JsonType type) {
  switch (type) {
    case JsonType::Index:
      return value.is_number_unsigned();
    case JsonType::Text:
      return value.is_string();
    case JsonType::List:
      return value.is_array();
    case JsonType::Object:
      return value.is_object();
    default:
      return value.is_number();
  }
}

/// The lists of a file, and what an object in each is called.
constexpr std::array<std::pair<const char*, const char*>, 13> kLists{{{"accessors", "accessor"},
                                                                      {"animations", "animation"},
                                                                      {"buffers", "buffer"},
                                                                      {"bufferViews", "bufferView"},
                                                                      {"cameras", "camera"},
                                                                      {"images", "image"},
                                                                      {"materials", "material"},
                                                                      {"meshes", "mesh"},
                                                                      {"nodes", "node"},
                                                                      {"samplers", "sampler"},
                                                                      {"scenes", "scene"},
                                                                      {"skins", "skin"},
                                                                      {"textures", "texture"}}};

/// A member that the objects of a list must have.
struct Required {
  const char* list;   // of the file
  const char* inner;  // the list or the object in these that must have it; "": they themselves
  const char* name;
  JsonType type;
};

/// What glTF 2.0 requires, where tinygltf gives up without it or leaves the object out.
constexpr Required kRequired[] = {
    {"bufferViews", "", "buffer", JsonType::Index},
    {"bufferViews", "", "byteLength", JsonType::Index},
    {"accessors", "", "componentType", JsonType::Index},
    {"accessors", "", "count", JsonType::Index},
    {"accessors", "", "type", JsonType::Text},
    {"accessors", "sparse", "count", JsonType::Number},
    {"accessors", "sparse", "indices", JsonType::Object},
    {"accessors", "sparse", "values", JsonType::Object},
    {"meshes", "primitives", "attributes", JsonType::Object},
    {"animations", "channels", "sampler", JsonType::Index},
    {"animations", "channels", "target", JsonType::Object},
    {"animations", "samplers", "input", JsonType::Index},
    {"animations", "samplers", "output", JsonType::Index},
    {"skins", "", "joints", JsonType::List},
    {"cameras", "", "type", JsonType::Text},
    {"cameras", "perspective", "yfov", JsonType::Number},
    {"cameras", "perspective", "znear", JsonType::Number},
    {"cameras", "orthographic", "xmag", JsonType::Number},
    {"cameras", "orthographic", "ymag", JsonType::Number},
    {"cameras", "orthographic", "zfar", JsonType::Number},
    {"cameras", "orthographic", "znear", JsonType::Number},
};

/// Where an object is, for errors: its kind, its number, and what it holds there.
struct ObjectPlace {
  const char* kind;
  std::size_t number;
  const GltfJson& object;
  std::string_view inner = {};
  std::size_t inner_number = 0;

  std::string text() const {
    const std::string place = label(kind, number, text_in(object, "name"));
    if (inner.empty()) return place;
    if (!inner.ends_with('s')) return fmt::format("{} {}", place, inner);
    return fmt::format("{} {} {}", place, inner.substr(0, inner.size() - 1), inner_number);
  }
};

/// Throws Error(Work) that names the object.
template <class... Args>
[[noreturn]] void refuse_object(const ObjectPlace& where, fmt::format_string<Args...> text, Args&&... args) {
  refuse("is not valid glTF 2.0: {} {}; export it again", where.text(), fmt::format(text, std::forward<Args>(args)...));
}

/// Throws Error(Work) about a member with a wrong value.
[[noreturn]] void refuse_value(const ObjectPlace& where, const GltfJson& found, std::string_view name,
                               std::string_view expected) {
  refuse_object(where, "has {} as its {}; expected {}", found.dump().substr(0, 40), name, expected);
}

/// Checks that an object has a member of this type.
void check_member(const GltfJson& object, const ObjectPlace& where, const char* name, JsonType type) {
  const GltfJson* found = member(object, name);
  const char* expected = kJsonTypeWords[static_cast<std::size_t>(type)];
  if (!found) refuse_object(where, "has no {}; expected {}", name, expected);
  if (!is_of(*found, type)) refuse_value(where, *found, name, expected);
}

/// Checks that an object of a list, and the objects in it, have what they must have.
void check_members(std::string_view list, const GltfJson& object, const ObjectPlace& where) {
  if (!object.is_object()) refuse_object(where, "is no object");
  for (const Required& r : kRequired) {
    if (r.list != list) continue;
    if (*r.inner == 0) check_member(object, where, r.name, r.type);
    if (const GltfJson* part = member(object, r.inner); part && part->is_object())
      check_member(*part, {where.kind, where.number, object, r.inner}, r.name, r.type);
    for_each_in(object, r.inner, [&](const GltfJson& each, std::size_t i) {
      check_member(each, {where.kind, where.number, object, r.inner, i}, r.name, r.type);
    });
  }
}

/// Checks values that tinygltf refuses.
void check_values(std::string_view list, const GltfJson& object, const ObjectPlace& where) {
  if (const GltfJson* stride = member(object, "byteStride"); list == "bufferViews" && stride && stride->is_number())
    if (!stride->is_number_unsigned() || *stride > 252 || stride->get<int>() % 4 != 0)
      refuse_value(where, *stride, "byteStride", "a multiple of 4 up to 252");
  if (list == "accessors") {
    constexpr std::array<std::string_view, 7> kTypes{"SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"};
    if (std::ranges::find(kTypes, object["type"].get<std::string>()) == kTypes.end())
      refuse_value(where, object["type"], "type", "SCALAR, VEC2 to VEC4 or MAT2 to MAT4");
    if (object["componentType"] < 5120 || object["componentType"] > 5126)
      refuse_value(where, object["componentType"], "componentType", "5120 to 5126");
  }
  if (const GltfJson* color = member(object, "emissiveFactor"); list == "materials" && color && color->is_array())
    if (color->size() != 3) refuse_value(where, *color, "emissiveFactor", "three numbers");
  if (list == "cameras") {
    const std::string type = text_in(object, "type");
    if (type != "perspective" && type != "orthographic")
      refuse_value(where, object["type"], "type", "perspective or orthographic");
    check_member(object, where, type.c_str(), JsonType::Object);
  }
  if (list == "meshes")
    for_each_in(object, "primitives", [&](const GltfJson& primitive, std::size_t i) {
      const ObjectPlace place{where.kind, where.number, object, "primitives", i};
      for (const auto& [name, index] : primitive["attributes"].items())
        check_member(primitive["attributes"], place, name.c_str(), JsonType::Index);
    });
}

/// Members that tinygltf reads as int: alone, in an array or in objects.
constexpr std::string_view kNumbers =
    " attributes buffer bufferView camera children componentType height index indices input inverseBindMatrices"
    " joints magFilter material mesh minFilter mode node nodes output sampler scene skeleton skin source"
    " sparse target targets texCoord width wrapR wrapS wrapT ";

/// Checks that no such number is beyond int, below a member of this name.
void check_numbers(const GltfJson& value, std::string_view name) {
  if (value.is_object()) {
    const bool inside = name == "attributes" || name == "sparse" || name == "targets";
    for (const auto& [key, each] : value.items()) check_numbers(each, inside ? name : std::string_view(key));
  } else if (value.is_array()) {
    for (const GltfJson& each : value) check_numbers(each, name);
  } else if (value.is_number() && std::abs(value.get<double>()) >= 0x1p31 &&
             kNumbers.find(fmt::format(" {} ", name)) != kNumbers.npos) {
    refuse("is not valid glTF 2.0: it has {} as {}; expected a number below 2^31; export it again", value.dump(), name);
  }
}

/// Checks the lights of KHR_lights_punctual.
void check_lights(const GltfJson& root) {
  const GltfJson* lights = extension_of(root, "KHR_lights_punctual");
  if (!lights) return;
  for_each_in(*lights, "lights", [&](const GltfJson& light, std::size_t i) {
    check_member(light, {"light", i, light}, "type", JsonType::Text);
    if (text_in(light, "type") == "spot") check_member(light, {"light", i, light}, "spot", JsonType::Object);
  });
}

/// The bytes that tinygltf takes for each object of a list, wherever it is.
std::size_t object_bytes(std::string_view list) {
  constexpr std::pair<std::string_view, std::size_t> kBytes[] = {{"accessors", sizeof(tinygltf::Accessor)},
                                                                 {"animations", sizeof(tinygltf::Animation)},
                                                                 {"bufferViews", sizeof(tinygltf::BufferView)},
                                                                 {"cameras", sizeof(tinygltf::Camera)},
                                                                 {"channels", sizeof(tinygltf::AnimationChannel)},
                                                                 {"lights", sizeof(tinygltf::Light)},
                                                                 {"materials", sizeof(tinygltf::Material)},
                                                                 {"meshes", sizeof(tinygltf::Mesh)},
                                                                 {"nodes", sizeof(tinygltf::Node)},
                                                                 {"primitives", sizeof(tinygltf::Primitive)},
                                                                 {"samplers", sizeof(tinygltf::Sampler)},
                                                                 {"scenes", sizeof(tinygltf::Scene)},
                                                                 {"skins", sizeof(tinygltf::Skin)},
                                                                 {"textures", sizeof(tinygltf::Texture)}};
  for (const auto& [name, bytes] : kBytes)
    if (name == list) return bytes;
  return 0;
}

/// Returns about the bytes that tinygltf takes for a value. `each`: those for each value in it.
std::uint64_t model_bytes(const GltfJson& value, std::size_t each) {
  constexpr std::size_t kGrowing = 2;  // arrays double
  constexpr std::size_t kRoom = 16;    // of the heap's own
  constexpr std::size_t kInMaps = 64;  // of a node of a map
  std::uint64_t bytes = each;
  if (value.is_array())
    for (const GltfJson& v : value) bytes += model_bytes(v, each);
  if (!value.is_object()) return bytes;
  for (const auto& [key, v] : value.items()) {
    const std::size_t inner = key == "extensions"  ? sizeof(tinygltf::Value) + kRoom
                              : key == "materials" ? sizeof(tinygltf::Parameter) + kInMaps
                                                   : each;
    bytes +=
        kInMaps + model_bytes(v, std::max(inner, each)) + (v.is_array() ? kGrowing * v.size() * object_bytes(key) : 0);
  }
  return bytes;
}

}  // namespace

GltfJson parse_gltf_json(const std::filesystem::path& path, std::string_view text) {
  check_json(path, text);
  try {
    return GltfJson::parse(text);
  } catch (const GltfJson::parse_error& e) {
    refuse("is not valid glTF 2.0: its JSON is damaged or ends at byte {} of {}; copy or export it again",
           std::min(e.byte, text.size()), text.size());
  } catch (const GltfJson::exception&) {  // such as 1e999
    refuse("is not valid glTF 2.0: its JSON has a number that no double can hold; export it again");
  }
}

void check_required(const GltfJson& root) {
  const GltfJson* asset = member(root, "asset");
  if (!asset || text_in(*asset, "version").empty())
    refuse("is not valid glTF 2.0: it has no asset with a version; export it again");
  for (const auto& [list, kind] : kLists) {
    if (const GltfJson* found = member(root, list); found && !found->is_array())
      refuse("is not valid glTF 2.0: its {} are no array; export it again", list);
    for_each_in(root, list, [&, &list = list, &kind = kind](const GltfJson& object, std::size_t i) {
      check_members(list, object, {kind, i, object});
      check_values(list, object, {kind, i, object});
    });
  }
  check_lights(root);
  check_numbers(root, {});
}

std::vector<std::size_t> complete_json(GltfJson& root) {
  std::vector<std::size_t> completed;
  GltfJson& accessors = root["accessors"];
  const std::size_t views = root.contains("bufferViews") ? root["bufferViews"].size() : 0;
  for (GltfJson& mesh : root["meshes"])
    for (GltfJson& primitive : mesh["primitives"]) {
      const GltfJson* indices = member(primitive, "indices");
      if (!indices || *indices == -1) continue;
      const auto i = static_cast<std::size_t>(index_in(*indices));
      if (i >= accessors.size())
        refuse("indices of a primitive name accessor {}, but the file has {}", indices->dump(), accessors.size());
      if (const GltfJson* view = member(accessors[i], "bufferView")) {
        if (index_in(*view) < 0 || static_cast<std::size_t>(index_in(*view)) >= views)
          refuse("accessor {} names bufferView {}, but the file has {}", i, view->dump(), views);
        continue;
      }
      accessors[i]["bufferView"] = 0;
      completed.push_back(i);
    }
  for (GltfJson& animation : root["animations"])
    for (GltfJson& channel : animation["channels"]) {
      if (!animation["channels"].is_array()) break;
      if (GltfJson& target = channel["target"]; !target.contains("node") || !target.contains("path"))
        target = {{"node", -1}, {"path", "pointer"}};
    }
  return completed;
}

void need_model_memory(const GltfJson& root) { need_memory_for(model_bytes(root, 0), "what its JSON describes"); }

void tidy_json(GltfJson& value) {
  if (value.is_object()) value.erase("extras");
  for (GltfJson& each : value)
    if (each.is_structured()) {
      tidy_json(each);
    } else if (each.is_number_float()) {
      const auto number = each.get<double>();
      if (number == std::floor(number) && std::abs(number) < 0x1p31 && (number != 0 || !std::signbit(number)))
        each = number < 0 ? GltfJson(static_cast<std::int64_t>(number)) : GltfJson(static_cast<std::uint64_t>(number));
    }
}

const GltfJson* member(const GltfJson& object, const char* key) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(key);
  return found == object.end() ? nullptr : &*found;
}

const GltfJson* extension_of(const GltfJson& object, const char* name) {
  const GltfJson* all = member(object, "extensions");
  return all ? member(*all, name) : nullptr;
}

std::string text_in(const GltfJson& object, const char* key) {
  const GltfJson* text = member(object, key);
  return text && text->is_string() ? text->get<std::string>() : "";
}

int index_in(const GltfJson& value) {
  return value.is_number_unsigned() && value <= std::numeric_limits<int>::max() ? value.get<int>() : -1;
}

}  // namespace ballot
