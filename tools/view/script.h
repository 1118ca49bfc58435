// The script of `ballot view --script FILE`: commands that replace user input, one a line.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace ballot::view {

struct ScriptLine {
  std::size_t number = 0;  // line number in the file, from 1
  std::vector<std::string> words;
};

/// Reads a script. Spaces separate words, and '#' begins a comment. Throws Error(Work) if the file cannot be read, and
/// Error(Arguments) that names the line for an unknown command or a wrong number of words.
std::vector<ScriptLine> read_script(const std::filesystem::path& path);
std::vector<ScriptLine> parse_script(const std::string& text, const std::string& name);

/// Parses a duration: "0.5s" gives 0.5 seconds; "10", a number of frames, gives -10. Throws Error(Arguments).
double duration_of(const ScriptLine& line, const std::string& word);

/// Parses a number of pixels or seconds. Throws Error(Arguments).
double number_of(const ScriptLine& line, const std::string& word);

/// Returns the GLFW key of a name such as "W", "1", "F12" or "TAB". Throws Error(Arguments).
int key_of(const ScriptLine& line, const std::string& word);

/// Returns a line for each command, for help texts.
std::string script_help();

}  // namespace ballot::view
