// Makes skies of words: constant, gradient, or a picture.
#pragma once

#include <string>

#include "engine/model/light.h"

namespace ballot {

/// Returns the sky that a word describes: "none"; "R,G,B" for a constant sky; "gradient" or
/// "gradient:R,G,B:R,G,B:R,G,B" (zenith, horizon, ground); or the path of an EXR with R, G, B that is twice as wide as
/// high, longitude by latitude. The values are radiance, finite and not below 0.
/// Throws Error(Arguments) for any other word, Error(Work) for a picture that cannot be used.
Sky make_sky(const std::string& word);

}  // namespace ballot
