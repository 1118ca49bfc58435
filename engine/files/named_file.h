// The files that a scene file names: buffers, images, materials. Internal to engine/files.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace ballot {

/// Decodes percent escapes: "a%20b.png" becomes "a b.png".
std::string decoded_uri(std::string_view uri);

/// Returns why the scene file `scene` may not name a file, as the end of a sentence; "" if it may. `name` is decoded.
/// Names with a scheme such as http:// are no files. Absolute names, and those that lead out of the scene's folder by
/// ".." or by links, are refused unless `allow_outside`.
std::string why_refused(const std::filesystem::path& scene, std::string_view name, bool allow_outside);

/// Returns the path of a file that the scene file `scene` names. `what` is for the message, such as "image 0".
/// Throws Flaw if why_refused() gives a reason.
std::filesystem::path named_file(const std::filesystem::path& scene, std::string_view name, bool allow_outside,
                                 std::string_view what);

}  // namespace ballot
