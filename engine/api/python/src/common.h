// What the parts of the extension share: objects of the library in Python's hands, the GIL, and Ctrl-C.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <ballot/ballot.h>

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstring>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

namespace ballot::python {

namespace nb = nanobind;

/// Tuples, lists and dicts of objects, as the stub of the extension names them.
using Objects = nb::typed<nb::tuple, nb::any, nb::ellipsis>;
using ObjectList = nb::typed<nb::list, nb::any>;
using ObjectDict = nb::typed<nb::dict, std::string, nb::any>;

struct Task;
class Worker;

/// Returns true while the calling thread runs Python code inside a call of the library, which then holds the device.
bool inside_call();
/// Lets go of an object, and then of what it works on: now, or if inside_call() once the call has ended.
void let_go(std::shared_ptr<void> object, nb::object works_on = {});
/// Prepares a child of fork(), which has none of its parent's threads.
void after_fork();
/// Ends the calls of other threads: waits for those that run, and stops those that come.
void end();
/// Throws Error unless the library may be called: a call from a progress function would wait for itself.
void check_may_call();

/// Releases the GIL for a scope in which the library is called. Once the interpreter ends, threads other than its last
/// stop here: the driver is about to go, and Python's daemon threads cannot take the GIL again.
class Unlocked {
 public:
  Unlocked();
  ~Unlocked();
  Unlocked(const Unlocked&) = delete;
  Unlocked& operator=(const Unlocked&) = delete;

 private:
  PyThreadState* state_;
};

/// Runs call(object) without the GIL. Every call that may wait for a device has to: the thread that has the device may
/// want the GIL. The last reference to the object is let go of without the GIL too.
template <class T, class Call>
auto without_gil(std::shared_ptr<T> object, const Call& call) {
  check_may_call();
  const Unlocked unlocked;
  const std::shared_ptr<T> kept = std::move(object);
  return call(*kept);
}

/// An object of the library that Python owns and can close.
template <class T>
class Kept {
 public:
  /// `what` names the object in error texts. `works_on` lives as long as the object.
  Kept(const char* what, std::shared_ptr<T> object, nb::object works_on = {})
      : what_(what), object_(std::move(object)), works_on_(std::move(works_on)) {}
  Kept(Kept&&) noexcept = default;
  Kept(const Kept&) = delete;
  Kept& operator=(const Kept&) = delete;
  ~Kept() { close(); }

  void close() {
    if (object_) let_go(std::exchange(object_, nullptr), std::move(works_on_));
  }
  bool closed() const { return !object_; }
  /// Throws Error(Closed) if it is closed.
  std::shared_ptr<T> use() const {
    if (!object_) throw Error(BALLOT_ERROR_CLOSED, std::string(what_) + ": it was closed; make a new one");
    return object_;
  }

 private:
  const char* what_;
  std::shared_ptr<T> object_;
  nb::object works_on_;
};

/// The progress function of a call that may take long. Belongs to the call's task.
class Watch {
 public:
  /// `user` is called with the share that is done, and may end the call by returning False; None: nobody.
  explicit Watch(nb::object user) : user_(std::move(user)), has_user_(!user_.is_none()) {}
  /// Returns false to end the call. Called without the GIL, by any thread, by one at a time.
  bool operator()(double done) noexcept;
  /// Has a thread do the work and waits a little. Returns false if it then goes on. Ctrl-C has to wait no longer.
  bool leave(const std::shared_ptr<Task>& task, Worker& worker);

 private:
  friend void run(std::shared_ptr<Task> task, bool short_);
  friend class Worker;
  bool call_user(double done) noexcept;
  bool has_tried(Task& task);
  void look(const std::shared_ptr<Task>& task, Worker& worker);
  bool give_up(std::unique_lock<std::mutex>& lock);

