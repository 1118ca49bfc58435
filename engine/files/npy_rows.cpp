#include "engine/files/npy_rows.h"

namespace ballot {

Rows rows_of(const NpyFile& file) {
  const NpyHeader& header = file.header();
  const std::vector<std::uint64_t> shape = header.shape.value_or(std::vector<std::uint64_t>{});
  const std::string& descr = header.descr;  // such as "'<f4'"
  const bool plain = descr.size() == 5 && descr[0] == '\'' && (descr[1] == '<' || descr[1] == '|');
  if (!plain || descr[3] < '1' || descr[3] > '8') return {};
  Rows rows{.kind = descr[2], .bytes = static_cast<std::size_t>(descr[3] - '0')};
  if (shape.size() == 2) rows.count = shape[0], rows.width = shape[1];
  if (shape.size() == 3 && shape[1] == 3 && shape[2] == 3) rows.count = shape[0], rows.width = 9;
  return rows;
}

}  // namespace ballot
