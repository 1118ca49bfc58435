// Tests the layering of the sources: dependencies point one way, and no file has more than 400 lines.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kCompiled{".h", ".cpp", ".comp", ".glsl"}, kRead{".h", ".cpp", ".comp", ".glsl", ".py"};

std::vector<fs::path> sources(const char* folder, const std::vector<std::string>& extensions = kCompiled) {
  std::vector<fs::path> all;
  for (const auto& e : fs::recursive_directory_iterator(fs::path(BALLOT_SOURCE_DIR) / folder)) {
    if (std::ranges::count(extensions, e.path().extension().string()) > 0) all.push_back(e.path());
  }
  return all;
}

std::vector<std::string> includes(const fs::path& file) {
  std::ifstream in(file);
  std::vector<std::string> all;
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("#include")) all.push_back(line);
  return all;
}

int floor_of(const std::string& path) {
  const std::vector<std::string> floors{
      "engine/core",         "engine/model",       "engine/files",       "engine/tree/host",   "engine/tree/formats",
      "engine/oracle",       "engine/gpu",         "engine/tree/device", "engine/answer",      "engine/render/data",
      "engine/render/batch", "engine/render/path", "engine/render/film", "engine/render/live", "engine/present",
      "engine/scene",        "engine/api"};
  for (std::size_t i = 0; i < floors.size(); ++i)
    if (path.find(floors[i] + "/") != std::string::npos) return int(i);
  return path.find("engine/") != std::string::npos ? int(floors.size()) : -1;
}

TEST(Layering, DependenciesPointOneWay) {
  for (const fs::path& file : sources("engine"))
    for (const std::string& line : includes(file)) {
      const int there = floor_of(line);
      EXPECT_TRUE(there < 0 || there <= floor_of(file.string())) << file << ": " << line;
    }
}

TEST(Layering, ModelFilesAndHostTreesKnowNoVulkan) {
  for (const char* folder :
       {"engine/core", "engine/model", "engine/files", "engine/tree/host", "engine/tree/formats", "engine/oracle"})
    for (const fs::path& file : sources(folder))
      for (const std::string& line : includes(file))
        EXPECT_EQ(line.find("vulkan"), std::string::npos) << file << ": " << line;
}

// Other rooms record commands and ask for facts of the device without Vulkan's types (engine/gpu/commands.h). What
// programs with Vulkan of their own read names theirs.
TEST(Layering, OnlyTheDeviceAndTheWindowSpeakVulkan) {
  const std::regex vulkan(R"(\b(Vk[A-Z]|vk_check|vk\(\)|VK_(?!KHR_|EXT_)))");  // extensions are named in comments
  for (const fs::path& file : sources("engine")) {
    const std::string room = file.parent_path().filename().string();
    if (room == "gpu" || room == "present" || file.filename() == "ballot_c_vulkan.h") continue;
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);)
      EXPECT_FALSE(std::regex_search(line, vulkan)) << file << ": " << line;
  }
}

TEST(Layering, ToolsSeeThePublicHeaderOnly) {
  for (const fs::path& file : sources("tools"))
    for (const std::string& line : includes(file))
      EXPECT_TRUE(line.find("\"engine/") == std::string::npos || line == "#include \"engine/scene/device_scene.h\"" ||
                  (file.filename() == "option_rows.h" && line == "#include \"engine/api/query.h\""))
          << file << ": " << line;
}

TEST(Layering, FilesStayReadable) {
  for (const char* folder : {"engine", "shaders", "tools", "tests"})
    for (const fs::path& file : sources(folder, kRead)) {
      std::ifstream in(file);
      const auto lines = std::count(std::istreambuf_iterator<char>(in), {}, '\n');
      EXPECT_LE(lines, 400) << file;
    }
}

TEST(Layering, LinesFitTheScreen) {
  for (const char* folder : {"engine", "shaders", "tools", "tests"})
    for (const fs::path& file : sources(folder, kRead)) {
      if (file.filename().string().starts_with("knobs") && file.parent_path().filename() == "shared")
        continue;  // generated
      std::ifstream in(file);
      int number = 0;
      for (std::string line; std::getline(in, line);) {
        ++number;
        const auto is_start = [](char c) { return (c & 0xC0) != 0x80; };  // of a UTF-8 character
        EXPECT_LE(std::ranges::count_if(line, is_start), 120) << file << ":" << number;
      }
    }
}

TEST(Layering, TheNoticeNamesWhatIsLinked) {
  const auto letters = [](const std::string& text) {
    std::string kept;
    for (const char c : text)
      if (std::isalnum(static_cast<unsigned char>(c))) kept += char(std::tolower(static_cast<unsigned char>(c)));
    return kept;
  };
  const fs::path root = BALLOT_SOURCE_DIR;
  std::ifstream file(root / "engine/api/python/NOTICE");
  const std::string notice = letters(std::string(std::istreambuf_iterator<char>(file), {}));
  for (const char* lists : {"CMakeLists.txt", "tools/CMakeLists.txt"}) {
    std::ifstream in(root / lists);
    for (std::string line; std::getline(in, line);) {
      const std::string call = "find_package(";
      if (!line.starts_with(call)) continue;
      const std::string name = line.substr(call.size(), line.find_first_of(" )", call.size()) - call.size());
      EXPECT_TRUE(name == "Threads" || notice.find(letters(name).substr(0, 10)) != std::string::npos) << name;
    }
  }
}

}  // namespace
