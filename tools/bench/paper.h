// The paper's published figures: M. Vinkler, "Traversal methods for GPU ray tracing", Tables 1 and 2. They were
// measured on an NVIDIA GTX 280 at 1024 x 1024, as means of five viewpoints, for frames with ray generation and
// shading.
#pragma once

#include <array>
#include <string_view>

namespace ballot::bench {

struct PaperScene {
  std::string_view name;                     // as the paper prints it
  std::string_view triangles, split, nodes;  // Table 1, as rounded there
  std::array<std::string_view, 3> files;     // stems of the scene files that stand for it; "" if there are fewer
};
inline constexpr std::array<PaperScene, 4> kPaperScenes{{
    {"Conference", "283k", "424k", "190k", {"conference"}},
    {"Fairy", "174k", "261k", "117k", {"fairyforest-standin", "fairyforest", "fairy"}},
    {"Sibenik", "80k", "121k", "56k", {"sibenik"}},
    {"Sponza", "76k", "114k", "52k", {"sponza"}},
}};

/// The stand-in for the paper's Fairy scene, which was not available; it is made to resemble it.
inline constexpr std::string_view kStandIn = "fairyforest-standin";

/// The note below Table 2. The paper's cut counts votes in shared memory, as ours does with vote `sum`.
inline constexpr std::string_view kCutNote =
    "The paper's cut votes by a reduction in shared memory: its row shows cut(sum). A row further down shows "
    "cut(count), which votes with the instruction that the paper asked for. If cut(sum) was not measured, cut(count) "
    "takes its place; if votes by `any` were not measured, votes by `count` do. \"above\" marks a figure that was "
    "shown "
    "in a row above in this way.";

/// The constant thresholds of Table 2, which the paper's text chooses for primary and for secondary rays.
struct PaperThreshold {
  std::string_view method;
  double value;
};
inline constexpr std::array<PaperThreshold, 2> kPaperThresholds{{{"stack-max", 11}, {"stack-max", 7}}};

struct PaperRow {
  std::string_view method;                    // the paper's name
  std::string_view label;                     // our label
  std::string_view stand_in;                  // the label that takes its place if it was not measured; "": none
  std::array<std::string_view, 4> fps, gain;  // by scene, in the order of kPaperScenes; gain over packet
};
struct PaperHalf {
  std::string_view title, rays;  // rays: the ray kind of this half
  std::array<PaperRow, 6> rows;  // the last one has no figures: the paper had no sweep for cut
};
inline constexpr std::array<PaperHalf, 2> kPaperTable2{{
    {"Primary rays",
     "primary",
     {{{"packet", "packet(any)", "", {"68.12", "60.44", "49.48", "47.46"}, {"0%", "0%", "0%", "0%"}},
       {"if-if", "if-if", "", {"54.80", "54.54", "49.48", "47.80"}, {"-19.55%", "-9.76%", "0%", "+0.72%"}},
       {"stack-max(11)",
        "stack-max(11)",
        "stack-max(11,count)",
        {"67.44", "60.64", "49.93", "47.40"},
        {"-1.00%", "+0.33%", "+0.91%", "-0.13%"}},
       {"stack-max(best)",
        "stack-max(best)",
        "stack-max(best,count)",
        {"67.92", "61.20", "49.94", "47.56"},
        {"-0.29%", "+1.26%", "+0.93%", "+0.21%"}},
       {"cut", "cut(sum)", "cut", {"61.98", "53.04", "44.96", "42.28"}, {"-9.01%", "-12.24%", "-9.14%", "-10.91%"}},
       {"cut(best, count)", "cut(best)", "", {}, {}}}}},
    {"Secondary rays",
     "secondary",
     {{{"packet", "packet(any)", "", {"21.22", "18.84", "14.94", "15.26"}, {"0%", "0%", "0%", "0%"}},
       {"if-if", "if-if", "", {"21.80", "19.50", "16.80", "19.18"}, {"+2.73%", "+3.50%", "+12.45%", "+25.69%"}},
       {"stack-max(7)",
        "stack-max(7)",
        "stack-max(7,count)",
        {"21.72", "19.98", "15.40", "16.26"},
        {"+2.36%", "+6.05%", "+3.08%", "+6.55%"}},
       {"stack-max(best)",
        "stack-max(best)",
        "stack-max(best,count)",
        {"21.78", "20.04", "15.80", "17.32"},
        {"+2.64%", "+6.37%", "+5.76%", "+13.50%"}},
       {"cut", "cut(sum)", "cut", {"21.66", "18.30", "13.82", "15.00"}, {"+2.07%", "-2.87%", "-7.50%", "-1.70%"}},
       {"cut(best, count)", "cut(best)", "", {}, {}}}}},
}};

}  // namespace ballot::bench
