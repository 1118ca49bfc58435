#!/usr/bin/env python3
"""Arrays on a GPU that Ballot and CUDA share: CUDA writes rays, Ballot traces them, CUDA reads the hits.

Needs an NVIDIA GPU with its driver, and no Python package: both libraries are called through ctypes.

  tests/api/cuda_arrays.py build/release/libballot.so
"""

import ctypes
import math
import struct
import sys
import time

RAYS = 1_000_000


class Init(ctypes.Structure):
    """A struct of the C interface: its size, then members."""

    def __init__(self, **values):
        super().__init__(size=ctypes.sizeof(type(self)), **values)


class Mesh(Init):
    _fields_ = [("size", ctypes.c_size_t), ("positions", ctypes.c_void_p), ("vertex_count", ctypes.c_size_t),
                ("position_stride", ctypes.c_size_t), ("indices", ctypes.c_void_p), ("index_count", ctypes.c_size_t),
                ("index_type", ctypes.c_int), ("id", ctypes.c_uint32), ("normals", ctypes.c_void_p),
                ("normal_stride", ctypes.c_size_t)]


class DeviceOptions(Init):
    _fields_ = [("size", ctypes.c_size_t), ("name", ctypes.c_char_p), ("validate", ctypes.c_uint32)]


class BufferOptions(Init):
    _fields_ = [("size", ctypes.c_size_t), ("exported", ctypes.c_uint32)]


class Output(ctypes.Structure):
    _fields_ = [("column", ctypes.c_char_p), ("to", ctypes.c_void_p)]


class Times(Init):
    _fields_ = [("size", ctypes.c_size_t), ("seconds", ctypes.c_double), ("device_ms", ctypes.c_double),
                ("hits", ctypes.c_uint64)]


def main() -> None:
    ballot = ctypes.CDLL(sys.argv[1])
    ballot.ballot_last_error.restype = ctypes.c_char_p
    cuda = ctypes.CDLL("libcuda.so.1")

    def call(name: str, *arguments) -> None:
        if getattr(ballot, name)(*arguments):
            sys.exit(f"{name}: {ballot.ballot_last_error().decode()}")

    def cuda_call(name: str, *arguments) -> None:
        if result := getattr(cuda, name)(*arguments):
            sys.exit(f"{name}: CUDA error {result}")

    device, scene = ctypes.c_void_p(), ctypes.c_void_p()
    call("ballot_device_open", ctypes.byref(DeviceOptions(name=b"gpu")), ctypes.byref(device))
    square = (ctypes.c_float * 18)(0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0)
    mesh = Mesh(positions=ctypes.cast(square, ctypes.c_void_p), vertex_count=6)
    call("ballot_scene_create", device, ctypes.byref(mesh), ctypes.c_size_t(1), None, ctypes.byref(scene))

    buffers, addresses = [], []
    for record in (0, 1):  # rays, hits
        buffer, address, gpu = ctypes.c_void_p(), ctypes.c_uint64(), ctypes.c_int()
        call("ballot_buffer_create", device, record, ctypes.c_uint64(RAYS), ctypes.byref(BufferOptions(exported=1)),
             ctypes.byref(buffer))
        call("ballot_buffer_cuda", buffer, ctypes.byref(address), ctypes.byref(gpu))
        buffers.append(buffer)
        addresses.append(address)
    context = ctypes.c_void_p()
    cuda_call("cuDevicePrimaryCtxRetain", ctypes.byref(context), gpu)
    cuda_call("cuCtxSetCurrent", context)

    # Half of the rays meet the square at t = 2, half pass beside it.
    some = b"".join(struct.pack("<8f", 0.25 + 2 * (i % 2), 0.5, 2, 0, 0, 0, -1, 9) for i in range(1000))
    rays = some * (RAYS // 1000)
    cuda_call("cuMemcpyHtoD_v2", addresses[0], rays, ctypes.c_size_t(len(rays)))
    cuda_call("cuCtxSynchronize")
    times, hits = Times(), Output(b"hits", buffers[1])
    for _ in range(20):
        call("ballot_trace_buffers", scene, buffers[0], ctypes.c_uint64(RAYS), ctypes.byref(hits), ctypes.c_size_t(1),
             None, ctypes.byref(times))
    by_cuda, by_ballot = ctypes.create_string_buffer(16 * RAYS), ctypes.create_string_buffer(16 * RAYS)
    cuda_call("cuMemcpyDtoH_v2", by_cuda, addresses[1], ctypes.c_size_t(16 * RAYS))
    call("ballot_buffer_read", buffers[1], ctypes.c_uint64(0), by_ballot, ctypes.c_uint64(RAYS))
    if by_cuda.raw != by_ballot.raw:
        sys.exit("CUDA and Ballot see different hits")
    for i in range(1000):
        t, prim = struct.unpack_from("<fI", by_cuda.raw, 16 * i)
        if (t, prim == 0xFFFFFFFF) != ((math.inf, True) if i % 2 else (2, False)):
            sys.exit(f"ray {i}: t {t}, prim {prim}")
    print(f"{RAYS} rays written by CUDA, {RAYS} hits read by CUDA: right; {times.device_ms:.3f} ms on the device, "
          f"{times.seconds * 1e3:.3f} ms for the call")
    start = time.time()
    for buffer in buffers:
        ballot.ballot_buffer_destroy(buffer)
    ballot.ballot_scene_destroy(scene)
    ballot.ballot_device_close(device)
    print(f"closed in {time.time() - start:.3f} s")


if __name__ == "__main__":
    main()
