// The paper's tables with our results beside the published ones.
#include <algorithm>

#include "tools/bench/markdown.h"
#include "tools/bench/paper.h"
#include "tools/bench/report.h"

namespace ballot::bench {

namespace {

constexpr std::string_view kCitation =
    "M. Vinkler, *Traversal methods for GPU ray tracing*; NVIDIA GTX 280, 1024 x 1024, five viewpoints";

const PaperScene* paper_scene(const std::string& scene) {
  for (const PaperScene& p : kPaperScenes)
    if (std::ranges::find(p.files, scene) != p.files.end()) return &p;
  return nullptr;
}

std::string scene_title(const std::string& scene) {
  const PaperScene* p = paper_scene(scene);
  if (!p) return scene;
  return scene == kStandIn ? std::string(p->name) + " (stand-in)" : std::string(p->name);
}

std::string stand_in_note(const std::vector<std::string>& scenes) {
  if (std::ranges::find(scenes, kStandIn) == scenes.end()) return "";
  return "The paper's Fairy scene was not at hand: `" + std::string(kStandIn) +
         "` is another model made to resemble it, so only the trend of its figures can be compared.\n\n";
}

bool same_tree(const SceneFigures& a, const SceneFigures& b) {
  return a.name == b.name && a.bvh.triangles == b.bvh.triangles && a.bvh.references == b.bvh.references &&
         a.bvh.nodes == b.bvh.nodes;
}

std::string speed_up(std::optional<double> fps, std::optional<double> base) {
  if (!fps) return "-";
  return base ? fmt::format("{} ({})", figure(*fps), percent(*fps / *base)) : figure(*fps);
}

const Cell* find_row(const Block& block, const PaperRow& row) {
  if (const Cell* cell = block.find(std::string(row.label))) return cell;
  return row.stand_in.empty() ? nullptr : block.find(std::string(row.stand_in));
}

bool stands_in(const Block& block, const PaperHalf& half, const Cell& cell) {
  return std::ranges::any_of(
      half.rows, [&](const PaperRow& row) { return cell.label != row.label && find_row(block, row) == &cell; });
}

/// Returns the title of a row that the paper lacks. "cut" becomes "cut(count)", because the paper's own cut votes by
/// sum.
std::string other_title(const std::string& label) { return label == "cut" ? "cut(count)" : label; }

/// One half of Table 2: the paper's rows first, then the entries that the paper lacks. With several settings, each
/// scene has a column for each setting, and only the main entries have rows.
class HalfTable {
 public:
  HalfTable(const std::vector<const Setting*>& settings, const PaperHalf& half)
      : half_(half), several_(settings.size() > 1) {
    for (const Setting* setting : settings)
      for (const Block& block : setting->blocks)
        if (block.rays == half.rays) {
          blocks_.push_back(&block);
          settings_[&block] = setting;
        }
    std::ranges::stable_sort(blocks_, {}, [](const Block* b) {
      const PaperScene* p = paper_scene(b->scene);
      return p ? p - kPaperScenes.data() : std::ptrdiff_t(kPaperScenes.size());
    });
  }

  std::string text() const {
    if (std::ranges::none_of(blocks_, [](const Block* b) { return has_frames(*b); })) return "";
    std::vector<std::string> header{std::string(half_.title)};
    for (const Block* block : blocks_) {
      if (new_scene(*block)) header.push_back(std::string(paper_scene(block->scene)->name) + ", paper");
      header.push_back(scene_title(block->scene) + ", " + (several_ ? setting_title(*settings_.at(block)) : "here"));
    }
    Table table(header);
    for (const PaperRow& row : half_.rows) add(table, row);
    for (const std::string& label : other_labels()) add_other(table, label);
    return table.text();
  }

 private:
  static bool has_frames(const Block& block) {
    return std::ranges::any_of(block.cells, [](const Cell& c) { return c.fps().has_value(); });
  }

  /// Returns the device, or the setting's whole name if another setting has the same device.
  std::string setting_title(const Setting& setting) const {
    for (const auto& [block, other] : settings_)
      if (other != &setting && other->document->device == setting.document->device) return setting.name;
    return setting.document->device;
  }

  std::string speed(const Block& block, const Cell* cell) const {
    const Cell* base = block.find(std::string(half_.rows[0].label));
    return speed_up(cell ? cell->fps() : std::nullopt, base ? base->fps() : std::nullopt);
  }

  void add(Table& table, const PaperRow& row) const {
    std::vector<std::string> cells{std::string(row.method)};
    bool some = false;
    for (const Block* block : blocks_) {
      if (new_scene(*block)) {
        const auto i = std::size_t(paper_scene(block->scene) - kPaperScenes.data());
        const bool printed = !row.fps[i].empty();
        cells.push_back(printed ? fmt::format("{} ({})", row.fps[i], row.gain[i]) : "");
        some |= printed;
      }
      const Cell* cell = find_row(*block, row);
      some |= cell != nullptr;
      cells.push_back(speed(*block, cell));
    }
    if (some) table.row(std::move(cells));
  }

