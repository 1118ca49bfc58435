// Tone mapping for windows: Khronos PBR Neutral (Khronos Group, PBR Neutral Tone Mapper, 2024), as
// engine/files/tone.cpp has it for PNG.

const float REFLECTION = 0.04;                  // of a dielectric seen from the front
const float COMPRESSION_START = 0.8 - REFLECTION;
const float DESATURATION = 0.15;

// Maps a linear colour of 0 or more to [0, 1].
vec3 neutral_tone(vec3 color) {
  color = min(color, vec3(1e6));
  float least = min(color.r, min(color.g, color.b));
  color -= least < 2.0 * REFLECTION ? least - least * least / (4.0 * REFLECTION) : REFLECTION;
  float peak = max(color.r, max(color.g, color.b));
  if (peak < COMPRESSION_START) return color;
  float rest = 1.0 - COMPRESSION_START;
  float new_peak = 1.0 - rest * rest / (peak + rest - COMPRESSION_START);
  float white = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
  return mix(color * (new_peak / peak), vec3(new_peak), white);
}
