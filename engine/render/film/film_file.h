// Films on disk: checkpoints from which another process can continue a picture and get the same bits.
#pragma once

#include <filesystem>
#include <string>

#include "engine/render/film/film.h"

namespace ballot {

/// Writes a film atomically, as an EXR with float32 channels of sums that other programs can display. A link at its
/// path is replaced. `made_of` lists everything that determines the film's bits, one "name: value" line each
/// (DeviceScene::made_of).
/// Throws Error(Work) if the file cannot be written, Error(Arguments) for a film with counters, which are not stored.
void write_film(const std::filesystem::path& path, const Film& film, const std::string& made_of);

/// Reads a file of write_film into `film`, which must be as start_film() makes it.
/// Throws Error(Work) if the file cannot be read, is not a film of this size with at most `most` samples, or holds sums
/// that are no numbers, and if its `made_of` differs: the error names the first line that differs.
void read_film(const std::filesystem::path& path, Film& film, const std::string& made_of, std::uint32_t most);

}  // namespace ballot
