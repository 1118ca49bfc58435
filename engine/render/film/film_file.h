// Films on disk: checkpoints, from which another process goes on with the same bits.
#pragma once

#include <filesystem>
#include <string>

#include "engine/render/film/film.h"

namespace ballot {

/// Writes a film atomically, as an EXR of float32 sums, which others can look at. `made_of` says, a line each ("name: value"),
/// what decides its bits. Throws Error(Work); Error(Arguments) for a film with counters, which are not kept.
void write_film(const std::filesystem::path& path, const Film& film, const std::string& made_of);

/// Reads into `film`, which is as start_film() makes it, what write_film wrote. Throws Error(Work) if the file cannot be read or is no
/// film, and if it is of another `made_of`: the error names the first line that differs.
void read_film(const std::filesystem::path& path, Film& film, const std::string& made_of);

}  // namespace ballot
