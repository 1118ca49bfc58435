#include <charconv>

#include "tools/bench/document.h"
#include "tools/bench/json_place.h"

namespace ballot::bench {

namespace {

Times read_times(const JsonPlace& json) {
  Times times{json.at("median").positive(), json.at("p10").positive(), json.at("p90").positive(), {}};
  if (const auto samples = json.find("samples"))
    for (const JsonPlace& sample : samples->items()) times.samples.push_back(sample.positive());
  return times;
}

Checked read_check(const JsonPlace& json) {
  return {json.at("rays").count(),         json.at("same").count(),       json.at("tie").count(),
          json.at("false_misses").count(), json.at("false_hits").count(), json.at("wrong_prims").count(),
          json.at("wrong_t").count(),      json.at("unwritten").count()};
}

Role read_role(const JsonPlace& json) {
  const std::string role = json.text();
  if (role == "method") return Role::Method;
  if (role == "sweep") return Role::Sweep;
  if (role == "best") return Role::Best;
  json.wrong("'method', 'sweep' or 'best'");
}

std::optional<double> as_number(const std::string& text) {
  double value = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Reads the threshold. In files without one, it is the only knob whose value is a number.
std::optional<ThresholdValue> read_threshold(const JsonPlace& json, const Record& record) {
  if (const auto threshold = json.find("threshold"))
    return ThresholdValue{threshold->at("knob").text(), threshold->at("value").number()};
  if (record.role == Role::Method) return std::nullopt;
  std::optional<ThresholdValue> found;
  for (const auto& [name, text] : record.knobs)
    if (const auto value = as_number(text)) {
      if (found) json.wrong("'threshold': the knob that was swept and its value");
      found = ThresholdValue{name, *value};
    }
  if (!found && record.role == Role::Sweep) json.wrong("'threshold': the knob that was swept and its value");
  return found;
}

/// Reads rays and query, which a Record and a HardRecord share.
template <class R>
void read_query(const JsonPlace& json, R& r) {
  r.rays = json.at("rays").text();
  r.any = json.at("any").truth();
  r.label = json.at("label").text();
  r.method = json.at("method").text();
  r.numeric = json.at("numeric").text();
  for (const auto& [name, value] : json.at("knobs").members()) r.knobs[name] = value.text();
}

Record read_record(const JsonPlace& json) {
  Record r;
  r.scene = json.at("scene").text();
  r.view = json.at("view").text();
  read_query(json, r);
  r.role = read_role(json.at("role"));
  r.threshold = read_threshold(json, r);
  if (const auto variant = json.find("variant")) r.variant = variant->text();
  if (const auto lanes = json.find("workgroup")) r.workgroup = lanes->small_count();
  if (const auto lanes = json.find("subgroup")) r.subgroup = lanes->small_count();
  if (const auto lanes = json.find("resident_lanes")) r.resident_lanes = lanes->small_count();
  r.ray_count = json.at("ray_count").count();
  r.trace = read_times(json.at("trace_ms"));
  if (const auto frame = json.find("frame_ms")) r.frame = read_times(*frame);
  if (const auto counters = json.find("counters"))
    for (const auto& [name, value] : counters->members()) r.counters[name] = value.number();
  if (const auto check = json.find("check")) r.check = read_check(*check);
  r.accuracy = read_accuracy(json);
  return r;
}

HardRecord read_hard(const JsonPlace& json) {
  HardRecord r;
  r.name = json.at("case").text();
  r.from = json.at("from").text();
  r.what = json.at("what").text();
  read_query(json, r);
  r.closed = json.at("closed").truth();
  r.leaks = json.at("leaks").count();
  r.unlike = json.at("unlike_known").count();
  r.differing = json.at("differing").count();
  r.accuracy = read_accuracy(json).value_or(Accuracy{});
  if (const auto failed = json.find("failed")) r.failed = failed->text();
  return r;
}

SceneFigures read_scene(const JsonPlace& json) {
  SceneFigures s;
  s.name = json.at("name").text();
  s.bvh.triangles = json.at("triangles").small_count();
  s.bvh.references = json.at("references").small_count();
  s.bvh.nodes = json.at("nodes").small_count();
  s.bvh.depth = json.at("depth").small_count();
  s.bvh.sah = json.at("sah").number();
  s.bvh.bytes = json.at("bytes").count();
  s.bvh.build_s = json.at("build_s").number();
  if (const auto n = json.find("degenerate")) s.bvh.degenerate = n->small_count();
  if (const auto n = json.find("leaves")) s.bvh.leaves = n->small_count();
  if (const auto cached = json.find("from_cache")) s.bvh.from_cache = cached->truth();
  if (const auto builder = json.find("builder")) s.bvh.builder = find_builder(builder->text()).id;
  if (const auto seconds = json.find("load_s")) s.load_s = seconds->number();
  return s;
}

Document read_document(const JsonPlace& json, const std::string& source) {
  Document d;
  d.source = source;
  d.device = json.at("device").text();
  d.driver = json.at("driver").text();
  const auto cpu = json.find("cpu");
  d.cpu = cpu ? cpu->truth() : d.device.find("llvmpipe") != std::string::npos;
  d.subgroup_size = json.at("subgroup_size").small_count();
  d.commit = json.at("commit").text();
  d.command = json.at("command").text();
  if (const auto environment = json.find("environment"))
    for (const auto& [name, value] : environment->members()) d.environment[name] = value.text();
  d.clock = json.at("clock").text();
  if (const auto date = json.find("date")) d.date = date->text();
  const auto size = json.at("size").items();
  if (size.size() != 2) json.at("size").wrong("width and height");
  d.size = {size[0].small_count(), size[1].small_count()};
  if (const auto rays = json.find("ao_rays")) d.ao_rays = rays->small_count();
  if (const auto radius = json.find("ao_radius")) d.ao_radius = radius->positive();
  if (const auto offset = json.find("offset")) d.offset = offset->text();
  d.repeats = json.at("repeats").small_count();
  if (const auto repeats = json.find("sweep_repeats")) d.sweep_repeats = repeats->small_count();
  if (const auto partial = json.find("partial")) d.partial = partial->truth();
  for (const JsonPlace& scene : json.at("scenes").items()) d.scenes.push_back(read_scene(scene));
  for (const JsonPlace& record : json.at("records").items()) d.records.push_back(read_record(record));
  if (const auto hard = json.find("hard"))
    for (const JsonPlace& record : hard->items()) d.hard.push_back(read_hard(record));
  return d;
}

}  // namespace

std::vector<Document> read_documents(const std::filesystem::path& path) {
  constexpr const char* kAdvice = "give a file that 'ballot bench --json' or 'ballot verify --json' wrote";
  const nlohmann::json json =
      parse_json(path, "JSON as 'ballot bench --json' writes it, or 'ballot verify --json'", kAdvice);
  const JsonPlace top(json, path.string(), kAdvice);
  std::vector<Document> documents;
  if (const auto several = top.find("documents")) {
    for (const JsonPlace& one : several->items()) documents.push_back(read_document(one, path.string()));
    if (documents.empty()) several->wrong("at least one document");
  } else {
    documents.push_back(read_document(top, path.string()));
  }
  return documents;
}

}  // namespace ballot::bench
