#include "tests/view/desktop.h"

#include <X11/Xlib.h>
#include <X11/Xutil.h>
#include <X11/extensions/XTest.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <thread>

namespace {

void pause_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

KeyCode code_of(Display* display, const char* key) { return XKeysymToKeycode(display, XStringToKeysym(key)); }

void end(pid_t process) {
  if (process <= 0) return;
  kill(process, SIGTERM);
  for (int i = 0; i < 50; ++i) {
    if (waitpid(process, nullptr, WNOHANG) != 0) return;
    pause_ms(20);
  }
  kill(process, SIGKILL);
  waitpid(process, nullptr, 0);
}

}  // namespace

Desktop::Desktop(int width, int height) {
  int ends[2];
  if (pipe(ends) != 0) return;
  const std::string screen = std::to_string(width) + "x" + std::to_string(height) + "x24";
  server_ = fork();
  if (server_ == 0) {
    const int null = open("/dev/null", O_WRONLY);
    dup2(null, 1), dup2(null, 2);
    close(ends[0]);
    const std::string fd = std::to_string(ends[1]);
    execlp("Xvfb", "Xvfb", "-displayfd", fd.c_str(), "-screen", "0", screen.c_str(), "-nolisten", "tcp", nullptr);
    _exit(127);
  }
  close(ends[1]);
  std::string number;
  for (char c; read(ends[0], &c, 1) == 1 && c != '\n';) number += c;
  close(ends[0]);
  if (number.empty()) return;
  number_ = std::stoi(number);
  display_ = XOpenDisplay(name().c_str());
}

Desktop::~Desktop() {
  if (display_) XCloseDisplay(display_);
  end(server_);
}

void Desktop::press(const char* key) {
  XTestFakeKeyEvent(display_, code_of(display_, key), True, 0);
  XFlush(display_);
}

void Desktop::release(const char* key) {
  XTestFakeKeyEvent(display_, code_of(display_, key), False, 0);
  XFlush(display_);
}

void Desktop::tap(const char* key) {
  press(key);
  pause_ms(30);
  release(key);
}

void Desktop::chord(const char* held, const char* key) {
  press(held);
  tap(key);
  release(held);
}

void Desktop::move_mouse(int x, int y) {
  XTestFakeMotionEvent(display_, -1, x, y, 0);
  XFlush(display_);
}

void Desktop::button(int number, bool down) {
  XTestFakeButtonEvent(display_, unsigned(number), down, 0);
  XFlush(display_);
}

void Desktop::resize_window(int width, int height) {
  Window root = 0, parent = 0, *children = nullptr;
  unsigned count = 0;
  XQueryTree(display_, DefaultRootWindow(display_), &root, &parent, &children, &count);
  for (unsigned i = 0; i < count; ++i) {
    XWindowAttributes attributes;
    if (XGetWindowAttributes(display_, children[i], &attributes) && attributes.map_state == IsViewable)
      XResizeWindow(display_, children[i], unsigned(width), unsigned(height));
  }
  if (children) XFree(children);
  XFlush(display_);
}

std::vector<unsigned long> Desktop::pixels(int width, int height) {
  std::vector<unsigned long> all;
  XImage* image =
      XGetImage(display_, DefaultRootWindow(display_), 0, 0, unsigned(width), unsigned(height), AllPlanes, ZPixmap);
  for (int y = 0; image && y < height; ++y)
    for (int x = 0; x < width; ++x) all.push_back(XGetPixel(image, x, y));
  if (image) XDestroyImage(image);
  return all;
}

Program::Program(const std::vector<std::string>& arguments, const std::vector<std::string>& environment) {
  int ends[2];
  if (pipe(ends) != 0) return;
  process_ = fork();
  if (process_ == 0) {
    dup2(ends[1], 1), dup2(ends[1], 2);
    close(ends[0]), close(ends[1]);
    for (const std::string& e : environment) {
      const std::size_t equals = e.find('=');
      if (equals == std::string::npos)
        unsetenv(e.c_str());
      else
        setenv(e.substr(0, equals).c_str(), e.substr(equals + 1).c_str(), 1);
    }
    std::vector<char*> words;
    for (const std::string& a : arguments) words.push_back(const_cast<char*>(a.c_str()));
    words.push_back(nullptr);
    execv(words[0], words.data());
    _exit(127);
  }
  close(ends[1]);
  pipe_ = ends[0];
  fcntl(pipe_, F_SETFL, O_NONBLOCK);
}

Program::~Program() {
  end(process_);
  close(pipe_);
}

void Program::read_more() {
  pollfd wait{pipe_, POLLIN, 0};
  poll(&wait, 1, 50);
  char buffer[4096];
  for (ssize_t n; (n = read(pipe_, buffer, sizeof buffer)) > 0;) output_.append(buffer, std::size_t(n));
}

bool Program::says(const std::string& text, double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end) {
    read_more();
    for (std::size_t next; (next = output_.find('\n', used_)) != std::string::npos;) {
      const std::string line = output_.substr(used_, next - used_);
      used_ = next + 1;
      if (line.find(text) != std::string::npos) return true;
    }
  }
  return false;
}

int Program::wait(double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end) {
    read_more();
    int status = 0;
    if (waitpid(process_, &status, WNOHANG) == process_) {
      process_ = -1;
      read_more();
      return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }
  }
  return -1;
}
