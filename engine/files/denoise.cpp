#include "engine/files/denoise.h"

#include <dlfcn.h>

#include <cstdlib>
#include <memory>

#include "engine/core/error.h"

namespace ballot {

namespace {

constexpr int kCpuDevice = 1, kFloat3 = 3;  // OIDN_DEVICE_TYPE_CPU, OIDN_FORMAT_FLOAT3
constexpr const char* kVariable = "BALLOT_DENOISER";
constexpr const char* kLibraries[] = {"libOpenImageDenoise.so.2", "libOpenImageDenoise.so.1", "libOpenImageDenoise.so"};

/// Opens the first library that there is. Throws Error(Work).
void* open_library() {
  if (const char* file = std::getenv(kVariable); file && *file) {
    if (void* library = dlopen(file, RTLD_NOW | RTLD_LOCAL)) return library;
    fail(Failure::Work, "{}: cannot load Open Image Denoise: {}", kVariable, dlerror());
  }
  for (const char* name : kLibraries)
    if (void* library = dlopen(name, RTLD_NOW | RTLD_LOCAL)) return library;
  fail(Failure::Work,
       "denoising needs Intel's Open Image Denoise, and there is neither {} nor {}: install it (openimagedenoise.org; "
       "Debian 12 has no package), or name its file in {}",
       kLibraries[0], kLibraries[1], kVariable);
}

/// Returns a function of the library by its name, or by the one that older versions have.
template <class Function>
void find(void* library, Function& function, const char* name, const char* older = nullptr) {
  void* found = dlsym(library, name);
  if (!found && older) found = dlsym(library, older);
  if (!found) fail(Failure::Work, "the library of Open Image Denoise has no function {}", name);
  function = reinterpret_cast<Function>(found);
}

}  // namespace

/// The functions of the library that are used, as oidn.h of versions 1 and 2 has them.
struct Denoiser::Calls {
  void* (*new_device)(int);
  void (*commit_device)(void*);
  void (*release_device)(void*);
  int (*device_error)(void*, const char**);
  int (*device_int)(void*, const char*);
  void* (*new_filter)(void*, const char*);
  void (*release_filter)(void*);
  void (*set_image)(void*, const char*, void*, int, std::size_t, std::size_t, std::size_t, std::size_t, std::size_t);
  void (*set_bool)(void*, const char*, bool);
  void (*commit_filter)(void*);
  void (*execute)(void*);
};

Denoiser::Denoiser() : library_(open_library()) {
  auto calls = std::make_unique<Calls>();
  find(library_, calls->new_device, "oidnNewDevice");
  find(library_, calls->commit_device, "oidnCommitDevice");
  find(library_, calls->release_device, "oidnReleaseDevice");
  find(library_, calls->device_error, "oidnGetDeviceError");
  find(library_, calls->device_int, "oidnGetDeviceInt", "oidnGetDevice1i");
  find(library_, calls->new_filter, "oidnNewFilter");
  find(library_, calls->release_filter, "oidnReleaseFilter");
  find(library_, calls->set_image, "oidnSetSharedFilterImage");
  find(library_, calls->set_bool, "oidnSetFilterBool", "oidnSetFilter1b");
  find(library_, calls->commit_filter, "oidnCommitFilter");
  find(library_, calls->execute, "oidnExecuteFilter");
  device_ = calls->new_device(kCpuDevice);
  if (!device_) fail(Failure::Work, "Open Image Denoise opens no device of the CPU");
  calls_ = calls.release();
  calls_->commit_device(device_);
  check();
  const int version = calls_->device_int(device_, "version");  // 10403: 1.4.3
  name_ = "Open Image Denoise " + std::to_string(version / 10000) + "." + std::to_string(version / 100 % 100) + "." +
          std::to_string(version % 100);
}

// The library stays loaded: its threads may outlive the device.
Denoiser::~Denoiser() {
  if (calls_) calls_->release_device(device_);
  delete calls_;
}

void Denoiser::check() const {
  const char* text = nullptr;
  if (calls_->device_error(device_, &text) != 0) fail(Failure::Work, "Open Image Denoise: {}", text ? text : "failed");
}

std::vector<float> Denoiser::clean(const NoisyPicture& picture) const {
  std::vector<float> result(picture.color.size());
  const std::unique_ptr<void, void (*)(void*)> filter(calls_->new_filter(device_, "RT"), calls_->release_filter);
  check();
  const auto give = [&](const char* name, const std::vector<float>& values) {
    calls_->set_image(filter.get(), name, const_cast<float*>(values.data()), kFloat3, picture.width, picture.height, 0,
                      0, 0);
  };
  give("color", picture.color);
  give("albedo", picture.albedo);
  give("normal", picture.normal);
  give("output", result);
  calls_->set_bool(filter.get(), "hdr", true);
  calls_->commit_filter(filter.get());
  calls_->execute(filter.get());
  check();
  return result;
}

}  // namespace ballot
