// Kernels of the user. ballot.h includes it.
#pragma once

#include <initializer_list>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "ballot_device.h"

namespace ballot {
inline namespace v1 {

class Scene;

/// An array or number of a kernel in a run, as {"rays", array} or {"reach", 2.f}. Refers to both.
struct Input : BallotInput {
  /// An array of any records.
  template <class T>
  Input(const char* named, const Array<T>& array) : BallotInput{.name = named, .buffer = array.handle()} {}
  /// A number: float, std::int32_t or std::uint32_t, or a struct or array of 2 to 4 of them.
  template <class T>
  Input(const char* named, const T& value) : BallotInput{.name = named, .number = &value, .bytes = sizeof(T)} {
    static_assert(std::is_trivially_copyable_v<T>, "the device sees bytes, not objects");
  }
};

/// GLSL of the user with `void main(uint index)`, which asks a scene by nearest(), any(), count() and closest(), and
/// declares the arrays and numbers that it works on: ballot_kernel_create() in ballot_c_kernels.h.
class Kernel {
 public:
  /// Throws Error(BALLOT_ERROR_ARGUMENT) with the compiler's messages if the text does not compile.
  Kernel(const Device& device, const std::string& text, const KernelOptions& options = {}) {
    BallotKernel* kernel = nullptr;
    check(ballot_kernel_create(device.handle(), text.c_str(), &options, &kernel));
    handle_ = Owner(kernel);
  }
  /// Returns the arrays and numbers that the text declares, arrays first.
  std::vector<InputInfo> inputs() const {
    std::size_t count = 0;
    check(ballot_kernel_inputs(handle_.get(), nullptr, 0, &count));
    std::vector<InputInfo> all(count);
    check(ballot_kernel_inputs(handle_.get(), all.data(), count, &count));
    return all;
  }
  /// Calls main() for each index below `count`, and returns when all are done: ballot_kernel_run(). `inputs` has each
  /// array and number of the text. The query may have progress alone.
  Times run(const Scene& scene, std::size_t count, std::span<const Input> inputs, const Query& query = {}) const;
  /// The same for inputs as they are named: kernel.run(scene, n, {{"rays", rays}, {"reach", 2.f}}).
  Times run(const Scene& scene, std::size_t count, std::initializer_list<Input> inputs, const Query& query = {}) const {
    return run(scene, count, std::span(inputs.begin(), inputs.size()), query);
  }
  /// Returns the handle of the C interface, which stays this object's.
  BallotKernel* handle() const { return handle_.get(); }

 private:
  using Owner = detail::Handle<BallotKernel, ballot_kernel_destroy>;
  Owner handle_;
};

}  // namespace v1
}  // namespace ballot
