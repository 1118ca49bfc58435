#include <algorithm>

#include "engine/scene/device_scene.h"
#include "tools/bench/markdown.h"
#include "tools/program/cli.h"

namespace ballot::cli {

namespace {

using bench::Table;

std::string code(std::string_view name) { return fmt::format("`{}`", name); }
std::string code(std::string_view name, std::string_view standard) {
  return code(name) + (name == standard ? " (default)" : "");
}

void append(std::string& list, const std::string& item) { list += (list.empty() ? "" : ", ") + item; }

std::string methods_table() {
  Table table({"method", "what it does", "tree format", "votes", "threshold", "instances"}, 6);
  for (const Method& m : kMethods) {
    std::string votes;
    for (const Vote vote : {Vote::Any, Vote::Count, Vote::Sum})
      if (m.takes(vote)) append(votes, std::string(vote_name(vote)));
    const Threshold& t = m.threshold;
    table.row({code(m.name, kDefaultMethod), std::string(m.summary), m.chooses ? "" : code(format_of(m.tree).name),
               votes, t.unit == Threshold::None ? "" : fmt::format("`{}`, default {:.6g}", t.knob, t.standard),
               m.instances ? "yes" : "no"});
  }
  return table.text();
}

std::string_view pairs_text(Pairs pairs) {
  return pairs == Pairs::Always ? "always" : pairs == Pairs::Never ? "never" : "with knob `fallback`";
}

std::string formats_table() {
  Table table({"format", "what it is", "pair tree read too", "pushes a step", "methods"}, 5);
  for (const TreeFormat& f : kTreeFormats) {
    std::string methods;
    for (const Method& m : kMethods)
      if (!m.chooses && m.tree == f.id) append(methods, code(m.name));
    table.row({code(f.name), std::string(f.summary), f.encode ? std::string(pairs_text(f.pairs)) : "is the pair tree",
               std::to_string(f.pushes), methods});
  }
  return table.text();
}

std::string knobs_table() {
  Table table({"knob", "values", "what it does"}, 3);
  for (const KnobInfo& knob : knobs()) table.row({code(knob.name), knob.values, knob.what});
  return table.text();
}

std::string numeric_table() {
  Table table({"mode", "what it is", "leaves hold", "same bits for every method", "device needs"}, 5);
  for (const NumericMode& mode : kNumericModes)
    table.row({code(mode.name, kDefaultNumeric), std::string(mode.summary),
               mode.leaves == LeafFormat::Affine ? "affine maps" : "vertices", mode.conservative ? "yes" : "no",
               mode.needs_float64 ? "`shaderFloat64`" : ""});
  return table.text();
}

std::string builders_table() {
  Table table({"builder", "what it does", "spatial splits", "runs on"}, 4);
  for (const Builder& b : kBuilders)
    table.row({code(b.name, kDefaultBuilder), std::string(b.summary), b.splits ? "yes" : "no",
               b.chooses     ? "either"
               : b.on_device ? "the device"
                             : "the CPU"});
  return table.text();
}

/// A table: the name of its section in a text file, its title in a terminal.
struct Listing {
  std::string name;
  std::string_view title;
  std::string (*table)();
};

const Listing kListings[] = {{"methods", "Traversal methods (--method)", methods_table},
                             {"formats", "Tree formats", formats_table},
                             {"knobs", "Knobs (--knob NAME=VALUE)", knobs_table},
                             {"numeric", "Numeric modes (--numeric)", numeric_table},
                             {"builders", "BVH builders (--build)", builders_table}};

std::string begin_of(const std::string& name) { return "<!-- " + name + ":begin -->"; }
std::string end_of(const std::string& name) { return "<!-- " + name + ":end -->"; }

/// Returns the positions of the lines that equal `mark`.
std::vector<std::size_t> lines_of(const std::string& text, const std::string& mark) {
  std::vector<std::size_t> found;
  for (std::size_t at = text.find(mark); at != std::string::npos; at = text.find(mark, at + 1))
    if ((at == 0 || text[at - 1] == '\n') && (at + mark.size() == text.size() || text[at + mark.size()] == '\n'))
      found.push_back(at);
  return found;
}

/// Replaces the section of a table in the text of a file, if it has one. Returns false if it has none. Throws
/// Error(Work) for marks that are missing, there twice, or in the wrong order.
bool replace_section(const std::string& file, std::string& text, const Listing& listing) {
  const std::string marks[] = {begin_of(listing.name), end_of(listing.name)};
  const std::vector<std::size_t> places[] = {lines_of(text, marks[0]), lines_of(text, marks[1])};
  if (places[0].empty() && places[1].empty()) return false;
  for (int i = 0; i < 2; ++i)
    if (places[i].size() != 1)
      fail(Failure::Work, "{}: found {} lines '{}', expected one; mark the place for the {} with '{}' and '{}'", file,
           places[i].size(), marks[i], listing.name, marks[0], marks[1]);
  const std::size_t begin = places[0][0] + marks[0].size(), end = places[1][0];
  if (end < begin) fail(Failure::Work, "{}: found '{}' before '{}', expected it after", file, marks[1], marks[0]);
  text.replace(begin, end - begin, "\n\n" + listing.table());
  return true;
}

/// Rewrites the sections of these files. All files are checked before the first is written.
void write_tables(const std::vector<std::string>& files) {
  std::vector<std::string> texts, said;
  for (const std::string& file : files) {
    const auto bytes = read_file(file);
    std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size()), known;
    const std::size_t before = said.size();
    for (const Listing& listing : kListings) {
      if (replace_section(file, text, listing)) said.push_back(fmt::format("wrote the {} in {}\n", listing.name, file));
      append(known, "'" + begin_of(listing.name) + "'");
    }
    if (said.size() == before)
      fail(Failure::Work, "{}: found no section to write, expected one of the lines {}, with its end", file, known);
    check_writable(file);
    texts.push_back(std::move(text));
  }
  for (std::size_t i = 0; i < files.size(); ++i) write_file(files[i], texts[i]);
  for (const std::string& line : said) say("{}", line);
}

int run_methods(const std::vector<std::string>& files) {
  write_tables(files);
  if (files.empty())
    for (const Listing& listing : kListings) say("{}:\n\n{}", listing.title, listing.table());
  return 0;
}

}  // namespace

void add_methods(CLI::App& app, int& result) {
  const auto [cmd, files] = add_command<std::vector<std::string>>(
      app, result, "methods", run_methods,
      "lists traversal methods, tree formats, knobs, numeric modes and builders in tables; needs no device");
  cmd->add_option("--write", *files,
                  "text files in which to replace the tables instead of printing them: each section between the lines\n"
                  "<!-- NAME:begin --> and <!-- NAME:end -->, where NAME is methods, formats, knobs, numeric or\n"
                  "builders; e.g. ballot methods --write shaders/methods.md");
}

}  // namespace ballot::cli
