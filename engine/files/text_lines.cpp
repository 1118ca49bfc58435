#include "engine/files/text_lines.h"

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "engine/core/memory.h"
#include "engine/files/flaw.h"
#include "engine/files/text_mark.h"

namespace ballot {

namespace {
constexpr std::string_view kTextSpace = " \t\r\v\f";
}

std::string_view trimmed(std::string_view text) {
  const std::size_t start = text.find_first_not_of(kTextSpace);
  if (start == std::string_view::npos) return {};
  return text.substr(start, text.find_last_not_of(kTextSpace) - start + 1);
}

std::string_view next_word(std::string_view& text) {
  const std::size_t start = text.find_first_not_of(kTextSpace);
  if (start == std::string_view::npos) return text = {};
  const std::size_t end = std::min(text.find_first_of(kTextSpace, start), text.size());
  const std::string_view word = text.substr(start, end - start);
  text.remove_prefix(end);
  return word;
}

TextLines::TextLines(const std::filesystem::path& path, std::string_view format)
    : path_(path), format_(format), file_(open_file(path)) {
  std::error_code unknown;
  bytes_ = std::filesystem::file_size(path, unknown);
  if (unknown) bytes_ = 0;
  need_memory(bytes_, path.string());  // about as much as becomes of it
}

bool TextLines::next(std::string_view& line) {
  std::size_t end = line_end();
  while (end == std::string::npos && read()) end = line_end();
  if (at_ == block_.size()) return false;
  std::size_t length = std::min(end, block_.size()) - at_;
  const bool cr = end < block_.size() && block_[end] == '\r';
  if (cr && end + 1 == block_.size()) read();  // the next block may begin with the LF of this CR
  line = std::string_view(block_).substr(at_, length);
  length += cr && at_ + length + 1 < block_.size() && block_[at_ + length + 1] == '\n';
  at_ = std::min(at_ + length + 1, block_.size());
  return true;
}

std::uint64_t TextLines::left() const {
  const std::uint64_t taken = read_ - (block_.size() - at_);
  return bytes_ - std::min(bytes_, taken);
}

/// Returns the place of the next LF or CR in the block; npos if it has none.
std::size_t TextLines::line_end() {
  if (lf_ < at_) lf_ = block_.find('\n', at_);
  if (cr_ < at_) cr_ = block_.find('\r', at_);
  return std::min(lf_, cr_);
}

/// Reads a block behind what is left of the last one. Returns false at the end of the file.
bool TextLines::read() {
  constexpr std::size_t kBlock = 1 << 20;
  const std::size_t gone = std::exchange(at_, 0);
  block_.erase(0, gone);
  const std::size_t kept = block_.size();
  block_.resize(kept + kBlock);
  const std::size_t count = std::fread(block_.data() + kept, 1, kBlock, file_.get());
  if (std::ferror(file_.get())) refuse("cannot be read: {}", std::generic_category().message(errno));
  block_.resize(kept + count);
  if (read_ == 0) at_ = count - without_mark(path_, block_).size();
  if (const std::size_t zero = block_.find('\0', kept); zero != std::string::npos)
    refuse("is not {}: byte {} is zero, and {} is text; check the file's type", format_, read_ + zero - kept, format_);
  read_ += count;
  const auto follow = [&](std::size_t& place, char c) {
    if (place != std::string::npos && place >= gone)
      place -= gone;
    else
      place = block_.find(c, place == std::string::npos ? kept : 0);
  };
  follow(lf_, '\n');
  follow(cr_, '\r');
  return count > 0;
}

}  // namespace ballot
