// A stand-in for Open Image Denoise: it has the functions that are used, and "cleans" a picture to
// colour / 2 + albedo / 4 + normal / 8, so that a test sees what it was given.
#include <cstddef>
#include <cstring>
#include <map>
#include <string>

namespace {
struct Filter {
  std::map<std::string, float*> images;
  std::size_t pixels = 0;
  bool hdr = false, ready = false;
};
const char* failure = nullptr;
}  // namespace

extern "C" {
void* oidnNewDevice(int type) { return type == 1 ? &failure : nullptr; }
void oidnCommitDevice(void*) {}
void oidnReleaseDevice(void*) {}
int oidnGetDevice1i(void*, const char*) { return 10907; }
int oidnGetDeviceError(void*, const char** text) {
  *text = failure;
  failure = nullptr;
  return *text ? 1 : 0;
}
void* oidnNewFilter(void*, const char* type) { return std::strcmp(type, "RT") == 0 ? new Filter : nullptr; }
void oidnReleaseFilter(void* filter) { delete static_cast<Filter*>(filter); }
void oidnSetSharedFilterImage(void* filter, const char* name, void* at, int, std::size_t width, std::size_t height,
                              std::size_t, std::size_t, std::size_t) {
  static_cast<Filter*>(filter)->images[name] = static_cast<float*>(at);
  static_cast<Filter*>(filter)->pixels = width * height;
}
void oidnSetFilter1b(void* filter, const char*, bool on) { static_cast<Filter*>(filter)->hdr = on; }
void oidnCommitFilter(void* filter) { static_cast<Filter*>(filter)->ready = true; }
void oidnExecuteFilter(void* filter) {
  Filter& f = *static_cast<Filter*>(filter);
  if (!f.hdr || !f.ready || f.pixels == 7 * 5) {  // so that a test sees a failure
    failure = "a fault that was asked for";
    return;
  }
  for (std::size_t i = 0; i < 3 * f.pixels; ++i)
    f.images["output"][i] = f.images["color"][i] / 2 + f.images["albedo"][i] / 4 + f.images["normal"][i] / 8;
}
}
