// Push constants and records of the kernels that make the picture of a window.
#ifndef BALLOT_WINDOW_H
#define BALLOT_WINDOW_H

#include "render.h"

#ifdef __cplusplus
namespace ballot {
#endif

// Bits of LivePush::flags.
#define LIVE_SHOWN 1u    // also write the window's pixels
#define LIVE_COUNTED 2u  // count the live rays

// Push constants of the kernels that shade hits into the film of a window.
struct LivePush {
  PrimaryPush camera;             // the camera of these pixels; sample_index 0 starts a new film
  float cone_width, cone_spread;  // lib/shade/shade_hit.glsl
  float scale;                    // factor of displayed colours: one over the sample count
  uint flags;
};

// Push constants of heat.comp, which writes heat map colours to the film and to the window's pixels.
struct HeatPush {
  uint width, height;
  uint first;
  uint count;
  uint sample_index;
  uint words;           // words in a ray's record
  uint value;           // index of the displayed word
  uint over_a, over_b;  // indices of words whose sum divides the value; ~0: none
  float top;            // the value of the last colour
  float scale;          // factor of displayed colours: one over the sample count
  vec3 ramp[5];         // sRGB
};

// Push constants of show.comp, which shows the film of an integrator.
struct ShowPush {
  uint width;    // pixels of a row
  uint count;    // listed pixels
  float scale;   // factor of the colours: one over the sample count
  uint neutral;  // 1: lib/shade/tone.glsl maps the colours; 0: what is above 1 is cut off
};

// A film pixel of a window, in ray order.
struct LivePixel {
  vec3 color;  // sum over samples
  uint unused;
};

#ifdef __cplusplus
BALLOT_RECORD(LivePush, 100);
BALLOT_RECORD(HeatPush, 104);
BALLOT_RECORD(ShowPush, 16);
BALLOT_RECORD(LivePixel, 16);
}  // namespace ballot
#endif
#endif  // BALLOT_WINDOW_H
