#include "engine/files/obj_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <set>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "engine/core/srgb.h"
#include "engine/files/file_vertices.h"
#include "engine/files/loaders.h"
#include "engine/files/named_file.h"
#include "engine/files/text_lines.h"

namespace ballot {
namespace {

constexpr std::string_view kNormal = "normal";
constexpr std::int32_t kAbsent = std::numeric_limits<std::int32_t>::max();  // a normal that the file lacks
constexpr std::size_t kMaxCount = std::numeric_limits<std::int32_t>::max();

/// Returns a line without a comment behind '#'.
std::string_view without_comment(std::string_view line) { return trimmed(line.substr(0, line.find('#'))); }

/// Parses a file statement by statement.
class Parser {
 public:
  Parser(const std::filesystem::path& path, const LoadOptions& options)
      : path_(path), options_(options), lines_(path, "OBJ"), group_(path.stem().string()) {}

  ObjFile run() {
    std::string joined;
    std::string_view line;
    while (take_line(line)) {
      if (goes_on(line)) {
        joined.clear();
        while (goes_on(line)) {
          joined.append(line.substr(0, line.rfind('\\'))).append(" ");
          if (!take_line(line)) line = {};
        }
        line = joined.append(line);
      }
      statement(line);
    }
    if (known_ == 0 && !unknown_.empty())
      refuse("is not OBJ: none of its lines is an OBJ statement; the first begins with '{}'", unknown_);
    finish();
    return std::move(file_);
  }

 private:
  template <class... Args>
  [[noreturn]] void fail_here(fmt::format_string<Args...> text, Args&&... args) {
    throw Flaw(fmt::format(text, std::forward<Args>(args)...), line_);
  }

  /// Returns true if a statement goes on in the next line: its last character is a backslash. A comment ends with its
  /// line, though it may name a folder of Windows.
  static bool goes_on(std::string_view line) {
    const std::size_t last = line.find_last_not_of(" \t");
    return last != std::string_view::npos && line[last] == '\\' && line.find('#') == std::string_view::npos;
  }

  bool take_line(std::string_view& line) {
    ++line_;
    return lines_.next(line);
  }

  /// Reads a statement. What is not read is counted.
  void statement(std::string_view line) {
    const std::string_view whole = trimmed(line);
    line = without_comment(line);
    const std::string_view keyword = next_word(line);
    if (keyword.empty()) return;
    ++known_;
    if (keyword == "v") {
      vertex(line);
      color(line);
    } else if (keyword == "vn") {
      need_room(file_.normals.size(), "normal");
      file_.normals.push_back(three<float>(file_.normals.size(), line, "normal"));
    } else if (keyword == "vt") {
      coordinates(line);
    } else if (keyword == "f" || keyword == "fo") {  // fo is the f of the first version
      face(line);
    } else if (keyword == "s") {
      smoothing(trimmed(line));
    } else if (keyword == "usemtl") {
      material_ = material_named(trimmed(whole.substr(keyword.size())));
    } else if (keyword == "g" || keyword == "o") {
      begin_group(trimmed(whole.substr(keyword.size())));
    } else if (keyword == "mtllib") {
      if (!try_library(trimmed(whole.substr(keyword.size())))) library(trimmed(line));  // a name may hold a '#'
    } else if (keyword != "vp") {
      left_out(keyword);
    }
  }

  /// Counts a statement that is not read.
  void left_out(std::string_view keyword) {
    constexpr std::size_t kTold = 8;
    constexpr std::array<std::string_view, 14> kShapes{"l",        "p",          "curv", "curv2", "surf",
                                                       "cstype",   "deg",        "parm", "mg",    "lod",
                                                       "c_interp", "shadow_obj", "end",  "call"};
    if (std::ranges::count(kShapes, keyword) == 0) {
      --known_;
      if (unknown_.empty()) unknown_ = keyword.substr(0, 20);
    }
    if (left_out_.size() < kTold || left_out_.contains(keyword)) ++left_out_[std::string(keyword.substr(0, 20))];
  }

  template <class Number = float>
  Number number(std::string_view word, std::string_view what) {
    if (word.starts_with('+')) word.remove_prefix(1);
    Number value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc::result_out_of_range) value = Number(std::strtod(std::string(word).c_str(), nullptr));
    if (word.empty() || error == std::errc::invalid_argument || end != word.data() + word.size())
      fail_here("{} has '{}' where a number is expected", what, word.substr(0, 40));
    return value;
  }

