#include "tools/program/cli.h"

namespace ballot::cli {

namespace {

namespace fs = std::filesystem;

struct MergeArgs {
  std::vector<std::string> parts;
  std::string out;
  bool png = false;
};

int run_merge(const MergeArgs& args) {
  const fs::path out = args.out;
  if (out.extension() != ".exr") fail(Failure::Arguments, "--out {}: expected a file name that ends in .exr", args.out);
  CommandFiles files;
  for (const std::string& part : args.parts) files.reads("PART.exr", part);
  files.writes("--out", out);
  if (args.png) files.writes("--png", fs::path(out).replace_extension(".png"));
  std::vector<ImagePart> parts;
  for (const std::string& part : args.parts) parts.push_back({part, read_exr(part)});
  const Image whole = merge_parts(parts, TILE_SIZE);
  write_exr(out, whole);
  if (args.png) write_png(fs::path(out).replace_extension(".png"), whole, tone_of(whole), Links::Replace);
  say("{} parts, {} x {} pixels: {}{}\n", parts.size(), whole.width, whole.height, out.string(),
      args.png ? " + .png" : "");
  return 0;
}

}  // namespace

void add_merge(CLI::App& app, int& result) {
  auto args = std::make_shared<MergeArgs>();
  CLI::App* cmd = app.add_subcommand("merge", "joins the parts of a picture that 'ballot render --tiles' made");
  cmd->add_option("PART.exr", args->parts,
                  "all N parts of the picture, in any order; e.g. ballot merge p0.exr p1.exr --out whole.exr")
      ->required();
  cmd->add_option("--out", args->out, "FILE.exr for the whole picture: the same bits as if rendered in one part")
      ->required();
  cmd->add_flag("--png", args->png, "also write a PNG beside it");
  add_memory(*cmd);
  cmd->callback([args, &result] { result = run_merge(*args); });
}

}  // namespace ballot::cli
