// Reads glTF animations: their key frames and what these move. Internal to engine/files.
#pragma once

#include "engine/files/gltf_file.h"
#include "engine/model/animation.h"

namespace ballot {

/// Reads the animations of a file, whose nodes `to` has already. Notes those without channels and channels that move
/// nothing that Ballot knows. Throws Error(Work) on samplers and accessors that are missing or do not fit, and on times
/// and values that are out of order or not finite.
void read_clips(GltfFile& file, Animation& to);

}  // namespace ballot
