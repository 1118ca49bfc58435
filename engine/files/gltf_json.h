// The JSON of glTF files, before tinygltf has it. Internal to engine/files.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "engine/files/gltf_file.h"

namespace ballot {

using GltfJson = nlohmann::json;

/// Parses the JSON of a file. Throws Error(Work) that names the byte at which it is damaged, and as check_json() does
/// (json_limits.h).
GltfJson parse_gltf_json(const std::filesystem::path& path, std::string_view text);

/// Throws Error(Work), which names the object and the member, where the file lacks what glTF 2.0 requires and Ballot
/// needs, or has it of another type.
void check_required(const GltfJson& root);

/// Gives the JSON what tinygltf insists on, for a document that check_required() takes: a bufferView 0 to accessors of
/// indices that have none, whose numbers it returns; and a node of -1 to channels that move none.
/// Throws Error(Work) on indices that name an accessor or a bufferView that does not exist.
std::vector<std::size_t> complete_json(GltfJson& root);

/// Throws Error(Work) if there is no memory for what tinygltf makes of the document (memory.h).
void need_model_memory(const GltfJson& root);

/// Removes `extras` everywhere, as nobody reads them, and makes whole numbers of floats such as 3.0.
void tidy_json(GltfJson& value);

/// Returns a member of an object; null if it has none, or if it is no object.
const GltfJson* member(const GltfJson& object, const char* key);
const GltfJson* extension_of(const GltfJson& object, const char* name);

/// Returns a member that is a text; "" without one.
std::string text_in(const GltfJson& object, const char* key);

/// Returns an index; -1, which nothing has, unless it is a whole number of an int.
int index_in(const GltfJson& value);

/// Calls visit(element, number) for each element of a member that is an array.
template <class Visit>
void for_each_in(const GltfJson& object, const char* key, const Visit& visit) {
  const GltfJson* list = member(object, key);
  if (!list || !list->is_array()) return;
  for (std::size_t i = 0; i < list->size(); ++i) visit((*list)[i], i);
}

}  // namespace ballot
