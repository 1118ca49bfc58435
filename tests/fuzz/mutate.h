// Changes of inputs: of bytes, of the values of a JSON text, and of the JSON and the buffer of a glTF file.
#pragma once

#include <functional>
#include <random>

#include "tests/fuzz/fuzz.h"

namespace ballot::fuzz {

using Random = std::mt19937;

/// Changes bytes, in place or to another length of at most `most`.
using BytesChange = std::function<void(std::string& bytes, std::size_t most)>;

/// Returns a change of a few bytes: bits, numbers of the edges of types, pieces that are removed, doubled or moved, and
/// words of the format. It keeps references to both arguments.
BytesChange simple_change(Random& random, const std::vector<std::string>& words);

/// Changes an input of the form of the target. Its length stays at most `most`. Inputs that are not of that form are
/// changed as bytes.
void mutate(std::string& input, const Target& target, std::size_t most, Random& random, const BytesChange& change);

}  // namespace ballot::fuzz
