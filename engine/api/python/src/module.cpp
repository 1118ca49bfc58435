// The extension ballot._ballot: devices and errors. The package around it checks and shapes arguments; see
// ballot/__init__.py.
#include <dlfcn.h>

#include <cstdio>
#include <stdexcept>

#include "door.h"

namespace ballot::python {

namespace {

/// Raises an Error as an exception of Python.
void raise(const Error& e) {
  nb::object text =
      nb::steal(PyUnicode_DecodeUTF8(e.what(), Py_ssize_t(std::char_traits<char>::length(e.what())), "replace"));
  if (e.code() == BALLOT_ERROR_ARGUMENT) {
    PyErr_SetObject(PyExc_ValueError, text.ptr());
    return;
  }
  try {
    const nb::object type = nb::module_::import_("ballot._errors").attr("Error");
    PyErr_SetObject(type.ptr(), type(text, int(e.code())).ptr());
  } catch (nb::python_error& error) {
    error.restore();
  }
}

/// Says in plain words that memory is short, which a library's own text does not.
void raise_memory() {
  PyErr_SetString(PyExc_MemoryError, "out of memory; use a smaller scene or fewer rays at a time");
}

nb::typed<nb::dict, std::string, std::vector<std::string>> names_of_all() {
  nb::dict all;
  all["methods"] = nb::cast(names(BALLOT_NAMES_METHODS));
  all["numeric"] = nb::cast(names(BALLOT_NAMES_NUMERIC));
  all["builders"] = nb::cast(names(BALLOT_NAMES_BUILDERS));
  all["ray_kinds"] = nb::cast(names(BALLOT_NAMES_RAY_KINDS));
  all["shadings"] = nb::cast(names(BALLOT_NAMES_SHADINGS));
  return all;
}

/// Returns a NumPy array over the memory of an object that offers DLPack or the buffer protocol. Keeps that object
/// alive.
template <class From, class To>
nb::object view(const From& array) {
  nb::capsule owner(new From(array), [](void* p) noexcept { delete static_cast<From*>(p); });
  std::vector<std::size_t> shape(array.shape_ptr(), array.shape_ptr() + array.ndim());
  return nb::cast(To(array.data(), array.ndim(), shape.data(), owner, array.stride_ptr(), array.dtype()));
}

/// Returns the file of the library that this process has loaded.
std::string library() {
  Dl_info info{};
  return dladdr(reinterpret_cast<void*>(&ballot_version), &info) && info.dli_fname ? info.dli_fname : "";
}

/// Throws an exception that becomes ImportError if the library of this process is not one that the extension can use:
/// a process that has loaded a libballot.so.1 takes no second one.
void refuse_other_library() {
  int major = 0, minor = 0;
  if (std::sscanf(ballot_version(), "%d.%d", &major, &minor) == 2 && major == BALLOT_VERSION_MAJOR &&
      minor >= BALLOT_VERSION_MINOR)
    return;
  throw std::runtime_error("two versions of Ballot in one process: the package is of version " +
                           std::to_string(BALLOT_VERSION_MAJOR) + "." + std::to_string(BALLOT_VERSION_MINOR) +
                           ", but " + library() + " is loaded already, of version " + ballot_version() +
                           "; import ballot before what loads that, or update it");
}

}  // namespace

void bind_errors(nb::module_&) {
  nb::register_exception_translator([](const std::exception_ptr& caught, void*) {
    try {
      std::rethrow_exception(caught);
    } catch (const Error& e) {
      raise(e);
    } catch (const std::bad_alloc&) {
      raise_memory();
    } catch (const std::length_error&) {  // more than a container can hold
      raise_memory();
    }
  });
}

void bind_devices(nb::module_& m) {
  m.def("devices", [] {
    ObjectList list = nb::list();
    for (const DeviceInfo& d : made([](Watch&) { return devices(); })) list.append(tuple_of(&d, door::kDeviceInfoRows));
    return list;
  });
  nb::class_<DeviceObject>(m, "Device")
      .def("__init__",
           [](DeviceObject* self, const std::string& name, bool validate) {
             new (self) DeviceObject(made([=](Watch&) { return std::make_shared<Device>(name, validate); }));
           })
      .def("close", &DeviceObject::close)
      .def_prop_ro("closed", &DeviceObject::closed)
      .def("info",
           [](const DeviceObject& self) {
             const DeviceInfo info = without_gil(self.use(), [](const Device& d) { return d.info(); });
             return tuple_of(&info, door::kDeviceInfoRows);
           })
      .def("message_count", [](const DeviceObject& self) {
        return without_gil(self.use(), [](const Device& d) { return ballot_device_message_count(d.handle()); });
      });
}

}  // namespace ballot::python

NB_MODULE(_ballot, m) {
  using namespace ballot::python;
  refuse_other_library();
  nb::set_leak_warnings(false);  // objects that live as long as the interpreter are no leak
  m.def("version", [] { return ballot::version(); });
  m.def("names", &names_of_all,
        "Returns the names that arguments take, a dict of lists: methods, numeric, builders, ray_kinds and shadings.");
  m.def("end", &end);
  m.def("after_fork", &after_fork);
  m.def("library", &library);
  m.def("commit", [] { return std::string(ballot_commit()); });
  m.def("view", &view<nb::ndarray<nb::ro, nb::device::cpu>, nb::ndarray<nb::numpy, nb::ro>>,
        nb::arg("array").noconvert(), nb::sig("def view(array: object) -> numpy.typing.NDArray[typing.Any]"));
  m.def("view_writable", &view<nb::ndarray<nb::device::cpu>, nb::ndarray<nb::numpy>>, nb::arg("array").noconvert(),
        nb::sig("def view_writable(array: object) -> numpy.typing.NDArray[typing.Any]"));
  bind_errors(m);
  bind_devices(m);
  bind_memory(m);
  bind_scenes(m);
  bind_arrays(m);
  bind_kernels(m);
}
