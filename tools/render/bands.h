// Pictures in bands of rows. A large picture is rendered and written band by band, so that memory need not hold it
// whole.
#pragma once

#include "tools/render/job.h"

namespace ballot::cli {

/// How a picture is divided, and what it takes.
struct BandPlan {
  std::vector<Window> bands;       // from the top; one: the picture is rendered whole
  std::uint64_t host_bytes = 0;    // of memory, at most; about
  std::uint64_t device_bytes = 0;  // on the device; about. A CPU device takes them from the same memory
  bool in_bands() const { return bands.size() > 1; }
};

/// What decides how a picture is divided.
struct BandWish {
  std::uint32_t rows = 0;  // in a band, rounded up to whole tiles; 0: as many as suit
  bool whole = false;      // the picture is needed whole
  bool png = false;        // a PNG is written too
};

/// Divides a picture. Bands have at most 2^23 pixels and take at most half of the memory that is left; a picture of up
/// to 2^24 pixels that does so is rendered whole. Throws Error(Work), with both figures, if it does not fit into the
/// memory that is left.
BandPlan plan_bands(DeviceScene& world, const View& view, const RenderOptions& options, const BandWish& wish);

/// Says in how many bands the picture is rendered, and what memory it takes.
void announce(const View& view, const RenderOptions& options, const BandPlan& plan, bool is_cpu);

/// Renders the bands that are not there yet as pictures of their own, beside `exr`. The image of the result has the
/// size of the whole, the channels without values, and the attributes. If job.resume is set, bands of an earlier run
/// are taken over. Throws as render_job().
Rendered render_bands(DeviceScene& world, const View& view, const RenderJob& job, const std::filesystem::path& exr,
                      const BandPlan& plan);

/// Joins the bands to the picture. `whole` has size, channels and attributes. `png` is empty if none is wanted; `links`
/// is for `exr`. Deletes the bands when both are written. Throws Error(Work).
void join_bands(const Image& whole, const RenderOptions& options, const BandPlan& plan,
                const std::filesystem::path& exr, const std::filesystem::path& png, const Tone& tone, Links links);

}  // namespace ballot::cli
