#include "tools/bench/accuracy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace ballot::bench {

namespace {

struct Count {
  const char* name;
  std::uint64_t Accuracy::*member;
};
constexpr Count kCounts[] = {
    {"false_misses", &Accuracy::false_misses}, {"false_hits", &Accuracy::false_hits},
    {"wrong_prims", &Accuracy::wrong_prims},   {"ties", &Accuracy::ties},
    {"wrong_values", &Accuracy::wrong_values}, {"within_bound", &Accuracy::within_bound},
    {"beyond_bound", &Accuracy::beyond_bound}, {"unwritten", &Accuracy::unwritten},
    {"self_hits", &Accuracy::self_hits},       {"beyond_range", &Accuracy::beyond_range},
};

/// Reads a number; JSON holds null for NaN and infinities, which becomes NaN.
double number_or_nan(const JsonPlace& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.number();
}

std::array<float, 8> components(const Ray& r) {
  return {r.origin.x, r.origin.y, r.origin.z, r.t_min, r.dir.x, r.dir.y, r.dir.z, r.t_max};
}

nlohmann::json case_json(const WrongAnswer& c) {
  return {{"index", c.index},
          {"kind", c.kind},
          {"within_bound", c.within_bound},
          {"reason", c.reason},
          {"ray", components(c.ray)},
          {"answer", {{"t", c.answer.t}, {"prim", c.answer.prim}, {"u", c.answer.u}, {"v", c.answer.v}}},
          {"truth", {{"t", c.t}, {"prim", c.prim}}}};
}

WrongAnswer read_case(const JsonPlace& json) {
  WrongAnswer c;
  c.index = json.at("index").count();
  c.kind = json.at("kind").text();
  c.within_bound = json.at("within_bound").truth();
  c.reason = json.at("reason").text();
  const auto ray = json.at("ray").items();
  if (ray.size() != 8) json.at("ray").wrong("8 numbers");
  const auto value = [&](std::size_t i) { return float(number_or_nan(ray[i])); };
  c.ray = {{value(0), value(1), value(2)}, value(3), {value(4), value(5), value(6)}, value(7)};
  const JsonPlace answer = json.at("answer"), truth = json.at("truth");
  c.answer = {float(number_or_nan(answer.at("t"))), answer.at("prim").small_count(),
              float(number_or_nan(answer.at("u"))), float(number_or_nan(answer.at("v")))};
  c.t = number_or_nan(truth.at("t"));
  c.prim = truth.at("prim").small_count();
  return c;
}

}  // namespace

void Accuracy::add(const Accuracy& other) {
  if (other.image_rmse) {
    const double own = image_rmse.value_or(0), own_rays = image_rmse ? double(rays) : 0, others = double(other.rays);
    const double squares = own * own * own_rays + *other.image_rmse * *other.image_rmse * others;
    image_rmse = std::sqrt(squares / std::max(own_rays + others, 1.0));
  }
  rays += other.rays;
  for (const Count& count : kCounts) this->*count.member += other.*count.member;
  t_ulp_median = std::max(t_ulp_median, other.t_ulp_median);
  t_ulp_p99 = std::max(t_ulp_p99, other.t_ulp_p99);
  t_ulp_max = std::max(t_ulp_max, other.t_ulp_max);
  cases.insert(cases.end(), other.cases.begin(), other.cases.end());
}

Accuracy accuracy_of(const ErrorFigures& f) {
  Accuracy a{f.rays,
             f.false_misses,
             f.false_hits,
             f.wrong_prims,
             f.ties,
             f.wrong_values,
             f.within_bound,
             f.beyond_bound,
             f.unwritten,
             f.self_hits,
             f.beyond_range,
             f.t_ulp.median,
             f.t_ulp.p99,
             f.t_ulp.max,
             {},
             {}};
  for (const ErrorCase& c : f.cases)
    a.cases.push_back(
        {c.index, std::string(name_of(c.kind)), c.within_bound, c.reason, c.ray, c.answer, c.truth.prim, c.truth.t});
  return a;
}

bool is_exact(const std::string& numeric) { return numeric == "exact"; }

bool is_conservative(const std::string& numeric) {
  return std::ranges::any_of(kNumericModes, [&](const NumericMode& m) { return m.name == numeric && m.conservative; });
}

std::uint64_t broken_promises(const Accuracy& a, const std::string& numeric) {
  if (is_exact(numeric)) return a.wrong() + a.wrong_values + a.ties;
  return is_conservative(numeric) ? a.beyond_bound + a.wrong_values : a.unwritten;
}

void add_json(nlohmann::json& record, const Accuracy& a) {
  record["verified_rays"] = a.rays;
  for (const Count& count : kCounts) record[count.name] = a.*count.member;
  record["t_ulp"] = {{"median", a.t_ulp_median}, {"p99", a.t_ulp_p99}, {"max", a.t_ulp_max}};
  if (a.image_rmse) record["image_rmse"] = *a.image_rmse;
  record["cases"] = nlohmann::json::array();
  for (const WrongAnswer& c : a.cases) record["cases"].push_back(case_json(c));
}

std::optional<Accuracy> read_accuracy(const JsonPlace& record) {
  const auto verified = record.find("verified_rays");
  if (!verified) return std::nullopt;
  Accuracy a;
  a.rays = verified->count();
  for (const Count& count : kCounts)
    if (const auto value = record.find(count.name); value || count.member != &Accuracy::beyond_range)  // new
      a.*count.member = (value ? *value : record.at(count.name)).count();
  const JsonPlace ulp = record.at("t_ulp");
  a.t_ulp_median = number_or_nan(ulp.at("median"));
  a.t_ulp_p99 = number_or_nan(ulp.at("p99"));
  a.t_ulp_max = number_or_nan(ulp.at("max"));
  if (const auto rmse = record.find("image_rmse")) a.image_rmse = rmse->number();
  for (const JsonPlace& one : record.at("cases").items()) a.cases.push_back(read_case(one));
  return a;
}

}  // namespace ballot::bench
