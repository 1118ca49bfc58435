// Kernels of the user, in Python.
#include "door.h"

namespace ballot::python {

namespace {

struct KernelObject : Kept<Kernel> {
  KernelObject(std::shared_ptr<Kernel> kernel, std::shared_ptr<Device> on)
      : Kept("kernel", std::move(kernel)), device(std::move(on)) {}
  std::shared_ptr<Device> device;
};

void make_kernel(KernelObject* self, const DeviceObject& device, const std::string& text, const std::string& name,
                 const std::string& file, std::uint32_t first_line, const std::string& numeric) {
  auto on = device.use();
  auto kernel = watched(on, nb::none(), [=](const Device& d, Watch&) {
    return std::make_shared<Kernel>(
        d, text, KernelOptions{.name = name, .file = file, .first_line = first_line, .numeric = numeric});
  });
  new (self) KernelObject(std::move(kernel), std::move(on));
}

using Bytes = nb::ndarray<std::uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

/// An array of a run: on the device, or in the host's memory, from which it is copied there, and back if it is written.
struct RunArray {
  /// (name, array, is written)
  explicit RunArray(const nb::tuple& given) : name(nb::cast<std::string>(given[0])), back(nb::cast<bool>(given[2])) {
    if (nb::isinstance<ArrayObject>(given[1]))
      there = nb::cast<const ArrayObject&>(given[1]).use();
    else
      here = nb::cast<Bytes>(given[1], false);
  }
  void send(const Device& device) {
    if (there) return;
    BallotBuffer* buffer = nullptr;
    check(ballot_buffer_create(device.handle(), BALLOT_RECORD_FLOAT32, words(), nullptr, &buffer));
    there = std::make_shared<Buffer>(buffer);
    check(ballot_buffer_write(buffer, 0, here.data(), words()));
  }
  void fetch() const {
    if (back && here.data()) check(ballot_buffer_read(there->get(), 0, here.data(), words()));
  }
  std::size_t words() const { return here.size() / sizeof(float); }

  std::string name;
  bool back;
  Bytes here;
  std::shared_ptr<Buffer> there;
};

/// arrays: (name, array, is written) each; numbers: (name, bytes) each.
Objects run_kernel(const KernelObject& self, const SceneObject& scene, std::uint64_t count, const ObjectList& arrays,
                   const ObjectDict& numbers, nb::object progress) {
  std::vector<RunArray> all;
  for (const nb::handle array : arrays) all.emplace_back(nb::cast<nb::tuple>(array));
  std::vector<std::pair<std::string, std::string>> values;
  for (const auto [name, value] : numbers) {
    const auto bytes = nb::cast<nb::bytes>(value);
    values.emplace_back(nb::cast<std::string>(name), std::string(bytes.c_str(), bytes.size()));
  }
  const Times times = watched(
      self.use(), std::move(progress), [=, on = self.device, of = scene.use()](const Kernel& kernel, Watch& watch) {
        std::vector<RunArray> sent = all;  // the arrays of this run alone go with it
        std::vector<BallotInput> inputs;
        for (RunArray& one : sent) {
          one.send(*on);
          inputs.push_back(BallotInput{.name = one.name, .buffer = one.there->get()});
        }
        for (const auto& [name, value] : values)
          inputs.push_back(BallotInput{.name = name, .number = value.data(), .bytes = value.size()});
        const BallotQuery query{.progress = watch};
        Times spent;
        check(ballot_kernel_run(kernel.handle(), of->handle(), count, inputs.data(), inputs.size(), &query, &spent));
        for (const RunArray& one : sent) one.fetch();
        return spent;
      });
  return tuple_of(&times, door::kTimesRows);
}

ObjectList inputs_of(const KernelObject& self) {
  ObjectList list = nb::list();
  for (const InputInfo& input : without_gil(self.use(), [](const Kernel& k) { return k.inputs(); }))
    list.append(tuple_of(&input, door::kInputInfoRows));
  return list;
}

}  // namespace

void bind_kernels(nb::module_& m) {
  nb::class_<KernelObject>(m, "Kernel")
      .def("__init__", &make_kernel)
      .def("close", &KernelObject::close)
      .def_prop_ro("closed", &KernelObject::closed)
      .def("inputs", &inputs_of)
      .def("run", &run_kernel, nb::arg("scene"), nb::arg("count"), nb::arg("arrays"), nb::arg("numbers"),
           nb::arg("progress").none());
}

}  // namespace ballot::python
