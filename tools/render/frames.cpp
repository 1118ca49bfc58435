#include "tools/render/frames.h"

#include <cmath>
#include <functional>

namespace ballot::cli {

namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kMostFrames = 1000000;
constexpr double kDefaultFps = 24;

/// Returns the first and last number of FIRST..LAST.
std::array<std::uint32_t, 2> range_of(const std::string& text) {
  const std::string form = "FIRST..LAST: numbers of frames from 0, such as 0..47";
  const std::size_t dots = text.find("..");
  if (dots == std::string::npos) fail(Failure::Arguments, "--frames {}: expected {}", text, form);
  const auto range = numbers_of<2>(text.substr(0, dots) + "," + text.substr(dots + 2), ',', "--frames", form.c_str());
  if (range[0] > range[1] || range[1] - range[0] >= kMostFrames)
    fail(Failure::Arguments, "--frames {}: expected FIRST not above LAST, and at most {} frames", text, kMostFrames);
  return range;
}

std::array<std::uint32_t, 2> part_of(const std::string& text) {
  if (text.empty()) return {0, 1};
  const auto part =
      numbers_of<2>(text, '/', "--frame-part", "I/N: every N-th frame from the I-th on, I from 0 to N - 1");
  if (part[0] >= part[1]) fail(Failure::Arguments, "--frame-part {}: expected I below N, as in 0/4", text);
  return part;
}

std::size_t chosen_clip(const FrameArgs& args, const Scene& scene) {
  if (args.animation.empty() && scene.animation && scene.animation->clips.size() > 1) {
    std::string names;
    for (const AnimationClip& c : scene.animation->clips) names += (names.empty() ? "" : ", ") + c.name;
    fail(Failure::Arguments, "scene '{}' has several animations; choose one with --animation: {}", scene.name, names);
  }
  return find_clip(scene.animation.get(), args.animation.empty() ? "0" : args.animation, scene.name);
}

/// Says which frames lie outside the clip.
void note_outside(const FramePlan& plan, const AnimationClip& clip, const std::string& scene) {
  std::size_t outside = 0;
  for (const Frame& f : plan.frames) outside += clamped_time(clip, f.seconds) != f.seconds;
  if (outside == 0) return;
  const double last = plan.frames.back().seconds;
  const std::string what = plan.numbered
                               ? fmt::format("{} of {} frames, up to {:g} s, are", outside, plan.frames.size(), last)
                               : fmt::format("the time {:g} s is", last);
  say_aside("ballot: {}: {} outside animation '{}' of {:g} s; {} shows its {}\n", scene, what, clip.name, clip.seconds,
            plan.numbered ? "each" : "the picture", last < 0 ? "beginning" : "end");
}

}  // namespace

void FrameArgs::add_range_to(CLI::App& cmd) {
  cmd.add_option("--frames", frames, "FIRST..LAST: frames of the scene's animation; frame k is at k / FPS seconds");
  cmd.add_option("--fps", fps, fmt::format("frames a second of --frames [{:g}]", kDefaultFps));
  cmd.add_option("--animation", animation, "name or number of the animation of --frames [the only one]");
}

void FrameArgs::add_to(CLI::App& cmd) {
  cmd.add_option("--time", time, "seconds: draw the scene at this time of its animation [at rest]");
  cmd.add_option("--frames", frames,
                 "FIRST..LAST: draw these frames of the animation; frame k is at k / FPS seconds, and its file gets\n"
                 "its number: OUT-0007.exr. With --resume, frames whose files are complete are left out");
  cmd.add_option("--fps", fps, fmt::format("frames a second of --frames [{:g}]", kDefaultFps));
  cmd.add_option("--frame-part", part,
                 "I/N: of --frames, draw every N-th from the I-th on, I from 0; e.g. --frame-part 0/4");
  cmd.add_option(
      "--animation", animation,
      "name or number of the animation of --time or --frames; 'ballot info SCENE' lists them [the only one]");
  cmd.add_option("--update", update,
                 "how the tree follows the frames: auto, refit (its boxes move), rebuild (built for each) [auto]");
}

