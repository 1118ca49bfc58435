// Reads MTL materials, with the habits of the programs that write them, and converts them to Ballot's.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <glm/common.hpp>
#include <optional>
#include <set>

#include "engine/files/loaders.h"
#include "engine/files/obj_file.h"
#include "engine/files/text_lines.h"

namespace ballot {
namespace {

/// A material as the file has it; what it lacks, or has in a form that cannot be read, is absent.
struct MtlMaterial {
  std::string name;
  std::optional<glm::vec3> kd, ks, ke, tf;
  std::optional<float> ns, ni, d, tr, pm, pr, illum;
  ObjMap map;
};

float largest(const glm::vec3& c) { return std::max({c.x, c.y, c.z}); }

std::string lower_case(std::string_view word) {
  std::string text(word);
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 'a' - 'A');
  return text;
}

/// Returns a word as a finite number, if it is one.
std::optional<float> finite_number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(float(value))) return std::nullopt;
  return float(value);
}

/// Reads a colour from 0 to `most`: r g b, or one number for grey, or xyz and the like of CIE XYZ.
std::optional<glm::vec3> color_in(std::string_view text, float most) {
  std::string_view rest = text;
  const bool xyz = lower_case(next_word(rest)) == "xyz";
  if (!xyz) rest = text;
  std::array<float, 3> values{};
  std::size_t count = 0;
  for (std::string_view word = next_word(rest); !word.empty() && count < 3; word = next_word(rest)) {
    const std::optional<float> value = finite_number(word);
    if (!value) return std::nullopt;
    values[count++] = *value;
  }
  if (count != 1 && count != 3) return std::nullopt;
  glm::vec3 color = count == 1 ? glm::vec3(values[0]) : glm::vec3(values[0], values[1], values[2]);
  if (xyz)  // to linear Rec.709, IEC 61966-2-1
    color = {3.2406f * color.x - 1.5372f * color.y - 0.4986f * color.z,
             -0.9689f * color.x + 1.8758f * color.y + 0.0415f * color.z,
             0.0557f * color.x - 0.2040f * color.y + 1.0570f * color.z};
  return glm::clamp(color, 0.0f, most);
}

/// Parses an MTL file into materials, and tells what of it was left out or read by a rule.
class MtlParser {
 public:
  MtlParser(const std::filesystem::path& path, const std::filesystem::path& name, ObjFile& file)
      : lines_(path, "MTL"), name_(name), file_(file) {}

  void run() {
    std::string_view line;
    for (; lines_.next(line); ++line_) {
      const std::string keyword = lower_case(next_word(line));
      if (!keyword.empty() && keyword[0] != '#') statement(keyword, trimmed(line));
    }
    finish();
    if (!left_out_.empty())
      note("{} of its materials are not read; these are drawn without.", fmt::join(left_out_, ", "));
    if (unreadable_ > 0)
      note("{} values, the first in line {}, are none that Ballot reads; the materials are as without them.",
           unreadable_, first_unreadable_);
  }

 private:
  template <class... Args>
  void note(fmt::format_string<Args...> text, Args&&... args) {
    file_.notes.push_back(
        fmt::format("The material file '{}': {}", name_.string(), fmt::format(text, std::forward<Args>(args)...)));
  }

  /// Reads a statement, whose keyword is in lower case. Those before the first material change nothing.
  void statement(const std::string& keyword, std::string_view rest) {
    if (keyword == "newmtl") {
      finish();
      now_.name = rest;
      if (!rest.empty() && !names_.insert(now_.name).second && twice_.insert(now_.name).second)
        note("the material '{}' is defined again; the last definition holds.", now_.name);
      return;
    }
    for (const auto& [word, to, most] :
         {std::tuple("kd", &now_.kd, 1.0f), {"ks", &now_.ks, 1.0f}, {"ke", &now_.ke, 1e6f}, {"tf", &now_.tf, 1.0f}})
      if (keyword == word) return set(*to, color_in(rest, most));
    for (const auto& [word, to] : {std::pair("ns", &now_.ns),
                                   {"ni", &now_.ni},
                                   {"d", &now_.d},
                                   {"tr", &now_.tr},
                                   {"pm", &now_.pm},
                                   {"pr", &now_.pr},
                                   {"illum", &now_.illum}})
      if (keyword == word) return set(*to, last_number(rest));
    if (keyword == "map_kd") return map(rest);
    if (keyword.starts_with("map_") || std::ranges::count(kMaps, keyword) > 0) left_out_.insert(keyword);
    const bool coat = keyword == "ps" || keyword == "pc" || keyword == "aniso";  // sheen, clearcoat, anisotropy
    if (coat && last_number(rest).value_or(0) > 0) left_out_.insert(keyword);
  }

  /// Sets a value. One that cannot be read is absent, and counted.
  template <class T>
  void set(std::optional<T>& to, const std::optional<T>& value) {
    to = value;
    if (!value && unreadable_++ == 0) first_unreadable_ = line_;
  }

  /// Returns a number, which "-halo" may stand before.
  static std::optional<float> last_number(std::string_view rest) {
    std::string_view word = next_word(rest);
    if (word == "-halo") word = next_word(rest);
    return finite_number(word);
  }

