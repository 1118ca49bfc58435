// How the linear values of a picture become the colours of a screen.
#pragma once

#include <array>

namespace ballot {

struct Image;

/// A tone mapping.
struct Tone {
  bool neutral = false;  // by Khronos PBR Neutral; else what is above 1 is cut off
  float exposure = 0;    // stops: values are multiplied by 2^exposure before
};

/// Maps a linear Rec.709 colour to [0, 1], linear too. A component that is no number, or below 0, becomes 0.
///
/// Source: Khronos PBR Neutral Tone Mapper, specification of 2024-05: what is darker than 0.8 keeps hue and saturation,
/// but for 0.04 that stand for reflection at the surface; brighter colours are compressed, and lose saturation slowly.
std::array<float, 3> toned(const std::array<float, 3>& color, const Tone& tone);

/// Notes a tone mapping in the attributes of a picture, for a later PNG of it.
void label_tone(Image& image, const Tone& tone);
/// Returns the tone mapping that label_tone() noted; one that cuts off if there is none.
Tone tone_of(const Image& image);

}  // namespace ballot
