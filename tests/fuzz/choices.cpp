// The JSON file that keeps method auto's choices.
#include "engine/trace/auto/auto.h"
#include "tests/fuzz/fuzz.h"

namespace ballot::fuzz {

namespace {

namespace fs = std::filesystem;

/// A CPU device whose subgroups have 8 lanes.
const DeviceInfo& device() {
  static const DeviceInfo info = [] {
    DeviceInfo made;
    made.name = made.driver = "fuzz";
    made.type = VK_PHYSICAL_DEVICE_TYPE_CPU;
    made.subgroup_size = made.min_subgroup_size = made.max_subgroup_size = 8;
    made.max_group_invocations = made.max_group_size_x = 1024;
    made.max_group_count_x = 65535;
    made.max_group_subgroups = 128;
    made.max_storage_range = made.max_texels = made.max_allocation = 1 << 30;
    made.shared_bytes = 32768;
    made.float64 = made.shuffle = made.arithmetic = true;
    return made;
  }();
  return info;
}

Choices empty_choices() { return {device(), {.triangles = 12, .nodes = 3}, {glm::vec3(0), glm::vec3(1)}}; }

/// Makes the file that read_choices() replaces. Returns its path.
fs::path store_choice() {
  const fs::path kept = folder() / "choices";
  Choices choices = empty_choices();
  choices.keep_in(kept);
  Choice choice;
  choice.rays = "primary";
  choice.numeric = kDefaultNumeric;
  choice.candidates = candidates_for({}, device());
  choice.sampled = 1000;
  choices.add(choice);
  return fs::directory_iterator(kept)->path();
}

const fs::path& choices_file() {
  static const fs::path path = store_choice();
  return path;
}

std::vector<std::string> choices_seeds() { return {bytes_in(choices_file())}; }

std::vector<std::string> choices_words() {
  return {"\"choices\"", "\"candidates\"", "\"knobs\"",   "\"method\"",  "\"mrays_per_s\"", "\"tried\"",
          "\"rays\"",    "\"any\"",        "\"numeric\"", "\"sampled\"", "packet",          "bvh4",
          "frontier",    "exact",          "fast",        "vote",        "count",           "workgroup",
          "fallback",    "null",           "-1",          "1e999"};
}

void read_choices(std::string_view input) {
  put("choices/" + choices_file().filename().string(), input);
  expect_plain([&] {
    Choices choices = empty_choices();
    choices.keep_in(folder() / "choices");
    for (const Choice& choice : choices.all())
      kernel_config_for(find_method(choice.chosen().method), find_numeric(choice.numeric), device(),
                        choice.chosen().knobs);
  });
}

}  // namespace

Target choices_target() { return {"choices", Form::Json, choices_seeds(), choices_words(), read_choices}; }

}  // namespace ballot::fuzz
