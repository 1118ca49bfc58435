// Tests of the overlay's widgets, which are clicked without a window.
#include <gtest/gtest.h>
#include <imgui/imgui.h>

#include <set>
#include <sstream>

#include "tools/view/panels.h"

namespace ballot::view {
namespace {

constexpr float kWidth = 320, kHeight = 900, kWidgets = 540;  // kWidgets: the last widget ends here or above

/// An ImGui context with one ImGui window, which shows the widgets of a query with the knobs unfolded.
class Bench {
 public:
  explicit Bench(const DeviceInfo& device) : device_(device) {
    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.DisplaySize = {kWidth, kHeight};
    io.DeltaTime = 1.0f / 60;
    unsigned char* pixels = nullptr;
    int width = 0, height = 0;
    io.Fonts->GetTexDataAsAlpha8(&pixels, &width, &height);
  }
  ~Bench() { ImGui::DestroyContext(); }

  void click(Query& query, float x, float y) {
    ImGui::GetIO().MousePos = {x, y};
    for (const bool down : {false, true, false}) {
      ImGui::GetIO().MouseDown[0] = down;
      frame(query);
    }
  }

 private:
  void frame(Query& query) {
    ImGui::NewFrame();
    ImGui::SetNextWindowPos({0, 0});
    ImGui::SetNextWindowSize({kWidth, kHeight});
    ImGui::Begin("bench", nullptr, ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove);
    ImGui::PushID("a");
    ImGui::GetStateStorage()->SetInt(ImGui::GetID("knobs"), 1);
    ImGui::PopID();
    ImGui::PushItemWidth(-100);
    draw_query("a", query, device_);
    ImGui::PopItemWidth();
    ImGui::End();
    ImGui::Render();
  }

  const DeviceInfo& device_;
};

/// Returns the knobs that matter to the query's method, with their values.
std::map<std::string, std::string> values_of(const Query& query, const DeviceInfo& device) {
  const Method& method = find_method(query.method);
  const KernelConfig f = kernel_config_for(method, find_numeric(query.numeric), device, query.knobs);
  std::istringstream words(describe(f, method) + " " + describe_threshold(f, method));
  std::map<std::string, std::string> values;
  for (std::string word; words >> word;) values[word.substr(0, word.find('='))] = word.substr(word.find('=') + 1);
  return values;
}

/// Clicks at points all over the part of the window that holds the widgets. Also clicks at pairs of points in a column,
/// the second at or below the first. This opens lists and chooses from them. Each time it starts from the same query,
/// and calls `after` with the query that the clicks left; if that returns true, nothing is left to find.
template <class After>
void click_everywhere(Bench& bench, const Query& start, float left, After after) {
  constexpr float kStep = 12, kLongestList = 260;
  const auto click = [&](std::initializer_list<std::pair<float, float>> places) {
    Query query = start;
    for (const auto& [x, y] : places) bench.click(query, x, y);
    bench.click(query, kWidth - 2, kHeight - 2);  // closes a list that is open
    return after(query);
  };
  for (float y = 4; y < kWidgets; y += kStep) {
    for (float x = 4; x < kWidth; x += kStep)
      if (click({{x, y}})) return;
    for (float other = y; other < std::min(kHeight, y + kLongestList); other += kStep)
      if (click({{left, y}, {left, other}})) return;
  }
}

const DeviceInfo& some_device() {
  static const auto devices = list_devices();
  if (devices.empty()) fail(Failure::Device, "there is no Vulkan device");
  return devices.front();
}

TEST(Panels, EveryKnobOfEveryMethodCanBeChanged) {
  for (const Method& method : kMethods) {
    Bench bench(some_device());
    const Query start{.method = std::string(method.name)};
    const auto before = values_of(start, some_device());
    std::set<std::string> left;
    for (const auto& [knob, value] : before) left.insert(knob);
    click_everywhere(bench, start, 60, [&](const Query& query) {
      const bool same = query.method == start.method;
      if (same)
        for (const auto& [knob, value] : values_of(query, some_device()))  // throws if a value is not offered
          if (before.contains(knob) && before.at(knob) != value) left.erase(knob);
      return left.empty();
    });
    EXPECT_TRUE(left.empty()) << method.name << ": " << *left.begin();
  }
}

TEST(Panels, EveryMethodAndModeCanBeChosen) {
  std::set<std::string> left;
  for (const Method& m : kMethods) left.emplace(m.name);
  for (const NumericMode& m : kNumericModes) left.emplace(m.name);
  Bench bench(some_device());
  for (const float column : {60.0f, 220.0f})
    click_everywhere(bench, {}, column, [&](const Query& query) {
      left.erase(query.method);
      left.erase(query.numeric);
      return left.empty();
    });
  EXPECT_TRUE(left.empty()) << *left.begin();
}

}  // namespace
}  // namespace ballot::view
