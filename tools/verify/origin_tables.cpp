// The tables and the JSON of the study of origins.
#include <algorithm>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "tools/bench/markdown.h"
#include "tools/verify/origins.h"

namespace ballot::verify {

namespace {

using bench::Table;

/// The sums over the records of a policy, or over those of a policy at one size and distance.
struct OriginSum {
  std::uint64_t rays = 0, self_hits = 0, lost = 0;
  double worst_self = 0, worst_lost = 0;                              // highest rates of one record, per million rays
  double share_low = 0, share_high = 0, ulps_low = 0, ulps_high = 0;  // range of the records' medians

  void add(const OriginRecord& r) {
    const bool first = rays == 0;
    rays += r.rays, self_hits += r.self_hits, lost += r.lost_contacts;
    if (r.rays > 0) {
      worst_self = std::max(worst_self, 1e6 * double(r.self_hits) / double(r.rays));
      worst_lost = std::max(worst_lost, 1e6 * double(r.lost_contacts) / double(r.rays));
    }
    share_low = first ? r.offset_share : std::min(share_low, r.offset_share);
    ulps_low = first ? r.offset_ulps : std::min(ulps_low, r.offset_ulps);
    share_high = std::max(share_high, r.offset_share);
    ulps_high = std::max(ulps_high, r.offset_ulps);
  }
  double per_million(std::uint64_t count) const { return rays ? 1e6 * double(count) / double(rays) : 0; }
};

std::string rate(double per_million) {
  return per_million == 0    ? "0"
         : per_million < 100 ? fmt::format("{:.2g}", per_million)
                             : fmt::format("{:.0f}", per_million);
}

std::string range(double low, double high) { return fmt::format("{:.1e} to {:.1e}", low, high); }

std::vector<std::string> policies_of(const OriginStudy& study) {
  std::vector<std::string> names;
  for (const OriginRecord& r : study.records)
    if (std::ranges::find(names, r.policy) == names.end()) names.push_back(r.policy);
  return names;
}

std::string summary(const OriginStudy& study) {
  std::map<std::string, OriginSum> sums;
  for (const OriginRecord& r : study.records) sums[r.policy].add(r);
  Table table({"policy", "rays", "self hits per million", "highest self-hit rate", "lost contacts per million",
               "highest lost-contact rate", "offset / size, medians", "offset in ulp, medians"});
  for (const std::string& name : policies_of(study)) {
    const OriginSum& s = sums.at(name);
    table.row({name, std::to_string(s.rays), rate(s.per_million(s.self_hits)), rate(s.worst_self),
               rate(s.per_million(s.lost)), rate(s.worst_lost), range(s.share_low, s.share_high),
               range(s.ulps_low, s.ulps_high)});
  }
  return "## By policy\n\nThe highest rates are those of one scene at one size and distance, per million rays. The\n"
         "last two columns give the range of the median offsets.\n\n" +
         table.text();
}

using Key = std::pair<double, double>;

std::string by_place(const OriginStudy& study, const std::string& title,
                     const std::function<std::string(const OriginSum&)>& cell) {
  const std::vector<std::string> names = policies_of(study);
  std::map<Key, std::map<std::string, OriginSum>> sums;
  for (const OriginRecord& r : study.records) sums[{r.size, r.distance}][r.policy].add(r);
  std::vector<std::string> header{"size", "distance / size"};
  header.insert(header.end(), names.begin(), names.end());
  Table table(header);
  for (auto& [key, policies] : sums) {
    std::vector<std::string> row{fmt::format("{:g}", key.first), fmt::format("{:g}", key.second)};
    for (const std::string& name : names) row.push_back(cell(policies[name]));
    table.row(row);
  }
  return "## " + title + "\n\n" + table.text();
}

}  // namespace

std::string origin_tables(const OriginStudy& study) {
  return summary(study) +
         by_place(study, "Self hits per million rays",
                  [](const OriginSum& s) { return rate(s.per_million(s.self_hits)); }) +
         by_place(study, "Lost contacts per million rays",
                  [](const OriginSum& s) { return rate(s.per_million(s.lost)); }) +
         by_place(study, "Offset / size, largest median of a scene",
                  [](const OriginSum& s) { return fmt::format("{:.1e}", s.share_high); }) +
         by_place(study, "Offset in ulp of the largest coordinate, largest median of a scene",
                  [](const OriginSum& s) { return fmt::format("{:.3g}", s.ulps_high); });
}

nlohmann::json to_json(const OriginStudy& study) {
  nlohmann::json json{{"device", study.device},
                      {"driver", study.driver},
                      {"subgroup_size", study.subgroup_size},
                      {"commit", study.commit},
                      {"command", study.command},
                      {"size", {study.width, study.height}},
                      {"records", nlohmann::json::array()}};
  for (const OriginRecord& r : study.records)
    json["records"].push_back({{"policy", r.policy},
                               {"scene", r.scene},
                               {"scene_size", r.size},
                               {"distance", r.distance},
                               {"rays", r.rays},
                               {"self_hits", r.self_hits},
                               {"lost_contacts", r.lost_contacts},
                               {"offset_share", r.offset_share},
                               {"offset_ulps", r.offset_ulps}});
  return json;
}

}  // namespace ballot::verify
