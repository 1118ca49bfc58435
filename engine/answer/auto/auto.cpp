#include "engine/answer/auto/auto.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "engine/answer/reorder.h"
#include "engine/core/error.h"

namespace ballot {

namespace {

/// A method and up to two knobs; no name: none. A value of the query takes precedence.
struct Entry {
  std::string_view method;
  std::array<std::pair<std::string_view, std::string_view>, 2> knobs = {};
};

constexpr Entry kWhile{"while-while"}, kWhileAny{"while-while", {{{"sorted", "0"}}}};
constexpr Entry kBvh8{"bvh8"}, kBvh8Any{"bvh8", {{{"sorted", "0"}}}};
constexpr Entry kFrontierAny{"frontier", {{{"sorted", "0"}}}};
constexpr Entry kTurns{"bvh4-turns"};
constexpr Entry kWidest{"packet-wide", {{{"fallback", "0"}}}};
constexpr Entry kWide{"packet-wide", {{{"fallback", "0"}, {"rays", "4"}}}};

/// Sets of ray classes, as bits.
enum Classes : unsigned {
  kCoherent = 1,    // neighbours walk alike: primary, shadow, coherent
  kMixed = 2,       // most do: reflect, secondary, mixed
  kRefracted = 4,   // likewise, and better so: refract
  kIncoherent = 8,  // few do: ao, diffuse, incoherent
  kAlike = kMixed | kRefracted,
  kAll = 15,
};

constexpr std::pair<std::string_view, Classes> kClasses[] = {
    {"primary", kCoherent},   {"shadow", kCoherent},      {"coherent", kCoherent}, {"reflect", kMixed},
    {"secondary", kMixed},    {"mixed", kMixed},          {"refract", kRefracted}, {"ao", kIncoherent},
    {"diffuse", kIncoherent}, {"incoherent", kIncoherent}};

enum class Hits { Both, Nearest, Any };

struct AutoRow {
  Classes classes;
  Hits hits = Hits::Both;
  std::size_t least = 0;  // rays of a batch
  double dense = 0;       // rays of a batch for each even triangle, at least
  double fine = 0;        // even triangles, at least
  bool large = false;     // for scenes of at least kLarge triangles, whose rays it pays to sort
  Entry chosen;
  Entry rival = {};
};

// Measured on lavapipe 22.3.6 and on an NVIDIA H200, seven scenes, seven ray kinds, batches of 10^3 to 10^6 rays, modes
// plain and watertight: tools/measured/traversal.md has the tables. Packets pay where several of their rays meet the
// same triangles: the more rays there are for each, the better.
constexpr std::size_t kFew = 1 << 12, kSome = 1 << 15, kMany = 1 << 18;
constexpr std::size_t kLarge = 1 << 18;
constexpr double kFine = 24000;
constexpr Hits kNearest = Hits::Nearest, kAny = Hits::Any;
constexpr AutoRow kCpuRows[] = {
    {.classes = kCoherent, .least = kMany, .dense = 0.4, .chosen = kWidest},
    {.classes = kCoherent, .hits = kNearest, .least = kFew, .dense = 0.2, .chosen = kWide},
    {.classes = kCoherent, .hits = kAny, .least = 1 << 16, .dense = 0.42, .chosen = kWidest},
    {.classes = kCoherent, .hits = kAny, .least = 1 << 13, .dense = 0.42, .chosen = kWide},
    {.classes = kAlike, .least = kMany, .dense = 0.4, .chosen = kWidest},
    {.classes = kRefracted, .least = kSome, .dense = 0.42, .chosen = kWide},
    {.classes = kMixed, .least = kSome, .dense = 1, .chosen = kWide},
    {.classes = kIncoherent, .least = kSome, .large = true, .chosen = {"bvh4-turns", {{{"reorder", "1"}}}}},
    {.classes = kAll, .chosen = kTurns},
    {.classes = kIncoherent, .least = kSome, .large = true, .chosen = {"while-while", {{{"reorder", "1"}}}}},
    {.classes = kAll, .chosen = {"dynamic-fetch"}},
    {.classes = kAll, .chosen = kWhile},
};
constexpr AutoRow kGpuRows[] = {
    {.classes = kCoherent, .hits = kNearest, .least = kSome, .chosen = kWhile},
    {.classes = kCoherent, .hits = kAny, .least = kSome, .chosen = kWhileAny, .rival = kFrontierAny},
    {.classes = kAlike, .hits = kNearest, .least = kSome, .chosen = kWhile, .rival = kBvh8},
    {.classes = kIncoherent, .hits = kNearest, .least = kSome, .chosen = kWhile, .rival = kBvh8},
    {.classes = kIncoherent, .hits = kAny, .least = kSome, .chosen = kWhileAny, .rival = kBvh8Any},
    {.classes = kAll, .hits = kNearest, .least = kSome, .chosen = kWhile},
    {.classes = kMixed, .hits = kNearest, .fine = kFine, .chosen = kBvh8},
    {.classes = kCoherent, .hits = kAny, .fine = kFine, .chosen = kBvh8Any},
    {.classes = kAll, .hits = kNearest, .chosen = {"while-while", {{{"leaf_run", "0"}}}}},
    {.classes = kAll, .hits = kNearest, .chosen = kWhile},
    {.classes = kAll, .hits = kAny, .chosen = kWhileAny},
};

/// Returns the class by whose rays' hits shadow rays part: "diffuse" for "shadow of diffuse". Other names stay.
std::string_view without_shadow(std::string_view name) {
  constexpr std::string_view kShadowOf = "shadow of ";
  return name.starts_with(kShadowOf) ? name.substr(kShadowOf.size()) : name;
}

/// Returns the classes that a name may stand for: all if it is unknown.
unsigned classes_of(std::string_view name) {
  name = without_shadow(name);
  const auto found = std::ranges::find(kClasses, name, &std::pair<std::string_view, Classes>::first);
  return found == std::end(kClasses) ? unsigned(kAll) : unsigned(found->second);
}

/// Returns true if a row is for the rays, the device and the facts. `classes`: of the rays; an unknown class takes rows
/// for all.
bool fits(const AutoRow& row, const Query& query, unsigned classes, const DeviceInfo& device, const AutoFacts& facts) {
  return (row.classes & classes) == classes && facts.rays >= row.least &&
         double(facts.rays) >= row.dense * facts.even && facts.even >= row.fine &&
         (row.hits == Hits::Both || (row.hits == Hits::Any) == (query.want == Want::Any)) &&
         (!row.large || (facts.triangles >= kLarge && can_reorder(device)));
}

/// Returns an entry of the table for the query, or nothing if the device, the scene or the knobs rule it out. Then the
/// reason goes into `why`, unless that has one.
std::optional<Candidate> candidate(const Entry& entry, const Query& query, const DeviceInfo& device,
                                   const AutoFacts& facts, std::string& why) {
  if (entry.method.empty()) return {};
  const Method& method = find_method(entry.method);
  const NumericMode& numeric = find_numeric(query.numeric, device);
  if (facts.instances && !method.instances) return {};
  // In modes that need float64, kernels take seconds to compile, and those over wider trees gain nothing.
  if (format_of(method.tree).collapsed() && (numeric.needs_float64 || !facts.collapses)) return {};
  Candidate c{std::string(entry.method), query.knobs};
  for (const auto& [knob, value] : entry.knobs)
    if (!knob.empty()) c.knobs.emplace(knob, value);
  try {
    kernel_config_for(method, numeric, device, c.knobs);
    return c;
  } catch (const Error& e) {
    if (why.empty()) why = e.what();
    return {};
  }
}

}  // namespace

std::string Candidate::name() const {
  std::string text = method;
  for (const auto& [knob, value] : knobs) text += fmt::format(" {}={}", knob, value);
  return text;
}

Query Candidate::apply(Query query) const {
  query.method = method;
  query.knobs = knobs;
  return query;
}

AutoChoice auto_choice(const Query& query, const DeviceInfo& device, const AutoFacts& facts) {
  const unsigned classes = classes_of(query.rays);
  const std::span<const AutoRow> rows = device.is_cpu() ? std::span<const AutoRow>(kCpuRows) : kGpuRows;
  std::string why;
  // What fits; then what the knobs allow; then what they allow, although a tree has to be made for it.
  for (const bool any_row : {false, true})
    for (const bool any_tree : {false, true})
      for (const AutoRow& row : rows) {
        if (!any_row && !fits(row, query, classes, device, facts)) continue;
        AutoFacts allowed = facts;
        allowed.collapses = facts.collapses || any_tree;
        if (auto chosen = candidate(row.chosen, query, device, allowed, why))
          return {std::move(*chosen), any_row ? std::nullopt : candidate(row.rival, query, device, facts, why)};
      }
  fail(Failure::Arguments, "method auto has nothing to choose from: {}", why);
}

double even_triangles(std::span<const Triangle> triangles) {
  constexpr std::size_t kSample = 1 << 16;
  const std::size_t step = std::max<std::size_t>(1, triangles.size() / kSample);
  double roots = 0, areas = 0, count = 0;
  for (std::size_t i = 0; i < triangles.size(); i += step, ++count) {
    const Triangle& t = triangles[i];
    const glm::dvec3 a(t[0]), edge = glm::dvec3(t[1]) - a, other = glm::dvec3(t[2]) - a;
    const double area = glm::length(glm::cross(edge, other)) / 2;
    roots += std::sqrt(area);
    areas += area;
  }
  return areas > 0 ? roots * roots / areas * double(triangles.size()) / count : 0;
}

bool is_ray_class(std::string_view name) { return classes_of(name) != kAll; }

bool depends_on_class(const DeviceInfo& device, std::size_t rays) { return rays >= (device.is_cpu() ? kFew : kSome); }

}  // namespace ballot
