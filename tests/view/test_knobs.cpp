// Tests of the values that the panel of knobs offers.
#include <gtest/gtest.h>

#include <algorithm>

#include "tools/view/panels.h"

namespace ballot::view {
namespace {

TEST(Knobs, EveryKnobOfEveryMethodCanBeChanged) {
  const auto devices = list_devices();
  ASSERT_FALSE(devices.empty());
  std::size_t changed = 0;
  for (const Method& method : kMethods)
    for (const KnobInfo& knob : knobs()) {
      SCOPED_TRACE(fmt::format("{} of {}", knob.name, method.name));
      Query query{.method = std::string(method.name)};
      const std::string now = knob_value(knob.name, query, devices[0]);
      if (now.empty() || (knob.name == "subgroup" && devices[0].min_subgroup_size == devices[0].max_subgroup_size))
        continue;
      const auto choices = knob_choices(knob, query, devices[0]);
      EXPECT_GT(choices.size(), std::size_t(std::ranges::count(choices, now))) << "no other value than " << now;
      for (const std::string& value : choices) {
        query.knobs = {{knob.name, value}};
        EXPECT_EQ(knob_value(knob.name, query, devices[0]), value);
      }
      ++changed;
    }
  EXPECT_GT(changed, std::size(kMethods) * 5);
}

}  // namespace
}  // namespace ballot::view
