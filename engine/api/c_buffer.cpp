// Arrays of records on a device, by the C interface.
#include "engine/api/state.h"

namespace ballot::api {
namespace {

/// Makes the array of a buffer.
void make_records(BufferState& to, BallotRecord record, std::uint64_t count, ballot::Access access) {
  const auto make = [&]<class T>(std::type_identity<T>, const char* name) {
    const std::uint64_t room = (count * sizeof(T) + 3) / 4 * 4 / sizeof(T);  // whole words
    to.array.emplace<Buffer<T>>(*to.device->gpu, room, access, name);
    to.records = count, to.record_bytes = sizeof(T);
  };
  switch (record) {
    case BALLOT_RECORD_RAY:
      return make(std::type_identity<Ray>(), "rays of the caller");
    case BALLOT_RECORD_HIT:
      return make(std::type_identity<Hit>(), "hits of the caller");
    case BALLOT_RECORD_POINT:
      return make(std::type_identity<ProbePoint>(), "points of the caller");
    case BALLOT_RECORD_NEAREST:
      return make(std::type_identity<Nearest>(), "nearest points of the caller");
    case BALLOT_RECORD_FLOAT32:
      return make(std::type_identity<float>(), "numbers of the caller");
    case BALLOT_RECORD_UINT32:
      return make(std::type_identity<std::uint32_t>(), "whole numbers of the caller");
    case BALLOT_RECORD_FLOAT32X3:
      return make(std::type_identity<glm::vec3>(), "vectors of the caller");
    case BALLOT_RECORD_FLOAT32X2:
      return make(std::type_identity<glm::vec2>(), "pairs of the caller");
    case BALLOT_RECORD_UINT8:
      return make(std::type_identity<std::uint8_t>(), "bytes of the caller");
    case BALLOT_RECORD_FLOAT32X12:
      return make(std::type_identity<ballot::Transform>(), "matrices of the caller");
    case BALLOT_RECORD_INT64:
      return make(std::type_identity<std::int64_t>(), "numbers of the caller");
    case BALLOT_RECORD_FLOAT64:
      return make(std::type_identity<double>(), "sums of the caller");
    case BALLOT_RECORD_FLOAT32X4:
      return make(std::type_identity<glm::vec4>(), "colors of the caller");
  }
  throw Refused(BALLOT_ERROR_ARGUMENT,
                fmt::format("ballot_buffer_create: record is {}; expected one of BALLOT_RECORD_...", int(record)));
}

void check_range(const BufferState& buffer, std::uint64_t first, std::uint64_t count, const void* records,
                 const char* call) {
  if (count) need(records, call, "records");
  if (first > buffer.records || count > buffer.records - first)
    throw Refused(BALLOT_ERROR_ARGUMENT,
                  fmt::format("{}: {} records from number {}, but it has {}", call, count, first, buffer.records));
}

/// Returns the memory of a buffer in CUDA's address space, where it is mapped at the first call.
const CudaMemory& cuda_of(BufferState& buffer) {
  if (!buffer.cuda) buffer.cuda = std::make_unique<CudaMemory>(buffer.raw(), buffer.device->gpu->info().uuid);
  return *buffer.cuda;
}

}  // namespace
}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_buffer_create(BallotDevice* device, BallotRecord record, uint64_t count,
                                  const BallotBufferOptions* options, BallotBuffer** buffer) {
  return guarded_use(device, [&](const std::shared_ptr<DeviceState>& d) {
    need(buffer, "ballot_buffer_create", "buffer");
    const BallotBufferOptions o = read_struct(options, "BallotBufferOptions");
    constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();
    if (count == 0 || count > kMost)
      throw Refused(BALLOT_ERROR_ARGUMENT, fmt::format("array: {} records; expected 1 to {}", count, kMost));
    const ballot::Access access =
        o.exported ? ballot::Access::Storage | ballot::Access::Exported : ballot::Access::Storage;
    auto state = std::make_shared<BufferState>();
    state->device = d;
    const DeviceHold hold(*d);
    make_records(*state, record, count, access);
    *buffer = buffers().add(std::move(state));
  });
}

BallotStatus ballot_buffer_write(BallotBuffer* buffer, uint64_t first, const void* records, uint64_t count) {
  return guarded_use(buffer, [&](const std::shared_ptr<BufferState>& state) {
    check_range(*state, first, count, records, "array");
    const DeviceHold hold(*state->device);
    const std::size_t record = state->record_bytes;
    state->raw().upload(first * record, records, count * record);
  });
}

BallotStatus ballot_buffer_read(BallotBuffer* buffer, uint64_t first, void* records, uint64_t count) {
  return guarded_use(buffer, [&](const std::shared_ptr<BufferState>& state) {
    check_range(*state, first, count, records, "array");
    const DeviceHold hold(*state->device);
    const std::size_t record = state->record_bytes;
    state->raw().download(first * record, records, count * record);
  });
}

void* ballot_buffer_host(BallotBuffer* buffer) {
  void* host = nullptr;
  guarded_use(buffer, [&](const std::shared_ptr<BufferState>& state) { host = state->raw().mapped(); });
  return host;
}

BallotStatus ballot_buffer_fd(BallotBuffer* buffer, int* fd, uint64_t* allocation_bytes) {
  return guarded_use(buffer, [&](const std::shared_ptr<BufferState>& state) {
    need(fd, "ballot_buffer_fd", "fd");
    need(allocation_bytes, "ballot_buffer_fd", "allocation_bytes");
    const DeviceHold hold(*state->device);
    *fd = state->raw().export_fd();
    *allocation_bytes = state->raw().allocated_bytes();
  });
}

BallotStatus ballot_buffer_cuda(BallotBuffer* buffer, uint64_t* address, int* cuda_device) {
  return guarded_use(buffer, [&](const std::shared_ptr<BufferState>& state) {
    need(address, "ballot_buffer_cuda", "address");
    need(cuda_device, "ballot_buffer_cuda", "cuda_device");
    const DeviceHold hold(*state->device);
    const CudaMemory& cuda = cuda_of(*state);
    *address = cuda.address();
    *cuda_device = cuda.device();
  });
}

BallotStatus ballot_buffer_write_cuda(BallotBuffer* buffer, uint64_t first, uint64_t address, uint64_t count) {
  return guarded_use(buffer, [&](const std::shared_ptr<BufferState>& state) {
    check_range(*state, first, count, reinterpret_cast<const void*>(address), "array");
    const DeviceHold hold(*state->device);
    const std::size_t record = state->record_bytes;
    cuda_of(*state).copy_from(address, first * record, count * record);
  });
}
