// Reads the lines of text formats. Internal to engine/files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "engine/core/file.h"

namespace ballot {

/// Returns a text without the spaces around it.
std::string_view trimmed(std::string_view text);

/// Removes the next word from `text` and returns it; empty at the end of the text.
std::string_view next_word(std::string_view& text);

/// The lines of a file, which is read in blocks. They end by LF, CR LF or CR. A byte order mark is skipped.
class TextLines {
 public:
  /// Opens the file of a format, such as "OBJ". Throws Error(Work) if it cannot be read. next() throws Flaw if it holds
  /// a zero byte, Error(Work) if it is UTF-16.
  TextLines(const std::filesystem::path& path, std::string_view format);

  /// Gives the next line without its end, which stays valid until the next call. Returns false at the end of the file.
  bool next(std::string_view& line);

  /// Returns the bytes behind the lines so far.
  std::uint64_t left() const;

 private:
  bool read();
  std::size_t line_end();

  std::filesystem::path path_;
  std::string format_;
  InputStream file_;
  std::string block_;
  std::size_t at_ = 0;                                           // in the block
  std::size_t lf_ = std::string::npos, cr_ = std::string::npos;  // the next of each in the block
  std::uint64_t bytes_ = 0, read_ = 0;                           // of the file
};

}  // namespace ballot
