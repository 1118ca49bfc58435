// A private X display, with keyboard and mouse input as a user makes it (XTEST) and what a window manager does.
#pragma once

#include <sys/types.h>

#include <functional>
#include <string>
#include <vector>

struct _XDisplay;

/// An Xvfb server without a window manager. This process and its children use it as their display. The destructor ends
/// it.
class Desktop {
 public:
  Desktop(int width, int height);
  ~Desktop();
  Desktop(const Desktop&) = delete;
  Desktop& operator=(const Desktop&) = delete;

  bool works() const { return display_ != nullptr; }

  void key(const char* key, bool down);  // the name of an X keysym: "w", "F12"
  void tap(const char* key);
  void move_mouse(int x, int y);
  void button(int number, bool down);

  /// Sets the scale that a desktop of high density reports. 2 is twice as many pixels per inch as usual. Call it before
  /// a window is opened.
  void set_scale(double scale);
  /// Resizes, minimises and restores the top-level window as a window manager does.
  void resize_window(int width, int height);
  void minimise(bool yes);
  /// Drops a file on the top-level window (XDND), as a file manager does. `wait` is called until the window has taken
  /// it. Returns false if the window does not take it.
  bool drop(const std::string& file, const std::function<void()>& wait);
  /// Returns the packed colours of the upper left width x height pixels of the screen, row by row.
  std::vector<unsigned long> pixels(int width, int height);

 private:
  unsigned long atom(const char* name) const;
  unsigned long top_level() const;
  void send(unsigned long window, const char* type, std::vector<long> words);

  pid_t server_ = -1;
  _XDisplay* display_ = nullptr;
};
