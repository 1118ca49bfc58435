// Lookup by name in a registry: an array whose rows have a `name`.
#pragma once

#include <string>
#include <string_view>

#include "engine/core/error.h"

namespace ballot {

/// The names of all rows, separated by commas, in the order of the registry.
template <class Rows>
std::string names_of(const Rows& rows) {
  std::string names;
  for (const auto& row : rows) names += fmt::format("{}{}", names.empty() ? "" : ", ", row.name);
  return names;
}

/// The row with this name; null if there is none.
template <class Rows>
auto find_row(const Rows& rows, std::string_view name) -> decltype(&*std::begin(rows)) {
  for (const auto& row : rows)
    if (row.name == name) return &row;
  return nullptr;
}

/// The row with this name. `what` is what a row is called in the error: "traversal method".
/// Throws Error(Arguments) that lists the names there are.
template <class Rows>
const auto& find_named(const Rows& rows, std::string_view name, std::string_view what) {
  if (const auto* row = find_row(rows, name)) return *row;
  fail(Failure::Arguments, "no {} is called '{}'; there are: {}", what, name, names_of(rows));
}

}  // namespace ballot
