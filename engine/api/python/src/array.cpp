// Arrays of records on a device, in Python.
#include "common.h"

namespace ballot::python {

namespace {

using Rows = nb::ndarray<nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using ConstRows = nb::ndarray<nb::ro, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

void make_array(ArrayObject* self, const DeviceObject& device, int record, std::uint64_t count, bool exported) {
  auto buffer = watched(device.use(), nb::none(), [=](const Device& d, Watch&) {
    const BallotBufferOptions options{.exported = exported};
    BallotBuffer* made = nullptr;
    check(ballot_buffer_create(d.handle(), BallotRecord(record), count, &options, &made));
    return std::make_shared<Buffer>(made);
  });
  new (self) ArrayObject(std::move(buffer), BallotRecord(record), count);
}

template <class Array>
void check_width(const ArrayObject& self, const Array& array) {
  if (array.dtype() != self.type()) throw nb::type_error("records: the array has another dtype");
  if (array.shape(1) != self.width())
    throw Error(BALLOT_ERROR_ARGUMENT, "rows of " + std::to_string(array.shape(1)) +
                                           " numbers; the array has rows of " + std::to_string(self.width()));
}

void write(const ArrayObject& self, const ConstRows& records, std::uint64_t first) {
  check_width(self, records);
  watched(self.use(), nb::none(), [=](const Buffer& b, Watch&) {
    check(ballot_buffer_write(b.get(), first, records.data(), records.shape(0)));
    return true;
  });
}

void write_cuda(const ArrayObject& self, std::uint64_t address, std::uint64_t count, std::uint64_t first) {
  watched(self.use(), nb::none(), [=](const Buffer& b, Watch&) {
    check(ballot_buffer_write_cuda(b.get(), first, address, count));
    return true;
  });
}

void read(const ArrayObject& self, const Rows& records, std::uint64_t first) {
  check_width(self, records);
  watched(self.use(), nb::none(), [=](const Buffer& b, Watch&) {
    check(ballot_buffer_read(b.get(), first, records.data(), records.shape(0)));
    return true;
  });
}

/// Returns a capsule that keeps the memory of an array for those who view it.
nb::capsule keeper(const ArrayObject& self) {
  return nb::capsule(new std::shared_ptr<Buffer>(self.use()), [](void* p) noexcept {
    auto* buffer = static_cast<std::shared_ptr<Buffer>*>(p);
    let_go(std::move(*buffer));
    delete buffer;
  });
}

/// Returns a framework's array over the memory of an array, with its shape and type.
template <class Framework, class Device>
nb::object view_of(const ArrayObject& self, void* data, int device) {
  const auto shape = self.shape();
  return nb::cast(nb::ndarray<Framework, Device>(data, shape.size(), shape.data(), keeper(self), nullptr, self.type(),
                                                 Device::value, device));
}

/// Returns the array's memory as an array of NumPy, or None if the host does not have it.
nb::object host(const ArrayObject& self) {
  void* data = without_gil(self.use(), [](const Buffer& b) { return ballot_buffer_host(b.get()); });
  if (!data) return nb::none();
  return view_of<nb::numpy, nb::device::cpu>(self, data, 0);
}

std::tuple<std::uint64_t, int> cuda(const ArrayObject& self) {
  std::uint64_t address = 0;
  int device = 0;
  without_gil(self.use(), [&](const Buffer& b) { check(ballot_buffer_cuda(b.get(), &address, &device)); });
  return {address, device};
}

/// Returns an object with __dlpack__ over the memory, on CUDA's device.
nb::object cuda_view(const ArrayObject& self) {
  const auto [address, device] = cuda(self);
  return view_of<nb::array_api, nb::device::cuda>(self, reinterpret_cast<void*>(address), device);
}

std::tuple<int, std::uint64_t> fd(const ArrayObject& self) {
  int number = -1;
  std::uint64_t bytes = 0;
  without_gil(self.use(), [&](const Buffer& b) { check(ballot_buffer_fd(b.get(), &number, &bytes)); });
  return {number, bytes};
}

}  // namespace

void bind_arrays(nb::module_& m) {
  nb::class_<ArrayObject>(m, "Array")
      .def("__init__", &make_array)
      .def("close", &ArrayObject::close)
      .def_prop_ro("closed", &ArrayObject::closed)
      .def("write", &write, nb::arg("records").noconvert(), nb::arg("first"),
           nb::sig("def write(self, records: numpy.typing.NDArray[typing.Any], first: int) -> None"))
      .def("read", &read, nb::arg("records").noconvert(), nb::arg("first"),
           nb::sig("def read(self, records: numpy.typing.NDArray[typing.Any], first: int) -> None"))
      .def("write_cuda", &write_cuda, nb::arg("address"), nb::arg("count"), nb::arg("first"))
      .def("host", &host, nb::sig("def host(self) -> numpy.typing.NDArray[typing.Any] | None"))
      .def("cuda", &cuda)
      .def("cuda_view", &cuda_view, nb::sig("def cuda_view(self) -> typing.Any"))
      .def("fd", &fd);
}

}  // namespace ballot::python
