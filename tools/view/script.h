// `ballot view --script FILE`: what hands would do, a line each.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace ballot::view {

struct ScriptLine {
  std::size_t number = 0;  // in the file, from 1
  std::vector<std::string> words;
};

/// Reads a script: words are separated by spaces, '#' begins a comment. Throws Error(Work) if the file cannot be read,
/// Error(Arguments) with the line's number for a command that there is not, or with a wrong count of words.
std::vector<ScriptLine> read_script(const std::filesystem::path& path);
std::vector<ScriptLine> parse_script(const std::string& text, const std::string& name);

/// Seconds of "0.5s"; frames of "10" as negative numbers. Throws Error(Arguments).
double duration_of(const ScriptLine& line, const std::string& word);

/// Pixels. Throws Error(Arguments).
double number_of(const ScriptLine& line, const std::string& word);

/// A GLFW key of "W", "1", "F12", "TAB". Throws Error(Arguments).
int key_of(const ScriptLine& line, const std::string& word);

/// One line per command, for help texts.
std::string script_help();

}  // namespace ballot::view
