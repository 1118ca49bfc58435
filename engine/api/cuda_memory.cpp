#include "engine/api/cuda_memory.h"

#include <dlfcn.h>
#include <unistd.h>

#include <cstring>

#include "engine/core/error.h"
#include "engine/gpu/buffer.h"

namespace ballot::api {

namespace {

// Declarations of the CUDA driver's interface as far as it is used here (NVIDIA. CUDA Driver API. External Resource
// Interoperability). Its types are plain C.
using CuResult = int;
struct CuUuid {
  unsigned char bytes[16];
};
struct CuHandleDesc {  // CUDA_EXTERNAL_MEMORY_HANDLE_DESC
  int type;            // 1: opaque file descriptor
  union {
    int fd;
    struct {
      void* handle;
      const void* name;
    } win32;
    const void* object;
  } handle;
  unsigned long long size;
  unsigned int flags;
  unsigned int reserved[16];
};
struct CuBufferDesc {  // CUDA_EXTERNAL_MEMORY_BUFFER_DESC
  unsigned long long offset, size;
  unsigned int flags;
  unsigned int reserved[16];
};
constexpr int kOpaqueFd = 1;

struct Driver {
  CuResult (*init)(unsigned) = nullptr;
  CuResult (*device_count)(int*) = nullptr;
  CuResult (*device_get)(int*, int) = nullptr;
  CuResult (*device_uuid)(CuUuid*, int) = nullptr;
  CuResult (*retain)(void**, int) = nullptr;
  CuResult (*release)(int) = nullptr;
  CuResult (*push)(void*) = nullptr;
  CuResult (*pop)(void**) = nullptr;
  CuResult (*import)(void**, const CuHandleDesc*) = nullptr;
  CuResult (*map)(unsigned long long*, void*, const CuBufferDesc*) = nullptr;
  CuResult (*free)(unsigned long long) = nullptr;
  CuResult (*destroy)(void*) = nullptr;
  CuResult (*copy)(unsigned long long, unsigned long long, std::size_t) = nullptr;
  CuResult (*synchronize)(void*) = nullptr;
  CuResult (*error_name)(CuResult, const char**) = nullptr;
};

template <class Function>
void load(void* library, const char* name, Function& function) {
  function = reinterpret_cast<Function>(dlsym(library, name));
  if (!function) fail(Failure::Device, "libcuda.so.1 has no {}; update the NVIDIA driver", name);
}

const Driver& driver() {
  static const Driver loaded = [] {
    void* library = dlopen("libcuda.so.1", RTLD_NOW | RTLD_LOCAL);
    if (!library)
      fail(Failure::Device, "there is no CUDA driver: libcuda.so.1 was not found; it comes with NVIDIA's driver");
    Driver d;
    load(library, "cuInit", d.init);
    load(library, "cuDeviceGetCount", d.device_count);
    load(library, "cuDeviceGet", d.device_get);
    load(library, "cuDeviceGetUuid", d.device_uuid);
    load(library, "cuDevicePrimaryCtxRetain", d.retain);
    load(library, "cuDevicePrimaryCtxRelease_v2", d.release);
    load(library, "cuCtxPushCurrent_v2", d.push);
    load(library, "cuCtxPopCurrent_v2", d.pop);
    load(library, "cuImportExternalMemory", d.import);
    load(library, "cuExternalMemoryGetMappedBuffer", d.map);
    load(library, "cuMemFree_v2", d.free);
    load(library, "cuDestroyExternalMemory", d.destroy);
    load(library, "cuMemcpyDtoD_v2", d.copy);
    load(library, "cuStreamSynchronize", d.synchronize);
    load(library, "cuGetErrorName", d.error_name);
    return d;
  }();
  return loaded;
}

void check(CuResult result, const char* call) {
  if (result == 0) return;
  const char* name = nullptr;
  driver().error_name(result, &name);
  fail(Failure::Work, "CUDA: {}: {}", call, name ? name : "unknown error");
}

int device_of(const std::uint8_t* uuid) {
  check(driver().init(0), "cuInit");
  int count = 0;
  check(driver().device_count(&count), "cuDeviceGetCount");
  for (int i = 0; i < count; ++i) {
    int device = 0;
    CuUuid of{};
    check(driver().device_get(&device, i), "cuDeviceGet");
    check(driver().device_uuid(&of, device), "cuDeviceGetUuid");
    if (std::memcmp(of.bytes, uuid, sizeof of.bytes) == 0) return device;
  }
  fail(Failure::Device, "none of the {} CUDA devices is the GPU that this buffer is on", count);
}

/// Makes a context current for a scope.
class Current {
 public:
  explicit Current(void* context) { check(driver().push(context), "cuCtxPushCurrent"); }
  ~Current() {
    void* old = nullptr;
    driver().pop(&old);
  }
  Current(const Current&) = delete;
  Current& operator=(const Current&) = delete;
};

}  // namespace

CudaMemory::CudaMemory(const RawBuffer& buffer, const std::uint8_t* uuid) : device_(device_of(uuid)) {
  check(driver().retain(&context_, device_), "cuDevicePrimaryCtxRetain");
  int fd = -1;
  try {
    const Current current(context_);
    fd = buffer.export_fd();
    CuHandleDesc handle{};
    handle.type = kOpaqueFd;
    handle.handle.fd = fd;
    handle.size = buffer.allocated_bytes();
    check(driver().import(&memory_, &handle), "cuImportExternalMemory");
    fd = -1;  // CUDA owns it now
    CuBufferDesc part{};
    part.size = buffer.bytes();
    unsigned long long address = 0;
    check(driver().map(&address, memory_, &part), "cuExternalMemoryGetMappedBuffer");
    address_ = address;
  } catch (...) {
    if (fd >= 0) close(fd);
    if (memory_) driver().destroy(memory_);
    driver().release(device_);
    throw;
  }
}

void CudaMemory::copy_from(std::uint64_t address, std::uint64_t offset, std::uint64_t bytes) const {
  if (bytes == 0) return;
  const Current current(context_);
  check(driver().copy(address_ + offset, address, bytes), "cuMemcpyDtoD");
  check(driver().synchronize(nullptr), "cuStreamSynchronize");
}

CudaMemory::~CudaMemory() {
  driver().push(context_);
  driver().free(address_);
  driver().destroy(memory_);
  void* old = nullptr;
  driver().pop(&old);
  driver().release(device_);
}

}  // namespace ballot::api
