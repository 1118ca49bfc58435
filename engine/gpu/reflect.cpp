#include <spirv_cross/spirv_cross_c.h>

#include <algorithm>

#include "engine/core/error.h"
#include "engine/gpu/shader.h"

namespace ballot {

namespace {

/// Returns the bindings of one kind of resource, in ascending order. Throws Error(Work) if one is not in set 0.
std::vector<std::uint32_t> bindings_of(spvc_compiler compiler, spvc_resources resources, spvc_resource_type type,
                                       const std::string& name) {
  const spvc_reflected_resource* list = nullptr;
  std::size_t count = 0;
  spvc_resources_get_resource_list_for_type(resources, type, &list, &count);
  std::vector<std::uint32_t> bindings;
  for (std::size_t i = 0; i < count; ++i) {
    if (spvc_compiler_get_decoration(compiler, list[i].id, SpvDecorationDescriptorSet) != 0)
      fail(Failure::Work, "shader {}: '{}' is not in descriptor set 0", name, list[i].name);
    bindings.push_back(spvc_compiler_get_decoration(compiler, list[i].id, SpvDecorationBinding));
  }
  std::sort(bindings.begin(), bindings.end());
  return bindings;
}

/// Returns the bytes of an element of each storage buffer that is one array.
std::map<std::uint32_t, std::uint32_t> element_bytes_of(spvc_compiler compiler, spvc_resources resources) {
  const spvc_reflected_resource* list = nullptr;
  std::size_t count = 0;
  spvc_resources_get_resource_list_for_type(resources, SPVC_RESOURCE_TYPE_STORAGE_BUFFER, &list, &count);
  std::map<std::uint32_t, std::uint32_t> bytes;
  for (std::size_t i = 0; i < count; ++i) {
    const spvc_type type = spvc_compiler_get_type_handle(compiler, list[i].base_type_id);
    unsigned stride = 0;
    if (spvc_type_get_num_member_types(type) == 1 &&
        spvc_compiler_type_struct_member_array_stride(compiler, type, 0, &stride) == SPVC_SUCCESS)
      bytes[spvc_compiler_get_decoration(compiler, list[i].id, SpvDecorationBinding)] = stride;
  }
  return bytes;
}

std::uint32_t push_bytes_of(spvc_compiler compiler, spvc_resources resources) {
  const spvc_reflected_resource* list = nullptr;
  std::size_t count = 0, size = 0;
  spvc_resources_get_resource_list_for_type(resources, SPVC_RESOURCE_TYPE_PUSH_CONSTANT, &list, &count);
  if (count == 0) return 0;
  spvc_compiler_get_declared_struct_size(compiler, spvc_compiler_get_type_handle(compiler, list[0].base_type_id),
                                         &size);
  return std::uint32_t(size);
}

}  // namespace

Reflection reflect(const std::vector<std::uint32_t>& words, const std::string& name) {
  spvc_context context = nullptr;
  if (spvc_context_create(&context) != SPVC_SUCCESS)
    fail(Failure::Work, "shader {}: out of memory while reading its SPIR-V", name);
  spvc_parsed_ir ir = nullptr;
  spvc_compiler compiler = nullptr;
  spvc_resources resources = nullptr;
  const bool read = spvc_context_parse_spirv(context, words.data(), words.size(), &ir) == SPVC_SUCCESS &&
                    spvc_context_create_compiler(context, SPVC_BACKEND_NONE, ir, SPVC_CAPTURE_MODE_TAKE_OWNERSHIP,
                                                 &compiler) == SPVC_SUCCESS &&
                    spvc_compiler_create_shader_resources(compiler, &resources) == SPVC_SUCCESS;
  Reflection r;
  std::string problem;
  if (read) {
    try {
      r.storage_buffers = bindings_of(compiler, resources, SPVC_RESOURCE_TYPE_STORAGE_BUFFER, name);
      r.texel_buffers = bindings_of(compiler, resources, SPVC_RESOURCE_TYPE_SAMPLED_IMAGE, name);
      r.uniform_buffers = bindings_of(compiler, resources, SPVC_RESOURCE_TYPE_UNIFORM_BUFFER, name);
      r.element_bytes = element_bytes_of(compiler, resources);
      r.push_bytes = push_bytes_of(compiler, resources);
    } catch (const Error& e) {
      problem = e.what();
    }
  } else {
    problem =
        fmt::format("shader {}: its SPIR-V cannot be read: {}", name, spvc_context_get_last_error_string(context));
  }
  spvc_context_destroy(context);
  if (!problem.empty()) throw Error(Failure::Work, problem);
  return r;
}

}  // namespace ballot
