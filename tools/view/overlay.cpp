#include "tools/view/overlay.h"

#include <imgui/backends/imgui_impl_vulkan.h>
#include <imgui/imgui.h>

#include <algorithm>
#include <filesystem>

namespace ballot::view {

namespace {

Context* context = nullptr;  // of the Overlay that exists

// The fonts to try: the first one that is installed is used; if there is none, ImGui's own bitmap font.
constexpr const char* kFonts[] = {"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
                                  "/usr/share/fonts/truetype/liberation/LiberationSans-Regular.ttf",
                                  "/usr/share/fonts/truetype/noto/NotoSans-Regular.ttf"};

void load_font(ImGuiIO& io, float scale) {
  std::error_code error;
  for (const char* file : kFonts)
    if (std::filesystem::exists(file, error) && io.Fonts->AddFontFromFileTTF(file, 14 * scale)) return;
  ImFontConfig config;
  config.SizePixels = 13 * std::max(1.0f, std::round(scale));
  io.Fonts->AddFontDefault(&config);
}

void set_style(float scale) {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 6;
  style.FrameRounding = style.GrabRounding = 3;
  style.WindowBorderSize = 0;
  style.WindowPadding = {12, 10};
  style.ItemSpacing = {8, 5};
  style.FramePadding = {6, 3};
  style.Colors[ImGuiCol_WindowBg] = {0.07f, 0.08f, 0.10f, 0.94f};
  style.Colors[ImGuiCol_FrameBg] = {0.17f, 0.19f, 0.23f, 1};
  style.Colors[ImGuiCol_FrameBgHovered] = {0.22f, 0.25f, 0.31f, 1};
  style.Colors[ImGuiCol_Header] = {0.17f, 0.30f, 0.45f, 1};
  style.Colors[ImGuiCol_Separator] = {0.25f, 0.28f, 0.33f, 1};
  style.Colors[ImGuiCol_Text] = {0.90f, 0.92f, 0.94f, 1};
  style.Colors[ImGuiCol_TextDisabled] = {0.56f, 0.60f, 0.66f, 1};
  style.ScaleAllSizes(scale);
}

void set_keys(ImGuiIO& io) {
  constexpr std::pair<int, int> kKeys[] = {
      {ImGuiKey_Tab, GLFW_KEY_TAB},     {ImGuiKey_LeftArrow, GLFW_KEY_LEFT}, {ImGuiKey_RightArrow, GLFW_KEY_RIGHT},
      {ImGuiKey_UpArrow, GLFW_KEY_UP},  {ImGuiKey_DownArrow, GLFW_KEY_DOWN}, {ImGuiKey_Home, GLFW_KEY_HOME},
      {ImGuiKey_End, GLFW_KEY_END},     {ImGuiKey_Delete, GLFW_KEY_DELETE},  {ImGuiKey_Backspace, GLFW_KEY_BACKSPACE},
      {ImGuiKey_Enter, GLFW_KEY_ENTER}, {ImGuiKey_Escape, GLFW_KEY_ESCAPE},
  };
  for (const auto& [theirs, ours] : kKeys) io.KeyMap[theirs] = ours;
}

}  // namespace

Overlay::Overlay(Context& gpu, VkRenderPass pass, double content_scale, double pixels) : gpu_(gpu) {
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  context = &gpu;
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;  // panels have fixed positions, so no layout is saved
  io.ConfigFlags |= ImGuiConfigFlags_NoMouseCursorChange;
  set_keys(io);
  load_font(io, float(content_scale));  // rasterized at the size at which they are shown
  io.FontGlobalScale = float(1 / pixels);
  set_style(float(content_scale / pixels));
  try {
    start_back_end(pass);
  } catch (...) {
    destroy();
    throw;
  }
}

Overlay::~Overlay() { destroy(); }

void Overlay::start_back_end(VkRenderPass pass) {
  const VkDescriptorPoolSize size{VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, 1};
  VkDescriptorPoolCreateInfo pool{};
  pool.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
  pool.flags = VK_DESCRIPTOR_POOL_CREATE_FREE_DESCRIPTOR_SET_BIT;
  pool.maxSets = pool.poolSizeCount = 1;
  pool.pPoolSizes = &size;
  vk_check(gpu_.vk().CreateDescriptorPool(gpu_.device(), &pool, nullptr, &pool_), "creating a pool of descriptors");
  ImGui_ImplVulkan_InitInfo info{};
  info.Instance = gpu_.instance();
  info.PhysicalDevice = gpu_.physical();
  info.Device = gpu_.device();
  info.QueueFamily = gpu_.queue_family();
  info.Queue = gpu_.queue();
  info.PipelineCache = gpu_.pipeline_cache();
  info.DescriptorPool = pool_;
  info.MinImageCount = info.ImageCount = 2;
  info.CheckVkResultFn = [](VkResult result) { context->check(result, "painting the panels"); };
  ImGui_ImplVulkan_Init(&info, pass);
  // The back end cannot be shut down once it has failed to enlarge its buffers. So both get room from the start.
  ImDrawData room;
  room.DisplaySize = room.FramebufferScale = {1, 1};
  room.TotalVtxCount = 1 << 16;
  room.TotalIdxCount = 1 << 17;
  const PassScope scope(gpu_);
  gpu_.submit("the panels", [&](Commands& commands) {
    VkCommandBuffer cmd = commands.handle();
    for (std::uint32_t i = 0; i < info.ImageCount; ++i) ImGui_ImplVulkan_RenderDrawData(&room, cmd);
#if IMGUI_VERSION_NUM < 19000  // newer ones upload the glyphs in their first frame
    ImGui_ImplVulkan_CreateFontsTexture(cmd);
#endif
  });
#if IMGUI_VERSION_NUM < 19000
  ImGui_ImplVulkan_DestroyFontUploadObjects();
#endif
}

void Overlay::destroy() {
  if (ImGui::GetIO().BackendRendererUserData) ImGui_ImplVulkan_Shutdown();
  gpu_.vk().DestroyDescriptorPool(gpu_.device(), pool_, nullptr);
  ImGui::DestroyContext();
}

void Overlay::begin(const Window& window, const Input& input, double dt) {
  ImGuiIO& io = ImGui::GetIO();
  const glm::dvec2 size = window.size();
  const glm::uvec2 pixels = window.pixels();
  io.DisplaySize = {float(size.x), float(size.y)};
  if (size.x > 0 && size.y > 0) io.DisplayFramebufferScale = {float(pixels.x / size.x), float(pixels.y / size.y)};
  io.DeltaTime = float(std::max(dt, 1e-4));
  io.MousePos = input.mouse.x > -1e8 ? ImVec2(float(input.mouse.x), float(input.mouse.y)) : ImVec2(-1e9f, -1e9f);
  // A click that went down and up between two frames still counts.
  for (int b = 0; b < 3; ++b) io.MouseDown[b] = input.buttons[b] || input.clicked[b];
  io.MouseWheel = float(input.scrolled);
  for (int key = 0; key < int(std::size(io.KeysDown)); ++key)
    io.KeysDown[key] = key <= GLFW_KEY_LAST && input.down[key];
  io.KeyCtrl = input.down[GLFW_KEY_LEFT_CONTROL] || input.down[GLFW_KEY_RIGHT_CONTROL];
  io.KeyShift = input.down[GLFW_KEY_LEFT_SHIFT] || input.down[GLFW_KEY_RIGHT_SHIFT];
  for (const unsigned code : input.typed) io.AddInputCharacter(code);
  ImGui_ImplVulkan_NewFrame();
  ImGui::NewFrame();
}

void Overlay::end() { ImGui::Render(); }

void Overlay::paint(VkCommandBuffer cmd) const { ImGui_ImplVulkan_RenderDrawData(ImGui::GetDrawData(), cmd); }

bool Overlay::takes_mouse() const { return ImGui::GetIO().WantCaptureMouse; }
bool Overlay::takes_keys() const { return ImGui::GetIO().WantTextInput; }

PFN_vkVoidFunction vulkan_function(const char* name) {
  return vulkan_loader().GetInstanceProcAddr(context->instance(), name);
}

}  // namespace ballot::view