  void need_room(std::size_t count, std::string_view kind) {
    if (count >= kMaxCount) fail_here("is {} number {}; expected at most {}", kind, count + 1, kMaxCount);
  }

  /// Takes the first three numbers off a line, which has the vector behind `count` others of its kind.
  template <class Number>
  glm::vec<3, Number> three(std::size_t count, std::string_view& line, std::string_view kind) {
    glm::vec<3, Number> v;
    for (int axis = 0; axis < 3; ++axis) {
      const std::string_view word = next_word(line);
      if (word.empty()) fail_here("{} {} has {} coordinates; expected 3", kind, count + 1, axis);
      v[axis] = number<Number>(word, kind);
    }
    return v;
  }

  /// Takes a vertex off a line.
  void vertex(std::string_view& line) {
    need_room(vertices_.size(), "vertex");
    const auto v = three<double>(vertices_.size(), line, "vertex");
    const glm::vec3 rounded(v);
    if (!(std::isfinite(rounded.x) && std::isfinite(rounded.y) && std::isfinite(rounded.z)))
      fail_here("vertex {} is ({}, {}, {}); expected finite numbers", vertices_.size() + 1, rounded.x, rounded.y,
                rounded.z);
    vertices_.add(v);
  }

  /// Reads the colour behind a vertex, as many programs write it: r g b from 0 to 1, sRGB, after x y z or x y z w.
  /// Other words are no colour.
  void color(std::string_view line) {
    std::array<std::string_view, 5> words;
    std::size_t count = 0;
    while (count < words.size() && !(words[count] = next_word(line)).empty()) ++count;
    if (count != 3 && count != 4) return;
    glm::vec3 found;
    for (int c = 0; c < 3; ++c) found[c] = linear_of(number(words[count - 3 + std::size_t(c)], "colour"));
    file_.colors.resize(vertices_.size() - 1, glm::vec3(1));
    file_.colors.push_back(found);
  }

  /// Reads a texture coordinate. A number that is missing or cannot be read is 0: few scenes need it.
  void coordinates(std::string_view line) {
    if (file_.coordinates.size() >= kMaxCount) return;
    glm::vec2& to = file_.coordinates.emplace_back(0);
    for (int i = 0; i < 2; ++i) {
      std::string_view word = next_word(line);
      if (word.starts_with('+')) word.remove_prefix(1);
      if (float value = 0; std::from_chars(word.data(), word.data() + word.size(), value).ec == std::errc{})
        to[i] = std::isfinite(value) ? value : 0;
    }
  }

  /// Notes the texture coordinate of the last corner. Zero, and what is no number, mean none; finish() checks ranges.
  void coordinate_of_corner(std::string_view word) {
    std::int64_t value = 0;
    std::from_chars(word.data(), word.data() + word.size(), value);
    if (value < 0) value += static_cast<std::int64_t>(file_.coordinates.size()) + 1;
    if (value <= 0 || value > static_cast<std::int64_t>(kMaxCount)) return;
    file_.coordinates_of.resize(file_.corners.size() - 1, -1);
    file_.coordinates_of.push_back(static_cast<std::int32_t>(value - 1));
  }

  /// Converts an index that counts from 1, or backwards from -1, to one that counts from 0. Forward references are
  /// legal, so finish() checks the ranges.
  std::int32_t index(std::string_view word, std::size_t count, std::string_view kind) {
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size())
      fail_here("face has '{}' where the number of a {} is expected", word.substr(0, 40), kind);
    if (value < -static_cast<std::int64_t>(count)) {
      if (kind == kNormal) return kAbsent;
      fail_here("face names {} {}, but the file has {} up to here", kind, value, count);
    }
    if (value == 0) fail_here("face names {} 0; numbers begin at 1", kind);
    if (value > static_cast<std::int64_t>(kMaxCount))
      fail_here("face names {} {}, more than a file can have", kind, value);
    return static_cast<std::int32_t>(value > 0 ? value - 1 : static_cast<std::int64_t>(count) + value);
  }

