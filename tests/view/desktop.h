// A display of its own, a program that runs on it, and hands that type and move the mouse as a user does (XTEST).
#pragma once

#include <sys/types.h>

#include <chrono>
#include <string>
#include <vector>

struct _XDisplay;

/// An Xvfb server; ends with its owner.
class Desktop {
 public:
  Desktop(int width, int height);
  ~Desktop();
  Desktop(const Desktop&) = delete;
  Desktop& operator=(const Desktop&) = delete;

  bool works() const { return display_ != nullptr; }
  std::string name() const { return ":" + std::to_string(number_); }

  void press(const char* key);  // "w", "F12": an X keysym's name
  void release(const char* key);
  void tap(const char* key);
  void chord(const char* held, const char* key);
  void move_mouse(int x, int y);
  void button(int number, bool down);
  void scroll(int clicks);  // up
  /// Drags something from (x, y) to (x + dx, y + dy) with a mouse button.
  void drag(int number, int x, int y, int dx, int dy);

  /// What a desktop of high density says of itself: 2 is twice as many pixels in an inch as usual. Before a program starts.
  void set_scale(double scale);
  /// What a window manager does to the top-level window.
  void minimise();
  void restore();
  /// Drops a file on the top-level window (XDND), as a file manager does. False if the window does not take it.
  bool drop(const std::string& file);
  /// Resizes the top-level window that shows something; without a window manager, as one would.
  void resize_window(int width, int height);
  /// The colours of the screen, packed, row by row.
  std::vector<unsigned long> pixels(int width, int height);

 private:
  unsigned long top_level() const;
  void set_state(long state);

  pid_t server_ = -1;
  int number_ = -1;
  _XDisplay* display_ = nullptr;
};

/// A running program whose output is read line by line.
class Program {
 public:
  /// `environment`: NAME=VALUE sets, NAME alone removes.
  Program(const std::vector<std::string>& arguments, const std::vector<std::string>& environment);
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  /// Waits for a new line that holds `text`; lines before it are used up. False after so many seconds.
  bool says(const std::string& text, double seconds = 20);
  /// The exit code, or -1 if it does not end in time or was killed by a signal.
  int wait(double seconds = 20);
  const std::string& output() const { return output_; }  // all of it so far
  double cpu_seconds() const;                            // that it used until now

 private:
  void read_more();

  pid_t process_ = -1;
  int pipe_ = -1;
  std::string output_;
  std::size_t used_ = 0;
};
