// A private X display, a program that runs on it, and keyboard and mouse input as a user makes it (XTEST).
#pragma once

#include <sys/types.h>

#include <chrono>
#include <string>
#include <vector>

struct _XDisplay;

/// An Xvfb server. The destructor ends it.
class Desktop {
 public:
  Desktop(int width, int height);
  ~Desktop();
  Desktop(const Desktop&) = delete;
  Desktop& operator=(const Desktop&) = delete;

  bool works() const { return display_ != nullptr; }
  std::string name() const { return ":" + std::to_string(number_); }

  void press(const char* key);  // the name of an X keysym: "w", "F12"
  void release(const char* key);
  void tap(const char* key);
  void chord(const char* held, const char* key);
  void move_mouse(int x, int y);
  void button(int number, bool down);
  void scroll(int clicks);  // upwards
  /// Drags the mouse from (x, y) to (x + dx, y + dy) with a button held down.
  void drag(int number, int x, int y, int dx, int dy);

  /// Sets the scale that a desktop of high density reports. 2 is twice as many pixels per inch as usual. Call it before
  /// a program starts.
  void set_scale(double scale);
  /// Minimise and restore the top-level window as a window manager does.
  void minimise();
  void restore();
  /// Drops a file on the top-level window (XDND), as a file manager does. Returns false if the window does not accept
  /// it.
  bool drop(const std::string& file);
  /// Resizes the visible top-level window as a window manager would; there is none on this display.
  void resize_window(int width, int height);
  /// Returns the packed colours of the upper left width x height pixels of the screen, row by row.
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
  /// `environment`: NAME=VALUE sets a variable, NAME alone removes it.
  Program(const std::vector<std::string>& arguments, const std::vector<std::string>& environment);
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  /// Waits for a new line that contains `text`, and skips the lines before it. Returns false after this many seconds.
  bool says(const std::string& text, double seconds = 20);
  /// Waits for the end of the program. Returns its exit code, or -1 if it does not end in time or a signal killed it.
  int wait(double seconds = 20);
  const std::string& output() const { return output_; }  // all output so far
  double cpu_seconds() const;                            // CPU time that it has used so far

 private:
  void read_more();

  pid_t process_ = -1;
  int pipe_ = -1;
  std::string output_;
  std::size_t used_ = 0;
};