  /// Adds the row of an entry that the paper lacks. A cell is "above" if it takes the place of a row of the paper.
  void add_other(Table& table, const std::string& label) const {
    std::vector<std::string> cells{other_title(label)};
    bool some = false;
    for (const Block* block : blocks_) {
      if (new_scene(*block)) cells.push_back("");
      const Cell* cell = block->find(label);
      const bool above = cell && stands_in(*block, half_, *cell);
      some |= cell && !above;
      cells.push_back(above ? "above" : speed(*block, cell));
    }
    if (some) table.row(std::move(cells));
  }

  /// True if the block is the first one of a scene of the paper.
  bool new_scene(const Block& block) const {
    const auto here = std::ranges::find(blocks_, &block);
    return paper_scene(block.scene) && (here == blocks_.begin() || (*(here - 1))->scene != block.scene);
  }

  std::vector<std::string> other_labels() const {
    std::vector<std::string> labels;
    for (const Block* block : blocks_)
      for (const Cell& cell : block->cells)
        if ((!several_ || is_main(*block, cell)) &&
            std::ranges::find(half_.rows, cell.label, &PaperRow::label) == half_.rows.end() &&
            std::ranges::find(labels, cell.label) == labels.end())
          labels.push_back(cell.label);
    return labels;
  }

  const PaperHalf& half_;
  bool several_;
  std::vector<const Block*> blocks_;
  std::map<const Block*, const Setting*> settings_;
};

}  // namespace

bool is_main(const Block& block, const Cell& cell) {
  const Record& r = cell.first();
  if (r.role == Role::Method && (r.method == "packet" || r.method == "cut")) return true;
  for (const Cell& other : block.cells) {
    if (&other == &cell) return true;
    if (other.first().method == r.method && other.role == cell.role) return false;
  }
  return true;
}

std::string scene_section(const std::vector<Document>& documents) {
  std::vector<SceneFigures> scenes;
  std::vector<std::string> names;
  for (const Document& d : documents)
    for (const SceneFigures& s : d.scenes)
      if (std::ranges::none_of(scenes, [&](const SceneFigures& other) { return same_tree(s, other); })) {
        scenes.push_back(s);
        names.push_back(s.name);
      }
  Table table({"scene", "triangles, paper", "here", "split triangles, paper", "here", "nodes, paper", "here", "depth",
               "SAH cost", "MiB"});
  for (const SceneFigures& s : scenes) {
    const PaperScene* p = paper_scene(s.name);
    const auto paper = [&](std::string_view PaperScene::*field) { return p ? std::string(p->*field) : std::string(); };
    table.row({scene_title(s.name), paper(&PaperScene::triangles), std::to_string(s.bvh.triangles),
               paper(&PaperScene::split), std::to_string(s.bvh.references), paper(&PaperScene::nodes),
               std::to_string(s.bvh.nodes), std::to_string(s.bvh.depth), fmt::format("{:.1f}", s.bvh.sah),
               fmt::format("{:.1f}", double(s.bvh.bytes) / (1 << 20))});
  }
  if (table.empty()) return "";
  return fmt::format("## Table 1: the scenes\n\nPaper: {}.\n\n", kCitation) + stand_in_note(names) + table.text();
}

std::string frame_section(const Setting& setting) {
  std::string tables;
  for (const PaperHalf& half : kPaperTable2) tables += HalfTable({&setting}, half).text();
  if (tables.empty()) return "";
  return fmt::format(
             "## Table 2: frames per second and speed-up against packet: {}\n\nPaper: {}; its packet votes by "
             "`any`.\n\n",
             setting.name, kCitation) +
         stand_in_note(setting.scenes()) + tables + std::string(kCutNote) + "\n\n";
}

std::string frame_summary(const Arranged& arranged) {
  std::vector<const Setting*> settings;
  std::vector<std::string> scenes;
  for (const Setting& s : arranged.settings) {
    settings.push_back(&s);
    for (const std::string& scene : s.scenes()) scenes.push_back(scene);
  }
  if (settings.size() == 1) return frame_section(*settings[0]);
  std::string tables;
  for (const PaperHalf& half : kPaperTable2) tables += HalfTable(settings, half).text();
  if (tables.empty()) return "";
  return fmt::format(
             "## Table 2: frames per second and speed-up against packet\n\nPaper: {}; its packet votes by `any`.\n\n",
             kCitation) +
         stand_in_note(scenes) + tables + std::string(kCutNote) + "\n\n";
}

}  // namespace ballot::bench
