// Sentences that answer the paper's open questions from the records.
#include <algorithm>
#include <cmath>

#include "tools/bench/markdown.h"
#include "tools/bench/regret.h"
#include "tools/bench/report.h"
#include "tools/bench/votes.h"

namespace ballot::bench {

namespace {

constexpr double kEqual = 0.01;  // speeds within 1 % are called equal

/// The ratios of two entries' speeds over scenes and ray kinds, with the block of each.
struct Speeds {
  std::vector<double> ratios;
  std::vector<const Block*> blocks;

  void add(double ratio, const Block& block) {
    ratios.push_back(ratio);
    blocks.push_back(&block);
  }
  double mean() const { return geometric_mean(ratios); }
  std::size_t least() const { return std::size_t(std::ranges::min_element(ratios) - ratios.begin()); }
  std::size_t most() const { return std::size_t(std::ranges::max_element(ratios) - ratios.begin()); }
};

std::string place(const Block& block) { return block.scene + ", " + block.rays; }

std::string one_or_range(const Speeds& s) {
  if (s.ratios.size() == 1) return fmt::format("{} ({})", percent(s.mean()), place(*s.blocks[0]));
  return fmt::format("{} in the geometric mean of {} cases, from {} ({}) to {} ({})", percent(s.mean()),
                     s.ratios.size(), percent(s.ratios[s.least()]), place(*s.blocks[s.least()]),
                     percent(s.ratios[s.most()]), place(*s.blocks[s.most()]));
}

/// Returns the words for a ratio of speeds, such as "faster than".
const char* verdict(double ratio) {
  return ratio > 1 + kEqual ? "faster than" : ratio < 1 - kEqual ? "slower than" : "as fast (within 1 %) as";
}

Speeds against(const Setting& setting, const std::string& label, const std::string& base,
               const std::string& rays = "") {
  Speeds speeds;
  for (const Block& block : setting.blocks) {
    if (!rays.empty() && block.rays != rays) continue;
    const Cell *a = block.find(label), *b = block.find(base);
    if (!a || !b) continue;
    if (const auto ratio = time_ratio(*b, *a)) speeds.add(*ratio, block);
  }
  return speeds;
}

std::string packet_against_if_if(const Setting& setting) {
  const Speeds s = against(setting, "packet(any)", "if-if", "primary");
  if (s.ratios.empty()) return "";
  const auto wins = std::ranges::count_if(s.ratios, [](double r) { return r > 1; });
  return fmt::format(
      "- Is packet faster than if-if for primary rays, as the paper found? Here packet(any) is {} if-if: {}; it wins "
      "{} of {} scenes.\n",
      verdict(s.mean()), one_or_range(s), wins, s.ratios.size());
}

std::string votes(const Setting& setting, bool brief) {
  const std::vector<VotePair> pairs = vote_pairs(setting);
  std::string text;
  std::vector<std::string> methods;
  for (const VotePair& pair : pairs)
    if (pair.role == Role::Method && std::ranges::find(methods, pair.method) == methods.end() &&
        (!brief || pair.method == "packet" || pair.method == "cut"))
      methods.push_back(pair.method);
  for (const std::string& method : methods) {
    std::string sentence;
    for (const auto& [vote, base] : {std::pair("count", "any"), std::pair("sum", "any"), std::pair("sum", "count")}) {
      Speeds s;
      for (const VotePair& pair : pairs)
        if (pair.method == method && pair.vote == vote && pair.base == base) s.add(pair.speed, *pair.block);
      if (!s.ratios.empty())
        sentence += fmt::format("{} {} is {} {}: {}", sentence.empty() ? "" : ";", vote, verdict(s.mean()), base,
                                one_or_range(s));
    }
    text += fmt::format("- What do the votes of {} cost or gain?{}.\n", method, sentence);
  }
  return text;
}

/// Returns the fastest of the entries `labels` in a block; null if it has none of them.
const Cell* fastest(const Block& block, const std::vector<std::string>& labels) {
  const Cell* best = nullptr;
  for (const std::string& label : labels) {
    const Cell* cell = block.find(label);
    if (!cell) continue;
    if (!best || time_ratio(*cell, *best).value_or(1) < 1) best = cell;
  }
  return best;
}

std::string cut_against_both(const Setting& setting) {
  std::string text;
  for (const std::string label : {"cut", "cut(best)"}) {
    Speeds packet = against(setting, label, "packet(any)"), if_if = against(setting, label, "if-if");
    if (packet.ratios.empty() || if_if.ratios.empty()) continue;
    std::size_t wins = 0, all = 0;
    for (const Block& block : setting.blocks) {
      const Cell *cut = block.find(label), *other = fastest(block, {"packet(any)", "if-if"});
      if (!cut || !other || !block.find("packet(any)") || !block.find("if-if")) continue;
      ++all;
      wins += time_ratio(*other, *cut).value_or(0) > 1;
    }
    text += fmt::format(
        "- Does {}, with the instruction that the paper asked for, beat packet and if-if? It beats both in {} of {} "
        "cases; against packet(any) {}; against if-if {}.\n",
        label, wins, all, one_or_range(packet), one_or_range(if_if));
  }
  return text;
}

std::string never_far(const Setting& setting) {
  std::vector<Regret> fixed, swept;
  for (const Regret& r : regrets_of(setting))
    if (r.everywhere) (r.role == Role::Best ? swept : fixed).push_back(r);
  if (fixed.size() < 2) return "";
  const auto by_max = std::ranges::min_element(fixed, {}, &Regret::max);
  const auto by_median = std::ranges::min_element(fixed, {}, &Regret::median);
  std::string text = fmt::format(
      "- Which method is never far from the best? {}: at most {:.2f} times the best one's time ({}), in the median "
      "{:.2f}, over {} scenes x ray kinds.",
      by_max->label, by_max->max, place(*by_max->worst), by_max->median, by_max->over_best.size());
  if (by_median->label != by_max->label)
    text += fmt::format(" The smallest median is that of {}: {:.2f}, at most {:.2f} ({}).", by_median->label,
                        by_median->median, by_median->max, place(*by_median->worst));
  const auto best = std::ranges::min_element(swept, {}, &Regret::max);
  if (best != swept.end())
    text +=
        fmt::format(" With a threshold chosen for each scene and ray kind: {}, at most {:.2f}, in the median {:.2f}.",
                    best->label, best->max, best->median);
  return text + "\n";
}

}  // namespace

std::string answer_section(const Setting& setting, bool brief) {
  const std::string answers =
      packet_against_if_if(setting) + votes(setting, brief) + cut_against_both(setting) + never_far(setting);
  if (answers.empty()) return "";
  return "## Answers: " + setting.name + "\n\nSpeeds are of the traversal alone.\n\n" + answers + "\n";
}

}  // namespace ballot::bench
