// The overlay: passes a window's input to Dear ImGui and turns ImGui's draw lists into a PaintList.
#pragma once

#include <vector>

#include "tools/view/window.h"

namespace ballot::view {

/// The ImGui context of the overlay. Only one may exist at a time. Panels are ImGui calls between begin() and end().
class Overlay {
 public:
  /// Makes text `content_scale` times larger than on a screen of usual density. `pixels` is the number of pixels in a
  /// unit of the window's coordinates.
  Overlay(double content_scale, double pixels);
  ~Overlay();
  Overlay(const Overlay&) = delete;
  Overlay& operator=(const Overlay&) = delete;

  /// Returns the glyphs, for Presenter::set_atlas; valid as long as the Overlay.
  PaintAtlas atlas() const;

  void begin(const Window& window, const Input& input, double dt);
  const PaintList& end();

  /// takes_mouse(): the pointer is over a panel, or a panel holds it. takes_keys(): a panel receives the typed text.
  bool takes_mouse() const;
  bool takes_keys() const;

 private:
  PaintList list_;
};

}  // namespace ballot::view
