#include "tests/view/desktop.h"

#include <X11/Xatom.h>
#include <X11/Xlib.h>
#include <X11/Xutil.h>
#include <X11/extensions/XTest.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <fstream>
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

void Desktop::scroll(int clicks) {
  for (int i = 0; i < std::abs(clicks); ++i) {
    button(clicks > 0 ? 4 : 5, true);
    button(clicks > 0 ? 4 : 5, false);
  }
}

void Desktop::drag(int number, int x, int y, int dx, int dy) {
  move_mouse(x, y);
  pause_ms(60);
  button(number, true);
  for (int step = 1; step <= 10; ++step) {
    pause_ms(20);
    move_mouse(x + dx * step / 10, y + dy * step / 10);
  }
  pause_ms(60);
  button(number, false);
}

// Returns the top-level window. Without a window manager, the children of the root are the windows that programs
// opened.
unsigned long Desktop::top_level() const {
  Window root = 0, parent = 0, *children = nullptr, found = 0;
  unsigned count = 0;
  XQueryTree(display_, DefaultRootWindow(display_), &root, &parent, &children, &count);
  for (unsigned i = 0; i < count; ++i) {
    XWindowAttributes attributes;
    if (XGetWindowAttributes(display_, children[i], &attributes) && attributes.c_class == InputOutput &&
        attributes.width > 1)
      found = children[i];
  }
  if (children) XFree(children);
  return found;
}

void Desktop::resize_window(int width, int height) {
  XResizeWindow(display_, top_level(), unsigned(width), unsigned(height));
  XFlush(display_);
}

void Desktop::set_scale(double scale) {
  const std::string resources = "Xft.dpi:\t" + std::to_string(int(96 * scale)) + "\n";
  XChangeProperty(display_, DefaultRootWindow(display_), XA_RESOURCE_MANAGER, XA_STRING, 8, PropModeReplace,
                  reinterpret_cast<const unsigned char*>(resources.c_str()), int(resources.size()));
  XSync(display_, False);
}

// ICCCM 4.1.3.1: WM_STATE holds the state and the window of an icon.
void Desktop::set_state(long state) {
  const Atom atom = XInternAtom(display_, "WM_STATE", False);
  const long words[2] = {state, None};
  XChangeProperty(display_, top_level(), atom, atom, 32, PropModeReplace, reinterpret_cast<const unsigned char*>(words),
                  2);
}

void Desktop::minimise() {
  set_state(IconicState);
  XUnmapWindow(display_, top_level());
  XSync(display_, False);
}

void Desktop::restore() {
  set_state(NormalState);
  XMapWindow(display_, top_level());
  XSync(display_, False);
}

bool Desktop::drop(const std::string& file) {
  const auto atom = [&](const char* name) { return XInternAtom(display_, name, False); };
  const Window target = top_level(), root = DefaultRootWindow(display_);
  const Window source = XCreateSimpleWindow(display_, root, 0, 0, 1, 1, 0, 0, 0);
  const Atom selection = atom("XdndSelection"), uris = atom("text/uri-list");
  XSetSelectionOwner(display_, selection, source, CurrentTime);
  const auto send = [&](Window to, const char* type, std::array<long, 5> words) {
    XEvent event{};
    event.xclient.type = ClientMessage;
    event.xclient.window = to;
    event.xclient.message_type = atom(type);
    event.xclient.format = 32;
    std::ranges::copy(words, event.xclient.data.l);
    XSendEvent(display_, to, False, NoEventMask, &event);
  };
  const long from = long(source);
  send(target, "XdndEnter", {from, 5L << 24, long(uris), 0, 0});
  send(target, "XdndPosition", {from, 0, 100L << 16 | 100, CurrentTime, long(atom("XdndActionCopy"))});
  send(target, "XdndDrop", {from, 0, CurrentTime, 0, 0});
  XFlush(display_);
  bool taken = false;
  for (int i = 0; i < 200 && !taken; ++i) {
    pause_ms(20);
    while (XPending(display_)) {
      XEvent event;
      XNextEvent(display_, &event);
      if (event.type == SelectionRequest) {  // the window asks for the dropped file
        const XSelectionRequestEvent& asked = event.xselectionrequest;
        const std::string text = "file://" + file + "\r\n";
        XChangeProperty(display_, asked.requestor, asked.property, uris, 8, PropModeReplace,
                        reinterpret_cast<const unsigned char*>(text.c_str()), int(text.size()));
        XEvent answer{};
        answer.xselection = {
            SelectionNotify, 0,         False, display_, asked.requestor, asked.selection, asked.target,
            asked.property,  asked.time};
        XSendEvent(display_, asked.requestor, False, NoEventMask, &answer);
        XFlush(display_);
      }
      taken |= event.type == ClientMessage && event.xclient.message_type == atom("XdndFinished");
    }
  }
  XDestroyWindow(display_, source);
  XFlush(display_);
  return taken;
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

double Program::cpu_seconds() const {
  std::ifstream file("/proc/" + std::to_string(process_) + "/stat");
  std::string word;
  double ticks = 0;
  for (int field = 1; field <= 15 && file >> word; ++field)
    if (field >= 14) ticks += std::stod(word);  // user time and system time
  return ticks / double(sysconf(_SC_CLK_TCK));
}
