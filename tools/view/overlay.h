// The overlay's toolkit: feeds Dear ImGui with a window's input and turns what it draws into a PaintList.
#pragma once

#include <vector>

#include "tools/view/window.h"

namespace ballot::view {

/// One at a time. Panels are ImGui calls between begin() and end().
class Overlay {
 public:
  /// Text is `content_scale` times larger than on a screen of usual density, where a unit of the window's coordinates is
  /// `pixels` pixels.
  Overlay(double content_scale, double pixels);
  ~Overlay();
  Overlay(const Overlay&) = delete;
  Overlay& operator=(const Overlay&) = delete;

  /// The glyphs, for Presenter::set_atlas; valid as long as the Overlay.
  PaintAtlas atlas() const;

  void begin(const Window& window, const Input& input, double dt);
  const PaintList& end();

  /// The mouse is over a panel, or a panel holds it; what was typed belongs to a panel.
  bool takes_mouse() const;
  bool takes_keys() const;

 private:
  PaintList list_;
};

}  // namespace ballot::view