void FrameArgs::check() const {
  if (time && !frames.empty()) fail(Failure::Arguments, "--time and --frames: expected one of them");
  if (time && !std::isfinite(*time)) fail(Failure::Arguments, "--time {}: expected a finite number of seconds", *time);
  if (frames.empty() && (fps || !part.empty()))
    fail(Failure::Arguments, "{} needs --frames FIRST..LAST", fps ? "--fps" : "--frame-part");
  if (!animation.empty() && !time && frames.empty())
    fail(Failure::Arguments, "--animation needs --time SECONDS or --frames FIRST..LAST");
  if (fps && !(*fps > 0 && std::isfinite(*fps)))
    fail(Failure::Arguments, "--fps {}: expected a finite number above 0", *fps);
  if (!frames.empty()) range_of(frames);
  part_of(part);
  find_update(update);
}

UpdateMode find_update(std::string_view name) {
  std::string names;
  for (const UpdateModeRow& row : kUpdateModes) {
    if (row.name == name) return row.id;
    names += fmt::format("{}{}", names.empty() ? "" : ", ", row.name);
  }
  fail(Failure::Arguments, "--update {}: there are {}", name, names);
}

std::string_view update_name(UpdateMode mode) {
  for (const UpdateModeRow& row : kUpdateModes)
    if (row.id == mode) return row.name;
  return "";
}

FramePlan plan_frames(const FrameArgs& args, const Scene& scene, Outside outside) {
  FramePlan plan;
  plan.update = find_update(args.update);
  if (!args.time && args.frames.empty()) return plan;
  plan.clip = chosen_clip(args, scene);
  const AnimationClip& clip = scene.animation->clips[plan.clip];
  plan.animation = clip.name;
  plan.numbered = !args.frames.empty();
  if (plan.numbered) {
    const auto [first, last] = range_of(args.frames);
    const auto [index, count] = part_of(args.part);
    plan.frames.clear();
    for (std::uint64_t k = std::uint64_t{first} + index; k <= last; k += count)
      plan.frames.push_back({std::uint32_t(k), double(k) / args.fps.value_or(kDefaultFps)});
    if (plan.frames.empty())
      fail(Failure::Arguments, "--frame-part {}: no frame of --frames {} is left for it", args.part, args.frames);
  } else {
    plan.frames = {{0, *args.time}};
  }
  if (outside == Outside::Said) note_outside(plan, clip, scene.name);
  for (Frame& f : plan.frames) f.seconds = clamped_time(clip, f.seconds);
  return plan;
}

fs::path frame_file(const fs::path& exr, std::uint32_t frame) {
  fs::path file = exr;
  return file.replace_filename(fmt::format("{}-{:04}.exr", exr.stem().string(), frame));
}

std::string job_of(const DeviceScene& world, const View& view, const RenderOptions& options) {
  std::string text = world.made_of(view, options);
  for (const std::string& aov : options.aovs) text += aov + "\n";
  text += fmt::format("heat: {}\nstatistics: {}\n", options.heat, options.stats);
  return fmt::format("{:016x}", std::hash<std::string>{}(text));
}

void label_frame(Image& image, const FramePlan& plan, const Frame& frame, const std::string& job) {
  if (plan.animation.empty()) return;
  image.attributes["animation"] = plan.animation;
  image.attributes["time"] = float(frame.seconds);
  if (!plan.numbered) return;
  image.attributes["frame"] = int(frame.number);
  image.attributes["job"] = job;
}

bool has_frame(const fs::path& exr, const FramePlan& plan, const Frame& frame, const std::string& job) {
  if (!fs::exists(exr)) return false;
  Image expected;
  label_frame(expected, plan, frame, job);
  try {
    const Image found = read_exr(exr);
    for (const auto& [name, value] : expected.attributes) {
      const auto at = found.attributes.find(name);
      if (at == found.attributes.end() || at->second != value) return false;
    }
    return true;
  } catch (const Error&) {
    return false;  // cut short, or no picture
  }
}

}  // namespace ballot::cli
