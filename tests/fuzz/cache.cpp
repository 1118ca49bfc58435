// Folders of a cache as another user may have left them. A byte of an input for each of the folder that the environment
// names, the two below it and the file in them says what stands there; the rest is what is written.
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "engine/core/cache_file.h"
#include "tests/fuzz/fuzz.h"

namespace ballot::fuzz {

namespace {

namespace fs = std::filesystem;

enum class Stands { Own, Readable, Group, All, Strangers, Link, Pipe, Nothing };
constexpr const char* kNames[] = {"cache", "ballot", "sub", "file"};
constexpr std::string_view kPrecious = "precious";

/// Puts something at a path: for the last name a file, else a folder. Returns true if a cache may use it.
bool stand(const fs::path& path, Stands what, bool file, const fs::path& outside) {
  if (what == Stands::Link) fs::create_symlink(file ? outside / "victim" : outside, path);
  if (what == Stands::Pipe) ::mkfifo(path.c_str(), 0600);
  if (what >= Stands::Link) return what == Stands::Nothing;
  if (file)
    put(fs::relative(path, folder()).string(), "stored");
  else
    fs::create_directory(path);
  constexpr mode_t kModes[] = {0700, 0755, 0770, 0707, 0700};
  ::chmod(path.c_str(), kModes[int(what)]);
  if (what == Stands::Strangers && ::chown(path.c_str(), 12345, 12345) != 0) return true;  // only root can
  return what <= Stands::Readable;
}

void read_cache_folder(std::string_view input) {
  if (input.size() < std::size(kNames)) return;
  const fs::path outside = folder() / "outside", start = folder() / kNames[0];
  for (const fs::path& old : {outside, start}) fs::remove_all(old);
  fs::create_directory(outside);
  put("outside/victim", kPrecious);
  ::setenv("XDG_CACHE_HOME", start.c_str(), 1);
  fs::path path = folder();
  bool usable = true;  // the folders
  for (std::size_t i = 0; i < std::size(kNames); ++i) {
    path /= kNames[i];
    const auto what = Stands(static_cast<unsigned char>(input[i]) % 8);
    const bool file = i + 1 == std::size(kNames),
               there = i == 0 || fs::is_directory(fs::symlink_status(path.parent_path()));
    const bool fine = there && stand(path, what, file, outside);
    const bool named = i == 0 && (what == Stands::Group || what == Stands::All || what == Stands::Link);
    if (!file && there) usable = usable && (fine || named);
  }
  const std::string_view bytes = input.substr(std::size(kNames));
  const auto stored = read_cache(path);
  const bool written = write_cache(path, std::as_bytes(std::span(bytes)));
  if (stored && !usable) finding("a cache was read", path.string());
  if (written != usable) finding(written ? "a cache was written" : "a cache was not written", path.string());
  if (written && bytes_in(path) != bytes) finding("a cache holds other bytes", path.string());
  if (bytes_in(outside / "victim") != kPrecious) finding("a file elsewhere was written", path.string());
  if (fs::exists(outside / "sub") || fs::exists(outside / "file")) finding("a link was followed", path.string());
}

}  // namespace

Target cache_target() {
  std::vector<std::string> seeds;
  for (char what = 0; what < 8; ++what)
    for (std::size_t at = 0; at < std::size(kNames); ++at) {
      seeds.emplace_back(std::size(kNames), '\0').at(at) = what;
      seeds.back() += "new bytes";
    }
  return {"cache", Form::Bytes, seeds, {}, read_cache_folder, 64};
}

}  // namespace ballot::fuzz
