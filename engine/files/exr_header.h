// The header of an EXR file, read with bounds before OpenEXR sees the file: OpenEXR takes what a header claims.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>

namespace ballot {

/// Checks an EXR file that is open at its start: one flat part without subsampled channels, whose attributes lie in the
/// file, and whose picture, tiles and table of chunks are not far larger than the file can hold. With `pixels` set, the
/// picture and what decodes it, by so many threads of OpenEXR, must fit into the memory that is left (memory.h); the
/// header always must. Leaves the file where it pleases. `name` is for that message. Throws std::invalid_argument with
/// the reason, and Error(Work).
void check_exr_header(std::FILE* file, const std::filesystem::path& name, bool pixels, int threads);

}  // namespace ballot
