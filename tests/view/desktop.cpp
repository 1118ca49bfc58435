#include "tests/view/desktop.h"

#include <X11/Xatom.h>
#include <X11/Xlib.h>
#include <X11/Xutil.h>
#include <X11/extensions/XTest.h>
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>

Desktop::Desktop(int width, int height) {
  int ends[2];
  if (pipe(ends) != 0) return;
  const std::string screen = std::to_string(width) + "x" + std::to_string(height) + "x24";
  server_ = fork();
  if (server_ == 0) {
    const int null = open("/dev/null", O_WRONLY);
    dup2(null, 1), dup2(null, 2);
    const std::string fd = std::to_string(ends[1]);
    execlp("Xvfb", "Xvfb", "-displayfd", fd.c_str(), "-screen", "0", screen.c_str(), "-nolisten", "tcp", nullptr);
    _exit(127);
  }
  close(ends[1]);
  std::string name = ":";
  for (char c; read(ends[0], &c, 1) == 1 && c != '\n';) name += c;
  close(ends[0]);
  setenv("DISPLAY", name.c_str(), 1);
  unsetenv("WAYLAND_DISPLAY");
  display_ = XOpenDisplay(name.c_str());
}

Desktop::~Desktop() {
  if (display_) XCloseDisplay(display_);
  if (server_ <= 0) return;
  kill(server_, SIGTERM);
  waitpid(server_, nullptr, 0);
}

void Desktop::key(const char* key, bool down) {
  XTestFakeKeyEvent(display_, XKeysymToKeycode(display_, XStringToKeysym(key)), down, 0);
  XSync(display_, False);
}

void Desktop::tap(const char* name) {
  key(name, true);
  key(name, false);
}

void Desktop::move_mouse(int x, int y) {
  XTestFakeMotionEvent(display_, -1, x, y, 0);
  XSync(display_, False);
}

void Desktop::button(int number, bool down) {
  XTestFakeButtonEvent(display_, unsigned(number), down, 0);
  XSync(display_, False);
}

unsigned long Desktop::atom(const char* name) const { return XInternAtom(display_, name, False); }

// Without a window manager, the children of the root are the windows that programs opened.
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
  XSync(display_, False);
}

void Desktop::set_scale(double scale) {
  const std::string resources = "Xft.dpi:\t" + std::to_string(int(96 * scale)) + "\n";
  XChangeProperty(display_, DefaultRootWindow(display_), XA_RESOURCE_MANAGER, XA_STRING, 8, PropModeReplace,
                  reinterpret_cast<const unsigned char*>(resources.c_str()), int(resources.size()));
  XSync(display_, False);
}

// ICCCM 4.1.3.1: WM_STATE holds the state and the window of an icon.
void Desktop::minimise(bool yes) {
  const Window window = top_level();
  const long words[2] = {yes ? IconicState : NormalState, None};
  XChangeProperty(display_, window, atom("WM_STATE"), atom("WM_STATE"), 32, PropModeReplace,
                  reinterpret_cast<const unsigned char*>(words), 2);
  yes ? XUnmapWindow(display_, window) : XMapWindow(display_, window);
  XSync(display_, False);
}

void Desktop::send(unsigned long window, const char* type, std::vector<long> words) {
  XEvent event{};
  event.xclient.type = ClientMessage;
  event.xclient.window = window;
  event.xclient.message_type = atom(type);
  event.xclient.format = 32;
  std::ranges::copy(words, event.xclient.data.l);
  XSendEvent(display_, window, False, NoEventMask, &event);
}

bool Desktop::drop(const std::string& file, const std::function<void()>& wait) {
  const Window target = top_level();
  const Window source = XCreateSimpleWindow(display_, DefaultRootWindow(display_), 0, 0, 1, 1, 0, 0, 0);
  XSetSelectionOwner(display_, atom("XdndSelection"), source, CurrentTime);
  const auto uris = atom("text/uri-list");
  send(target, "XdndEnter", {long(source), 5L << 24, long(uris)});
  send(target, "XdndPosition", {long(source), 0, 100L << 16 | 100, CurrentTime, long(atom("XdndActionCopy"))});
  send(target, "XdndDrop", {long(source), 0, CurrentTime});
  bool taken = false;
  for (int i = 0; i < 200 && !taken; ++i) {
    XSync(display_, False);
    wait();
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
      }
      taken |= event.type == ClientMessage && event.xclient.message_type == atom("XdndFinished");
    }
  }
  XDestroyWindow(display_, source);
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