  /// Reads the options of a map, and its name: the rest of the line, which may hold spaces.
  void map(std::string_view rest) {
    ObjMap map{.folder = name_.parent_path()};
    while (true) {
      std::string_view behind = rest;
      const std::string option = lower_case(next_word(behind));
      std::array<float, 3> values{};
      std::size_t count = 0;
      if (option == "-s" || option == "-o" || option == "-t") {
        while (count < 3) {
          std::string_view more = behind;
          const std::optional<float> value = finite_number(next_word(more));
          if (!value) break;
          values[count++] = *value;
          behind = more;
        }
        glm::vec2& to = option == "-s" ? map.scale : map.offset;
        for (int i = 0; i < 2 && option != "-t"; ++i)
          if (std::size_t(i) < count) to[i] = values[std::size_t(i)];
      } else if (std::ranges::count(kOptions, option) > 0) {
        const std::string value = lower_case(next_word(behind));
        if (option == "-clamp") map.clamp = value == "on";
        if (option == "-mm") next_word(behind);
      } else {
        break;
      }
      rest = behind;
    }
    rest = trimmed(rest);
    if (rest.size() > 1 && rest.front() == '"' && rest.back() == '"') rest = rest.substr(1, rest.size() - 2);
    map.name = rest;
    std::ranges::replace(map.name, '\\', '/');
    now_.map = std::move(map);
  }

  /// Converts the material so far, if there is one.
  void finish() {
    if (!now_.name.empty()) {
      file_.materials.push_back(converted());
      file_.maps.push_back(now_.map);
    }
    now_ = {};
  }

  /// Returns how much of a surface is there. d is taken before Tr, which is 1 - d. Tr 1 alone is opaque: so older
  /// versions of MeshLab, OpenMVS and 3ds Max write it.
  float dissolve() {
    if (now_.d && *now_.d <= 0) note("the material '{}' is invisible: its d is {}.", now_.name, *now_.d);
    if (now_.d) return std::clamp(*now_.d, 0.0f, 1.0f);
    if (!now_.tr || *now_.tr < 1) return 1 - std::clamp(now_.tr.value_or(0), 0.0f, 1.0f);
    if (!told_opaque_)
      note("'Tr 1' without d was read as opaque, as some programs mean it; 'd 0' is invisible. The first: '{}'.",
           now_.name);
    told_opaque_ = true;
    return 1;
  }

  /// Returns the diffuse colour. A map of colours shows as it is where Kd is absent or black.
  glm::vec3 diffuse() {
    const bool map = !now_.map.name.empty(), black = now_.kd && largest(*now_.kd) <= 0;
    if (map && black && !told_black_) {
      note("a black Kd beside a map_Kd was read as white. The first: '{}'.", now_.name);
      told_black_ = true;
    }
    if (!map && !now_.kd && !told_white_) {
      note("materials without Kd are white, as without a material. The first: '{}'.", now_.name);
      told_white_ = true;
    }
    return now_.kd && !(map && black) ? *now_.kd : glm::vec3(1);
  }

  /// Converts the material. Illumination models 4, 6, 7 and 9 become glass. A dissolve below 1 becomes a transmission
  /// of 1 - d. Models 3 and 5 become mirrors if a component of Ks is at least 0.5. Else Pm and Pr give metallic and
  /// roughness; without Pr a Phong exponent n becomes the roughness (2 / (n + 2))^(1/4), the usual match of the lobes.
  Material converted() {
    constexpr float kMirrorSpecular = 0.5f;
    const glm::vec3 specular = now_.ks.value_or(glm::vec3(0)), filter = now_.tf.value_or(glm::vec3(0));
    const float illum = now_.illum.value_or(0), ior = now_.ni.value_or(1), exponent = now_.ns.value_or(1);
    const bool glass = illum == 4 || illum == 6 || illum == 7 || illum == 9;
    Material to{.name = now_.name};
    to.emissive = now_.ke.value_or(glm::vec3(0));
    if (const float there = dissolve(); glass || there < 1) {
      to.transmission = glass ? 1.0f : 1.0f - there;
      to.ior = ior > 1 && ior < 10 ? ior : (glass ? 1.5f : 1.0f);
      to.roughness = 0;
      to.base_color = largest(filter) > 0 ? filter : now_.kd.value_or(glm::vec3(1));
      if (largest(to.base_color) <= 0) to.base_color = glm::vec3{1};
      return to;
    }
    if ((illum == 3 || illum == 5) && largest(specular) >= kMirrorSpecular) {
      to.metallic = 1;
      to.roughness = 0;
      to.base_color = specular;
      if (!std::exchange(now_.map, {}).name.empty()) left_out_.insert("map_kd (of mirrors)");
      return to;
    }
    to.base_color = diffuse();
    to.metallic = std::clamp(now_.pm.value_or(0), 0.0f, 1.0f);
    if (now_.pr.value_or(0) > 0)
      to.roughness = std::min(*now_.pr, 1.0f);
    else if (largest(specular) > 0 && exponent > 0)
      to.roughness = std::pow(2.0f / (exponent + 2.0f), 0.25f);
    return to;
  }

  static constexpr std::array<std::string_view, 5> kMaps{"bump", "disp", "decal", "refl", "norm"};
  static constexpr std::array<std::string_view, 10> kOptions{"-blendu",  "-blendv", "-boost",  "-cc", "-clamp",
                                                             "-imfchan", "-mm",     "-texres", "-bm", "-type"};
  TextLines lines_;
  std::filesystem::path name_;
  ObjFile& file_;
  MtlMaterial now_;
  std::size_t line_ = 1, unreadable_ = 0, first_unreadable_ = 0;
  std::set<std::string> names_, twice_, left_out_;
  bool told_opaque_ = false, told_black_ = false, told_white_ = false;
};

}  // namespace

bool read_mtl(const std::filesystem::path& obj, const std::filesystem::path& name, ObjFile& file) {
  const std::filesystem::path path = obj.parent_path() / name;
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;
  naming(path, [&] { MtlParser(path, name, file).run(); });
  return true;
}

}  // namespace ballot
