#include "engine/present/painter.h"

#include <algorithm>
#include <array>

#include "engine/present/images.h"
#include "engine/vk/shader.h"

namespace ballot {

namespace {

/// A shader of the painter's pipeline, while that is made.
struct PaintShader {
  Context& gpu;
  VkShaderModule module = VK_NULL_HANDLE;

  PaintShader(Context& context, const char* file);
  ~PaintShader() { gpu.vk().DestroyShaderModule(gpu.device(), module, nullptr); }
  PaintShader(const PaintShader&) = delete;
  PaintShader& operator=(const PaintShader&) = delete;
};

PaintShader::PaintShader(Context& context, const char* file) : gpu(context) {
  const Spirv spirv = compile_shader(file, {});
  VkShaderModuleCreateInfo create{};
  create.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
  create.codeSize = spirv.words.size() * 4;
  create.pCode = spirv.words.data();
  vk_check(gpu.vk().CreateShaderModule(gpu.device(), &create, nullptr, &module), "creating shader", file);
}

template <class T>
void room_for(std::unique_ptr<Buffer<T>>& buffer, Context& gpu, std::size_t count, const char* name) {
  if (buffer && buffer->size() >= count) return;
  buffer.reset();
  buffer = std::make_unique<Buffer<T>>(gpu, std::max<std::size_t>(4096, count * 3 / 2), Access::Storage, name);
}

}  // namespace

Painter::Painter(Context& gpu, VkRenderPass pass, std::uint32_t frames) : gpu_(gpu), frames_(frames) {
  try {
    create_layout(frames);
    create_pipeline(pass);
  } catch (...) {
    destroy();
    throw;
  }
}

Painter::~Painter() { destroy(); }

void Painter::destroy() {
  destroy_atlas();
  gpu_.vk().DestroyPipeline(gpu_.device(), pipeline_, nullptr);
  gpu_.vk().DestroyDescriptorPool(gpu_.device(), pool_, nullptr);
  gpu_.vk().DestroyPipelineLayout(gpu_.device(), layout_, nullptr);
  gpu_.vk().DestroyDescriptorSetLayout(gpu_.device(), set_layout_, nullptr);
  gpu_.vk().DestroySampler(gpu_.device(), sampler_, nullptr);
}

void Painter::destroy_atlas() {
  gpu_.vk().DestroyImageView(gpu_.device(), atlas_view_, nullptr);
  gpu_.vk().DestroyImage(gpu_.device(), atlas_, nullptr);
  gpu_.vk().FreeMemory(gpu_.device(), atlas_memory_, nullptr);
  atlas_view_ = VK_NULL_HANDLE;
  atlas_ = VK_NULL_HANDLE;
  atlas_memory_ = VK_NULL_HANDLE;
}

void Painter::create_layout(std::uint32_t frames) {
  VkSamplerCreateInfo sampler{};
  sampler.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO;
  sampler.magFilter = sampler.minFilter = VK_FILTER_LINEAR;
  sampler.addressModeU = sampler.addressModeV = sampler.addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
  vk_check(gpu_.vk().CreateSampler(gpu_.device(), &sampler, nullptr, &sampler_), "creating the painter's sampler");
  const std::array<VkDescriptorSetLayoutBinding, 3> bindings{{
      {BIND_VERTICES, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_VERTEX_BIT, nullptr},
      {BIND_INDICES, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_VERTEX_BIT, nullptr},
      {BIND_ATLAS, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1, VK_SHADER_STAGE_FRAGMENT_BIT, &sampler_},
  }};
  VkDescriptorSetLayoutCreateInfo set{};
  set.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
  set.bindingCount = std::uint32_t(bindings.size());
  set.pBindings = bindings.data();
  vk_check(gpu_.vk().CreateDescriptorSetLayout(gpu_.device(), &set, nullptr, &set_layout_),
           "creating the painter's set layout");
  const VkPushConstantRange range{VK_SHADER_STAGE_VERTEX_BIT, 0, sizeof(PaintPush)};
  VkPipelineLayoutCreateInfo layout{};
  layout.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  layout.setLayoutCount = 1;
  layout.pSetLayouts = &set_layout_;
  layout.pushConstantRangeCount = 1;
  layout.pPushConstantRanges = &range;
  vk_check(gpu_.vk().CreatePipelineLayout(gpu_.device(), &layout, nullptr, &layout_), "creating the painter's layout");
  const std::array<VkDescriptorPoolSize, 2> sizes{
      {{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 2 * frames}, {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, frames}}};
  VkDescriptorPoolCreateInfo pool{};
  pool.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
  pool.maxSets = frames;
  pool.poolSizeCount = std::uint32_t(sizes.size());
  pool.pPoolSizes = sizes.data();
  vk_check(gpu_.vk().CreateDescriptorPool(gpu_.device(), &pool, nullptr, &pool_),
           "creating the painter's descriptor pool");
  for (Frame& frame : frames_) {
    VkDescriptorSetAllocateInfo allocate{};
    allocate.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
    allocate.descriptorPool = pool_;
    allocate.descriptorSetCount = 1;
    allocate.pSetLayouts = &set_layout_;
    vk_check(gpu_.vk().AllocateDescriptorSets(gpu_.device(), &allocate, &frame.set),
             "allocating the painter's descriptors");
  }
}

void Painter::create_pipeline(VkRenderPass pass) {
  const PaintShader corners(gpu_, "present/paint.vert"), pixels(gpu_, "present/paint.frag");
  std::array<VkPipelineShaderStageCreateInfo, 2> stages{};
  for (auto& stage : stages) stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO, stage.pName = "main";
  stages[0].stage = VK_SHADER_STAGE_VERTEX_BIT;
  stages[0].module = corners.module;
  stages[1].stage = VK_SHADER_STAGE_FRAGMENT_BIT;
  stages[1].module = pixels.module;
  VkPipelineVertexInputStateCreateInfo input{};
  input.sType = VK_STRUCTURE_TYPE_PIPELINE_VERTEX_INPUT_STATE_CREATE_INFO;
  VkPipelineInputAssemblyStateCreateInfo assembly{};
  assembly.sType = VK_STRUCTURE_TYPE_PIPELINE_INPUT_ASSEMBLY_STATE_CREATE_INFO;
  assembly.topology = VK_PRIMITIVE_TOPOLOGY_TRIANGLE_LIST;
  VkPipelineViewportStateCreateInfo viewport{};
  viewport.sType = VK_STRUCTURE_TYPE_PIPELINE_VIEWPORT_STATE_CREATE_INFO;
  viewport.viewportCount = viewport.scissorCount = 1;
  VkPipelineRasterizationStateCreateInfo raster{};
  raster.sType = VK_STRUCTURE_TYPE_PIPELINE_RASTERIZATION_STATE_CREATE_INFO;
  raster.cullMode = VK_CULL_MODE_NONE;
  raster.lineWidth = 1;
  VkPipelineMultisampleStateCreateInfo samples{};
  samples.sType = VK_STRUCTURE_TYPE_PIPELINE_MULTISAMPLE_STATE_CREATE_INFO;
  samples.rasterizationSamples = VK_SAMPLE_COUNT_1_BIT;
  VkPipelineColorBlendAttachmentState blend{VK_TRUE,
                                            VK_BLEND_FACTOR_SRC_ALPHA,
                                            VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA,
                                            VK_BLEND_OP_ADD,
                                            VK_BLEND_FACTOR_ONE,
                                            VK_BLEND_FACTOR_ONE_MINUS_SRC_ALPHA,
                                            VK_BLEND_OP_ADD,
                                            0xF};
  VkPipelineColorBlendStateCreateInfo blending{};
  blending.sType = VK_STRUCTURE_TYPE_PIPELINE_COLOR_BLEND_STATE_CREATE_INFO;
  blending.attachmentCount = 1;
  blending.pAttachments = &blend;
  const std::array<VkDynamicState, 2> changing{VK_DYNAMIC_STATE_VIEWPORT, VK_DYNAMIC_STATE_SCISSOR};
  VkPipelineDynamicStateCreateInfo dynamic{};
  dynamic.sType = VK_STRUCTURE_TYPE_PIPELINE_DYNAMIC_STATE_CREATE_INFO;
  dynamic.dynamicStateCount = std::uint32_t(changing.size());
  dynamic.pDynamicStates = changing.data();
  VkGraphicsPipelineCreateInfo create{};
  create.sType = VK_STRUCTURE_TYPE_GRAPHICS_PIPELINE_CREATE_INFO;
  create.stageCount = std::uint32_t(stages.size());
  create.pStages = stages.data();
  create.pVertexInputState = &input;
  create.pInputAssemblyState = &assembly;
  create.pViewportState = &viewport;
  create.pRasterizationState = &raster;
  create.pMultisampleState = &samples;
  create.pColorBlendState = &blending;
  create.pDynamicState = &dynamic;
  create.layout = layout_;
  create.renderPass = pass;
  vk_check(gpu_.vk().CreateGraphicsPipelines(gpu_.device(), gpu_.pipeline_cache(), 1, &create, nullptr, &pipeline_),
           "creating the painter's pipeline");
  gpu_.name(VK_OBJECT_TYPE_PIPELINE, std::uint64_t(pipeline_), "painter");
}

void Painter::create_atlas_image(const PaintAtlas& atlas) {
  atlas_ = create_image(gpu_, {atlas.width, atlas.height}, VK_FORMAT_R8_UNORM,
                        VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_SAMPLED_BIT, "atlas", atlas_memory_);
  atlas_view_ = create_view(gpu_, atlas_, VK_FORMAT_R8_UNORM, "atlas");
}

void Painter::set_atlas(const PaintAtlas& atlas) {
  destroy_atlas();
  create_atlas_image(atlas);
  RawBuffer bytes(gpu_, atlas.coverage.size(), Access::Storage, "atlas bytes");
  bytes.upload(0, atlas.coverage.data(), atlas.coverage.size());
  gpu_.submit("the atlas", [&](VkCommandBuffer cmd) {
    const Use none{VK_IMAGE_LAYOUT_UNDEFINED, VK_PIPELINE_STAGE_TOP_OF_PIPE_BIT, 0};
    const Use filled{VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_PIPELINE_STAGE_TRANSFER_BIT,
                     VK_ACCESS_TRANSFER_WRITE_BIT};
    const Use read{VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL, VK_PIPELINE_STAGE_FRAGMENT_SHADER_BIT,
                   VK_ACCESS_SHADER_READ_BIT};
    change_use(gpu_.vk(), cmd, atlas_, none, filled);
    const VkBufferImageCopy copy{
        0, 0, 0, {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1}, {0, 0, 0}, {atlas.width, atlas.height, 1}};
    gpu_.vk().CmdCopyBufferToImage(cmd, bytes.handle(), atlas_, filled.layout, 1, &copy);
    change_use(gpu_.vk(), cmd, atlas_, filled, read);
  });
}

void Painter::upload(std::uint32_t frame, const PaintList& list) {
  Frame& f = frames_[frame];
  room_for(f.vertices, gpu_, list.vertices.size(), "painted vertices");
  room_for(f.indices, gpu_, list.indices.size(), "painted indices");
  f.vertices->upload(list.vertices);
  f.indices->upload(list.indices);
  if (!atlas_view_) return;
  const VkDescriptorBufferInfo vertices{f.vertices->handle(), 0, VK_WHOLE_SIZE};
  const VkDescriptorBufferInfo indices{f.indices->handle(), 0, VK_WHOLE_SIZE};
  const VkDescriptorImageInfo image{VK_NULL_HANDLE, atlas_view_, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL};
  std::array<VkWriteDescriptorSet, 3> writes{};
  for (std::uint32_t i = 0; i < 3; ++i) {
    writes[i].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    writes[i].dstSet = f.set;
    writes[i].dstBinding = i;
    writes[i].descriptorCount = 1;
    writes[i].descriptorType =
        i == BIND_ATLAS ? VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
  }
  writes[BIND_VERTICES].pBufferInfo = &vertices;
  writes[BIND_INDICES].pBufferInfo = &indices;
  writes[BIND_ATLAS].pImageInfo = &image;
  gpu_.vk().UpdateDescriptorSets(gpu_.device(), std::uint32_t(writes.size()), writes.data(), 0, nullptr);
}

void Painter::record(VkCommandBuffer cmd, std::uint32_t frame, const PaintList& list, VkExtent2D area) {
  if (!atlas_view_ || list.commands.empty()) return;
  gpu_.vk().CmdBindPipeline(cmd, VK_PIPELINE_BIND_POINT_GRAPHICS, pipeline_);
  gpu_.vk().CmdBindDescriptorSets(cmd, VK_PIPELINE_BIND_POINT_GRAPHICS, layout_, 0, 1, &frames_[frame].set, 0, nullptr);
  const VkViewport viewport{0, 0, float(area.width), float(area.height), 0, 1};
  gpu_.vk().CmdSetViewport(cmd, 0, 1, &viewport);
  for (const PaintCommand& c : list.commands) {
    const std::int32_t left = std::max(0, c.x), top = std::max(0, c.y);
    const std::int32_t right = std::min(std::int32_t(area.width), c.x + std::int32_t(c.width));
    const std::int32_t bottom = std::min(std::int32_t(area.height), c.y + std::int32_t(c.height));
    if (right <= left || bottom <= top) continue;
    const VkRect2D clip{{left, top}, {std::uint32_t(right - left), std::uint32_t(bottom - top)}};
    gpu_.vk().CmdSetScissor(cmd, 0, 1, &clip);
    const PaintPush push{2 / float(area.width), 2 / float(area.height), c.first_vertex};
    gpu_.vk().CmdPushConstants(cmd, layout_, VK_SHADER_STAGE_VERTEX_BIT, 0, sizeof push, &push);
    gpu_.vk().CmdDraw(cmd, c.index_count, 1, c.first_index, 0);
  }
}

}  // namespace ballot
