// Suggests a name for a word that is spelt wrong.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace ballot {

/// Returns how many letters have to be inserted, left out, replaced or swapped with a neighbour to make one word of the
/// other.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// Returns " (did you mean 'NAME'?)" with the name that is nearest to the word; "" if none is near: at most one letter
/// in three may differ.
std::string did_you_mean(std::string_view word, std::span<const std::string_view> names);

}  // namespace ballot
