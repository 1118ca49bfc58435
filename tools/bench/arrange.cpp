#include "tools/bench/arrange.h"

#include <algorithm>
#include <cmath>

namespace ballot::bench {

namespace {

std::string rays_name(const Record& record) {
  const bool foreign = std::filesystem::path(record.rays).extension() == ".npy";
  return record.rays + (foreign && record.any ? ":any" : "");
}

bool same_setting(const Setting& setting, const Document& document, const Record& record) {
  return setting.numeric == record.numeric && same_platform(*setting.document, document);
}

Setting& setting_of(std::vector<Setting>& settings, const Document& document, const Record& record) {
  for (Setting& setting : settings)
    if (same_setting(setting, document, record)) return setting;
  return settings.emplace_back(Setting{{}, record.numeric, &document, {}});
}

Block& block_of(Setting& setting, const Record& record) {
  const std::string rays = rays_name(record);
  for (Block& block : setting.blocks)
    if (block.scene == record.scene && block.rays == rays) return block;
  return setting.blocks.emplace_back(Block{record.scene, rays, {}, {}});
}

Cell& cell_of(Block& block, const Record& record) {
  std::vector<Cell>& cells = record.role == Role::Sweep ? block.sweep : block.cells;
  for (Cell& cell : cells)
    if (cell.label == record.label) return cell;
  return cells.emplace_back(Cell{record.label, record.role, {}});
}

void name_settings(std::vector<Setting>& settings) {
  std::vector<std::string> names;
  std::vector<const Document*> documents;
  for (const Setting& s : settings) {
    names.push_back(s.document->device + ", " + s.numeric);
    documents.push_back(s.document);
  }
  tell_apart(names, documents);
  for (std::size_t i = 0; i < settings.size(); ++i) settings[i].name = names[i];
}

template <class Items, class Name>
std::vector<std::string> names_in_order(const Items& items, Name name) {
  std::vector<std::string> names;
  for (const auto& item : items)
    if (std::ranges::find(names, name(item)) == names.end()) names.push_back(name(item));
  return names;
}

}  // namespace

double Cell::total_ms() const {
  double ms = 0;
  for (const auto& [view, record] : views) ms += record->trace.median;
  return ms;
}

double Cell::mrays_per_s() const {
  double rays = 0;
  for (const auto& [view, record] : views) rays += double(record->ray_count);
  return rays / total_ms() * 1e-3;
}

std::optional<double> Cell::fps() const {
  double sum = 0;
  int count = 0;
  for (const auto& [view, record] : views)
    if (record->frame) {
      sum += 1000 / record->frame->median;
      ++count;
    }
  if (count == 0) return std::nullopt;
  return sum / count;
}

std::optional<double> time_ratio(const Cell& a, const Cell& b) {
  double time_a = 0, time_b = 0;
  for (const auto& [view, record] : a.views)
    if (const auto other = b.views.find(view); other != b.views.end()) {
      time_a += record->trace.median;
      time_b += other->second->trace.median;
    }
  if (time_b == 0) return std::nullopt;
  return time_a / time_b;
}

const Cell* Block::find(const std::string& label) const {
  const auto found = std::ranges::find(cells, label, &Cell::label);
  return found == cells.end() ? nullptr : &*found;
}

bool Block::whole(const Cell& cell) const {
  for (const auto* all : {&cells, &sweep})
    for (const Cell& other : *all)
      for (const auto& [view, record] : other.views)
        if (!cell.views.contains(view)) return false;
  return true;
}

std::vector<std::string> Setting::labels() const {
  std::vector<std::string> all;
  for (const Block& block : blocks)
    for (const std::string& label : names_in_order(block.cells, [](const Cell& c) { return c.label; }))
      if (std::ranges::find(all, label) == all.end()) all.push_back(label);
  return all;
}

std::vector<std::string> Setting::ray_kinds() const {
  return names_in_order(blocks, [](const Block& b) { return b.rays; });
}

std::vector<std::string> Setting::scenes() const {
  return names_in_order(blocks, [](const Block& b) { return b.scene; });
}

const Block* Setting::find(const std::string& scene, const std::string& rays) const {
  for (const Block& block : blocks)
    if (block.scene == scene && block.rays == rays) return &block;
  return nullptr;
}

bool same_platform(const Document& a, const Document& b) {
  return a.device == b.device && a.driver == b.driver && a.subgroup_size == b.subgroup_size && a.clock == b.clock &&
         a.size == b.size && a.ao_rays == b.ao_rays && a.ao_radius == b.ao_radius && a.offset == b.offset;
}

void tell_apart(std::vector<std::string>& names, const std::vector<const Document*>& documents) {
  using Part = std::function<std::string(const Document&)>;
  const std::vector<Part> parts{
      [](const Document& d) { return d.driver; },
      [](const Document& d) { return fmt::format("{}x{}", d.size[0], d.size[1]); },
      [](const Document& d) { return fmt::format("subgroups of {}", d.subgroup_size); },
      [](const Document& d) { return d.clock; },
      [](const Document& d) { return fmt::format("{} ao rays of {:g}", d.ao_rays, d.ao_radius); },
      [](const Document& d) { return "offset " + d.offset; },
  };
  for (const Part& part : parts) {
    std::map<std::string, int> uses;
    for (const std::string& name : names) ++uses[name];
    for (std::size_t i = 0; i < names.size(); ++i)
      if (uses[names[i]] > 1) names[i] += ", " + part(*documents[i]);
  }
}

Arranged arrange(const std::vector<Document>& documents) {
  Arranged arranged;
  for (const Document& document : documents)
    for (const Record& record : document.records) {
      Setting& setting = setting_of(arranged.settings, document, record);
      Cell& cell = cell_of(block_of(setting, record), record);
      const Record*& place = cell.views[record.view];
      arranged.replaced += place != nullptr;
      place = &record;
    }
  name_settings(arranged.settings);
  return arranged;
}

double geometric_mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += std::log(value);
  return std::exp(sum / double(values.size()));
}

}  // namespace ballot::bench
