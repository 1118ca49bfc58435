// The extension ballot._ballot: devices, errors, the GIL, signals during calls, and the end of the interpreter. The
// package around it checks and shapes arguments; see ballot/__init__.py.
#include "common.h"

#include <atomic>
#include <chrono>
#include <thread>

namespace ballot::python {

namespace {

/// An object to let go of, and what it works on.
struct Left {
  std::shared_ptr<void> object;
  nb::object works_on;
};

thread_local int inside = 0;          // 1 while a call of the library runs Python code
thread_local std::vector<Left> late;  // to let go of once that call has ended

std::atomic<int> running{0};                           // scopes of Unlocked
std::atomic<std::thread::id> last{std::thread::id{}};  // the only thread that may call, once the interpreter ends

/// Ends the calls of other threads: waits for those that run, and stops those that come.
void end() {
  last = std::this_thread::get_id();
  const nb::gil_scoped_release unlocked;
  while (running > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

/// Marks that Python code runs inside a call of the library.
class Inside {
 public:
  Inside() { ++inside; }
  ~Inside() { --inside; }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;
};

/// Raises an Error as an exception of Python.
void raise(const Error& e) {
  nb::object text =
      nb::steal(PyUnicode_DecodeUTF8(e.what(), Py_ssize_t(std::char_traits<char>::length(e.what())), "replace"));
  if (e.code() == Code::Argument) {
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

std::tuple<std::string, std::string, std::string, bool, std::uint32_t, bool> tuple_of(const DeviceInfo& d) {
  return {d.name, d.driver, d.refusal, d.is_cpu, d.subgroup_size, d.exports};
}

nb::typed<nb::dict, std::string, std::vector<std::string>> names_of_all() {
  nb::dict all;
  all["methods"] = nb::cast(names(Names::Methods));
  all["numeric"] = nb::cast(names(Names::Numeric));
  all["builders"] = nb::cast(names(Names::Builders));
  all["ray_kinds"] = nb::cast(names(Names::RayKinds));
  all["shadings"] = nb::cast(names(Names::Shadings));
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

}  // namespace

Unlocked::Unlocked() {
  const std::thread::id only = last;
  if (only != std::thread::id{} && only != std::this_thread::get_id()) {
    PyEval_SaveThread();
    while (true) std::this_thread::sleep_for(std::chrono::hours(1));
  }
  ++running;
  state_ = PyEval_SaveThread();
}

Unlocked::~Unlocked() {
  PyEval_RestoreThread(state_);
  --running;
}

bool inside_call() { return inside > 0; }

void let_go_late() {
  for (Left& left : std::exchange(late, {})) let_go(std::move(left.object), std::move(left.works_on));
}

void let_go(std::shared_ptr<void> object, nb::object works_on) {
  if (inside_call()) {
    late.push_back({std::move(object), std::move(works_on)});
    return;
  }
  const Unlocked unlocked;
  object.reset();
}

void check_may_call() {
  if (inside_call())
    throw Error(
        Code::Work,
        "ballot was called from a progress function or a signal handler while another call was running; call it "
        "after that one has returned");
}

bool Watch::operator()(double done) noexcept {
  const nb::gil_scoped_acquire locked;
  const Inside mark;
  try {
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
    return user_.is_none() || !user_(done).is(nb::handle(Py_False));
  } catch (...) {
    raised_ = std::current_exception();
    return false;
  }
}

void bind_errors(nb::module_&) {
  nb::register_exception_translator([](const std::exception_ptr& caught, void*) {
    try {
      std::rethrow_exception(caught);
    } catch (const Error& e) {
      raise(e);
    }
  });
}

void bind_devices(nb::module_& m) {
  m.def("devices", [] {
    std::vector<decltype(tuple_of(DeviceInfo{}))> list;
    for (const DeviceInfo& d : made([] { return devices(); })) list.push_back(tuple_of(d));
    return list;
  });
  nb::class_<DeviceObject>(m, "Device")
      .def("__init__",
           [](DeviceObject* self, const std::string& name, bool validate) {
             new (self) DeviceObject(made([&] { return std::make_shared<Device>(name, validate); }));
           })
      .def("close", &DeviceObject::close)
      .def_prop_ro("closed", &DeviceObject::closed)
      .def("info",
           [](const DeviceObject& self) {
             return tuple_of(without_gil(self.use(), [](const Device& d) { return d.info(); }));
           })
      .def("message_count", [](const DeviceObject& self) {
        return without_gil(self.use(), [](const Device& d) { return ballot_device_message_count(d.handle()); });
      });
}

}  // namespace ballot::python

NB_MODULE(_ballot, m) {
  using namespace ballot::python;
  nb::set_leak_warnings(false);  // objects that live as long as the interpreter are no leak
  m.def("version", [] { return ballot::version(); });
  m.def("names", &names_of_all,
        "Returns the names that arguments take, a dict of lists: methods, numeric, builders, ray_kinds and shadings.");
  m.def("end", &end);
  m.def("after_fork", [] { running = 0; });  // the threads of the parent are not here
  m.def("commit", [] { return std::string(ballot_commit()); });
  m.def("view", &view<nb::ndarray<nb::ro, nb::device::cpu>, nb::ndarray<nb::numpy, nb::ro>>,
        nb::arg("array").noconvert(), nb::sig("def view(array: object) -> numpy.typing.NDArray[typing.Any]"));
  m.def("view_writable", &view<nb::ndarray<nb::device::cpu>, nb::ndarray<nb::numpy>>, nb::arg("array").noconvert(),
        nb::sig("def view_writable(array: object) -> numpy.typing.NDArray[typing.Any]"));
  bind_errors(m);
  bind_devices(m);
  bind_memory(m);
  bind_scenes(m);
}
