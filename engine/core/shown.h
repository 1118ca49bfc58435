// Text from files, made fit to be shown.
#pragma once

#include <string>
#include <string_view>

namespace ballot {

/// Returns `text` with everything spelled out that would steer a terminal or is no UTF-8: control characters and stray
/// bytes as \x1b, controls and direction marks beyond ASCII as \u009b. Line ends and tabs stay.
std::string shown(std::string_view text);

/// The same for a text of one line: line ends and tabs are spelled out too.
std::string shown_in_line(std::string_view text);

}  // namespace ballot