  nb::object user_;
  bool has_user_, away_ = false;  // away: another thread works while the main thread looks for signals
  bool tries_ = false;            // the main thread works, unless the call is about to wait
  std::exception_ptr raised_;     // what Python code raised
  std::atomic<bool> stop_{false};
  // Of a call whose work is away.
  std::mutex mutex_;
  std::condition_variable changed_;
  double done_ = 0;
  bool asks_ = false, ended_ = false, abandoned_ = false;
};

/// Questions of a call that is likely to end at once.
constexpr std::size_t kFew = 1 << 10;

/// The work of a call, with all that it uses. It is let go of with the GIL.
struct Task {
  explicit Task(nb::object progress) : watch(std::move(progress)) {}
  virtual ~Task() = default;
  /// Does the work, without the GIL. If it has thrown, it may be called again before drop().
  virtual void work() = 0;
  /// Lets go of the result and of what is worked on, without the GIL.
  virtual void drop() = 0;
  Watch watch;
  std::exception_ptr failure;
};

/// Runs a task and throws what it has thrown, or what Python code has raised. The main thread has another one do the
/// work and looks for signals meanwhile: Ctrl-C ends the call at once. Work that cannot stop goes on, with its task, to
/// an end that nobody waits for. Work that is `short_` the main thread does itself, if it need not wait for anything:
/// to have another thread do it takes longer than a few questions do.
void run(std::shared_ptr<Task> task, bool short_ = false);

/// Runs call(object, watch) as a task and returns what it returned. The call has to own what it uses.
template <class T, class Call>
auto watched(std::shared_ptr<T> object, nb::object progress, Call call, bool short_ = false) {
  using Result = decltype(call(*object, std::declval<Watch&>()));
  struct Work : Task {
    Work(nb::object progress_, std::shared_ptr<T> object_, Call call_)
        : Task(std::move(progress_)), on(std::move(object_)), does(std::move(call_)) {}
    void work() override {
      result.emplace(does(*on, watch));
      on.reset();
    }
    void drop() override { result.reset(), on.reset(); }
    std::shared_ptr<T> on;
    Call does;
    std::optional<Result> result;
  };
  const auto work = std::make_shared<Work>(std::move(progress), std::move(object), std::move(call));
  run(work, short_);
  return std::move(*work->result);
}

/// Makes what belongs to no object, by make(watch), as a task.
template <class Make>
auto made(Make make) {
  return watched(std::make_shared<char>(), nb::none(), [=](char, Watch& watch) { return make(watch); });
}

/// The Python classes of the library's objects.
struct DeviceObject : Kept<Device> {
  explicit DeviceObject(std::shared_ptr<Device> device) : Kept("device", std::move(device)) {}
};
struct SceneObject : Kept<Scene> {
  explicit SceneObject(std::shared_ptr<Scene> scene) : Kept("scene", std::move(scene)) {}
};
using Buffer = detail::Handle<BallotBuffer, ballot_buffer_destroy>;
struct ArrayObject : Kept<Buffer> {
  ArrayObject(std::shared_ptr<Buffer> buffer, BallotRecord of, std::uint64_t records)
      : Kept("array", std::move(buffer)), record(of), count(records) {}
  /// Returns the numbers of a record.
  std::size_t width() const {
    constexpr std::size_t kWidths[] = {8, 4, 4, 8, 1, 1, 3, 2, 1, 12, 1, 1, 4};  // in the order of BallotRecord
    return kWidths[record];
  }
  /// Returns the axes of the array: records of one number have no second one.
  std::vector<std::size_t> shape() const {
    return width() > 1 ? std::vector{std::size_t(count), width()} : std::vector{std::size_t(count)};
  }
  /// Returns the type of the numbers.
  nb::dlpack::dtype type() const {
    return record == BALLOT_RECORD_UINT32    ? nb::dtype<std::uint32_t>()
           : record == BALLOT_RECORD_UINT8   ? nb::dtype<std::uint8_t>()
           : record == BALLOT_RECORD_INT64   ? nb::dtype<std::int64_t>()
           : record == BALLOT_RECORD_FLOAT64 ? nb::dtype<double>()
                                             : nb::dtype<float>();
  }
  BallotRecord record;
  std::uint64_t count;
};

/// Copies memory, much of it by several threads: one takes longer than a device does to fill it.
void copy_memory(std::byte* to, const void* from, std::size_t bytes);

/// Memory of a large result (memory.cpp), which is kept for others once it is let go of. Thread-safe, but for one
/// block.
class ResultBlock {
 public:
  ResultBlock() = default;
  explicit ResultBlock(std::size_t bytes);
  ~ResultBlock();
  ResultBlock(ResultBlock&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  ResultBlock& operator=(ResultBlock&&) = delete;

  void* data() const { return data_; }
  /// Has it hold `bytes` at least, of which the first `used` stay.
  void make_room(std::size_t bytes, std::size_t used);
  /// Returns the owner of an array over it.
  nb::capsule owner() &&;

 private:
  void* data_ = nullptr;
  std::size_t size_ = 0;
};

/// Registers a part of the extension.
void bind_errors(nb::module_& m);
void bind_devices(nb::module_& m);
void bind_memory(nb::module_& m);
void bind_scenes(nb::module_& m);
void bind_pictures(nb::class_<SceneObject>& scene);
void bind_answers(nb::module_& m, nb::class_<SceneObject>& scene);
void bind_arrays(nb::module_& m);
void bind_kernels(nb::module_& m);

/// The numbers that records are made of.
template <class T>
struct NumberOf {
  using Type = T;
};
template <>
struct NumberOf<Ray> {
  using Type = float;
};
template <>
struct NumberOf<RayDouble> {
  using Type = double;
};

/// Returns an array of NumPy that owns `data`.
template <class T>
auto array_of(std::vector<T>&& data, std::initializer_list<std::size_t> shape) {
  auto* kept = new std::vector<T>(std::move(data));
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return nb::ndarray<nb::numpy, typename NumberOf<T>::Type>(kept->data(), shape, owner);
}

}  // namespace ballot::python