  void face(std::string_view line) {
    ObjFace face{.first = static_cast<std::uint32_t>(file_.corners.size()),
                 .material = material_,
                 .smoothing = smoothing_,
                 .line = line_};
    for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
      const std::size_t slash = word.find('/');
      ObjCorner corner{.vertex = index(word.substr(0, slash), vertices_.size(), "vertex")};
      const std::size_t second = slash == std::string_view::npos ? slash : word.find('/', slash + 1);
      if (second != std::string_view::npos && second + 1 < word.size())
        corner.normal = index(word.substr(second + 1), file_.normals.size(), kNormal);
      file_.corners.push_back(corner);
      if (slash != std::string_view::npos) coordinate_of_corner(word.substr(slash + 1, second - slash - 1));
      ++face.count;
    }
    if (file_.corners.size() > kMaxCount)
      fail_here("is corner {} of a face; expected at most {}", kMaxCount, kMaxCount);
    if (face.count >= 3) {
      if (file_.faces.empty()) left_at_first_ = lines_.left();
      enter_group();
      file_.faces.push_back(face);
      if (file_.faces.size() == kTelling) reserve();
    } else {
      file_.corners.resize(face.first);
      if (file_.coordinates_of.size() > face.first) file_.coordinates_of.resize(face.first);
      ++small_faces_;
    }
  }

  /// Makes room for as many faces as the rest of the file can be expected to have, so that the arrays need not grow.
  void reserve() {
    const double of_face = double(left_at_first_ - lines_.left()) / double(kTelling);
    const double most = 1.1 * double(left_at_first_) / std::max(of_face, 8.0) + double(kTelling);
    file_.corners.reserve(std::size_t(most * double(file_.corners.size()) / double(kTelling)));
    file_.faces.reserve(std::size_t(most));
  }

  void smoothing(std::string_view group) {
    smoothing_ = group == "on" ? 1 : 0;
    std::from_chars(group.data(), group.data() + group.size(), smoothing_);
  }

  /// Notes the group of the faces that follow. Its name may hold a '#', but not where a word begins.
  void begin_group(std::string_view name) {
    for (std::size_t at = name.find('#'); at != std::string_view::npos; at = name.find('#', at + 1))
      if (at == 0 || name[at - 1] == ' ' || name[at - 1] == '\t') name = name.substr(0, at);
    group_ = trimmed(name);
    if (group_.empty()) group_ = "default";
    begins_group_ = true;
  }

  /// Puts the next face into its group. A group of the same name as the one before it goes on.
  void enter_group() {
    if (!std::exchange(begins_group_, false)) return;
    const auto [entry, fresh] = group_of_.try_emplace(group_, static_cast<std::uint32_t>(file_.names.size()));
    if (fresh) file_.names.push_back(group_);
    if (file_.groups.empty() || file_.groups.back().name != entry->second)
      file_.groups.push_back({static_cast<std::uint32_t>(file_.faces.size()), entry->second});
  }

  /// Returns the material of a name, which may hold a '#', or else be followed by a comment.
  std::uint32_t material_named(std::string_view whole) {
    const std::string name(without_comment(whole));
    for (const std::string& each : {std::string(whole), name})
      if (const auto found = material_of_.find(each); found != material_of_.end()) return found->second;
    if (missing_.insert(name).second)
      file_.notes.push_back(fmt::format("The material '{}' is not in its MTL files; the default was used.", name));
    return kNoMaterial;
  }

  void library(std::string_view names) {
    if (try_library(names)) return;  // the rest of the line as one name with spaces
    while (!names.empty()) {
      const std::string_view name = next_word(names);
      if (!name.empty() && !try_library(name))
        file_.notes.push_back(
            fmt::format("The material file '{}' was not found; its materials are the default.", name));
    }
  }

  /// Reads the materials of an MTL file, unless they were read before. Returns false if there is no such file. One that
  /// the scene may not name gives a note.
  bool try_library(std::string_view name) {
    std::string text{name};
    std::ranges::replace(text, '\\', '/');
    if (text.empty()) return false;
    const auto [known, fresh] = libraries_.try_emplace(text, false);
    if (!fresh) return known->second;
    const std::string reason = why_refused(path_, text, options_.allow_outside);
    if (!reason.empty())
      file_.notes.push_back(fmt::format("The material file '{}' {}; it was left out.", text, reason));
    known->second = !reason.empty() || read_library(text);
    return known->second;
  }

  bool read_library(const std::string& name) {
    std::error_code error;  // of a file that does not exist
    const std::string canonical = std::filesystem::canonical(path_.parent_path() / name, error).string();
    if (library_files_.contains(canonical)) return true;  // one file may have several names
    const std::size_t first = file_.materials.size();
    if (!read_mtl(path_, name, file_)) return false;
    library_files_.insert(canonical);
    // The last material of a name wins, so that a later library can override an earlier one.
    for (std::size_t i = first; i < file_.materials.size(); ++i)
      material_of_.insert_or_assign(file_.materials[i].name, static_cast<std::uint32_t>(i));
    for (std::size_t i = first; i < file_.materials.size(); ++i)  // a name may be followed by a comment
      material_of_.try_emplace(std::string(without_comment(file_.materials[i].name)), static_cast<std::uint32_t>(i));
    return true;
  }

  void finish() {
    file_.origin = vertices_.settle();
    file_.vertices = vertices_.take();
    if (!file_.colors.empty()) file_.colors.resize(file_.vertices.size(), glm::vec3(1));
    if (!file_.coordinates_of.empty()) file_.coordinates_of.resize(file_.corners.size(), -1);
    for (std::int32_t& each : file_.coordinates_of)
      if (each >= static_cast<std::int32_t>(file_.coordinates.size())) each = -1;
    const auto check = [&](const ObjFace& face, std::int32_t index, std::size_t count, const char* kind) {
      if (index < static_cast<std::int32_t>(count)) return;
      line_ = face.line;
      fail_here("face names {} {}, but the file has {}", kind, index + 1, count);
    };
    for (const ObjFace& face : file_.faces)
      for (std::uint32_t i = 0; i < face.count; ++i) {
        check(face, file_.corners[face.first + i].vertex, file_.vertices.size(), "vertex");
        std::int32_t& normal = file_.corners[face.first + i].normal;
        if (normal < static_cast<std::int32_t>(file_.normals.size())) continue;
        if (absent_normals_++ == 0) absent_line_ = face.line;
        normal = -1;
      }
    if (absent_normals_ > 0)
      file_.notes.push_back(
          fmt::format("{} corners of faces, the first in line {}, name normals that the file lacks; they are shaded "
                      "without.",
                      absent_normals_, absent_line_));
    if (small_faces_ > 0)
      file_.notes.push_back(fmt::format("{} faces of fewer than 3 corners were left out.", small_faces_));
    std::vector<std::string> counts;
    for (const auto& [keyword, count] : left_out_) counts.push_back(fmt::format("{} ({})", keyword, count));
    if (!counts.empty())
      file_.notes.push_back(
          fmt::format("Statements that Ballot does not read were left out: {}.", fmt::join(counts, ", ")));
  }

  std::filesystem::path path_;
  LoadOptions options_;
  TextLines lines_;
  ObjFile file_;
  FileVertices vertices_;  // of file_, until its end
  std::uint32_t line_ = 0, material_ = kNoMaterial, smoothing_ = 0;
  static constexpr std::size_t kTelling = 4096;  // faces after which the number of all can be told
  std::uint64_t left_at_first_ = 0;              // bytes of the file behind the first face
  std::size_t known_ = 0, small_faces_ = 0, absent_normals_ = 0;
  std::uint32_t absent_line_ = 0;                               // of the first
  std::string unknown_;                                         // the first keyword that is none of OBJ
  std::map<std::string, std::size_t, std::less<>> left_out_;    // statements by keyword
  std::set<std::string> missing_;                               // names of absent materials
  std::unordered_map<std::string, std::uint32_t> material_of_;  // by name, into ObjFile::materials
  std::string group_;                                           // of the next face
  bool begins_group_ = true;                                    // with the next face
  std::unordered_map<std::string, std::uint32_t> group_of_;     // by name, into ObjFile::names
  std::unordered_map<std::string, bool> libraries_;             // by name in the file: found or not
  std::set<std::string> library_files_;                         // canonical paths
};

}  // namespace

ObjFile read_obj(const std::filesystem::path& path, const LoadOptions& options) { return Parser(path, options).run(); }

}  // namespace ballot
