// Calls of the library: the GIL, signals during calls, and the end of the interpreter.
#include <chrono>
#include <system_error>
#include <thread>

#include "common.h"

namespace ballot::python {

namespace {

constexpr auto kLook = std::chrono::milliseconds(20);       // between two looks for signals
constexpr auto kPatience = std::chrono::milliseconds(200);  // for work that was asked to stop

/// An object to let go of, and what it works on.
struct Left {
  std::shared_ptr<void> object;
  nb::object works_on;
};

thread_local int inside = 0;          // 1 while a call of the library runs Python code
thread_local std::vector<Left> late;  // to let go of once that call has ended

std::atomic<int> running{0};                           // scopes of Unlocked, and work of other threads
std::atomic<std::thread::id> last{std::thread::id{}};  // the only thread that may call, once the interpreter ends
unsigned long main_thread = 0;                         // Python's number of the thread that signals are handled in
int abandoned = 0;                                     // work that goes on although its call has ended; with the GIL
auto& after_abandoned = *new std::vector<Left>;        // to let go of once there is none; with the GIL

/// Marks that Python code runs inside a call of the library.
class Inside {
 public:
  Inside() { ++inside; }
  ~Inside() { --inside; }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;
};

/// Lets go of what was kept until the end of a call.
void let_go_late() {
  for (Left& left : std::exchange(late, {})) let_go(std::move(left.object), std::move(left.works_on));
}

/// Does the work of a task and keeps what it throws. Without the GIL.
void do_work(Task& task) {
  try {
    task.work();
  } catch (...) {
    task.failure = std::current_exception();
    task.drop();
  }
}

bool is_main() {
  if (!main_thread)
    main_thread = nb::cast<unsigned long>(nb::module_::import_("threading").attr("main_thread")().attr("ident"));
  return PyThread_get_thread_ident() == main_thread;
}

}  // namespace

/// A thread that does the work of one call of the main thread at a time. It is never destroyed.
class Worker {
 public:
  /// Returns the one that is free; null if the system gives no thread.
  static Worker* free() {
    if (one_) return one_;
    auto made = std::make_unique<Worker>();
    try {
      std::thread([worker = made.get()] { worker->serve(); }).detach();
    } catch (const std::system_error&) {
      return nullptr;
    }
    return one_ = made.release();
  }
  /// Makes the next call take another one.
  static void forget() { one_ = nullptr; }

  void begin(std::shared_ptr<Task> task) {
    ++running;
    const std::lock_guard lock(mutex_);
    task_ = std::move(task);
    given_.notify_one();
  }

 private:
  void serve() {
    for (bool goes_on = true; goes_on;) {
      std::unique_lock lock(mutex_);
      given_.wait(lock, [&] { return task_ != nullptr; });
      std::shared_ptr<Task> task = std::move(task_);
      lock.unlock();
      goes_on = did(task);
      --running;
    }
    delete this;
  }

  /// Does a task. Returns false if its call has been abandoned.
  static bool did(std::shared_ptr<Task>& task) {
    do_work(*task);
    Watch& watch = task->watch;
    {
      const std::lock_guard lock(watch.mutex_);
      if (!watch.abandoned_) {
        watch.ended_ = true;
        watch.changed_.notify_all();
        task.reset();  // the call keeps it
        return true;
      }
    }
    task->drop();
    std::vector<Left> left;
    {
      const nb::gil_scoped_acquire locked;
      task.reset();
      if (--abandoned == 0) left = std::exchange(after_abandoned, {});
    }
    for (Left& one : left) one.object.reset();
    const nb::gil_scoped_acquire locked;
    left.clear();
    return false;
  }

  static inline Worker* one_ = nullptr;
  std::mutex mutex_;
  std::condition_variable given_;
  std::shared_ptr<Task> task_;
};

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

void let_go(std::shared_ptr<void> object, nb::object works_on) {
  if (inside_call()) {
    late.push_back({std::move(object), std::move(works_on)});
  } else if (abandoned > 0) {  // its device may be in use for long
    after_abandoned.push_back({std::move(object), std::move(works_on)});
  } else if (Worker* worker = last.load() == std::thread::id{} && is_main() ? Worker::free() : nullptr) {
    struct Drop : Task {
      Drop() : Task(nb::none()) {}
      void work() override { object.reset(); }
      void drop() override {}
      nb::object works_on;
      std::shared_ptr<void> object;
    };
    const auto task = std::make_shared<Drop>();
    task->object = std::move(object);
    task->works_on = std::move(works_on);
    if (!task->watch.leave(task, *worker)) ++abandoned;
  } else {
    const Unlocked unlocked;
    object.reset();
  }
}

void check_may_call() {
  if (inside_call())
    throw Error(
        BALLOT_ERROR_WORK,
        "ballot was called from a progress function or a signal handler while another call was running; call it "
        "after that one has returned");
}

void after_fork() {
  running = 0;
  abandoned = 0;
  Worker::forget();
  main_thread = PyThread_get_thread_ident();
}

void end() {
  last = std::this_thread::get_id();
  const nb::gil_scoped_release unlocked;
  while (running > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

/// Looks for signals and, if `done` is a share, calls the user's function. With the GIL released.
bool Watch::call_user(double done) noexcept {
  const nb::gil_scoped_acquire locked;
  const Inside mark;
  try {
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
    return !has_user_ || done < 0 || !user_(done).is(nb::handle(Py_False));
  } catch (...) {
    raised_ = std::current_exception();
    return false;
  }
}

bool Watch::operator()(double done) noexcept {
  if (tries_) return done >= 1;                      // it is asked before the end: the call is about to wait
  if (!away_) return !has_user_ || call_user(done);  // other threads handle no signals
  if (stop_ || !has_user_) return !stop_;
  std::unique_lock lock(mutex_);
  done_ = done, asks_ = true;
  changed_.notify_all();
  changed_.wait(lock, [&] { return !asks_ || stop_; });
  return !stop_;
}

/// Does the work in this thread, unless it is about to wait. Returns false if somebody has to do it yet.
bool Watch::has_tried(Task& task) {
  if (has_user_) return false;
  const Unlocked unlocked;
  tries_ = true;
  try {
    task.work();
  } catch (const Error& error) {
    tries_ = false;
    if (error.code() == BALLOT_ERROR_INTERRUPTED) return false;
    task.failure = std::current_exception();
    task.drop();
  } catch (...) {
    task.failure = std::current_exception();
    task.drop();
  }
  return true;
}

/// Has a thread do the work, and looks for signals until it ends or, although it was asked to, does not.
void Watch::look(const std::shared_ptr<Task>& task, Worker& worker) {
  const Unlocked unlocked;
  worker.begin(task);
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait_for(lock, kLook, [&] { return ended_ || asks_; });
    if (ended_) return;
    const double done = asks_ ? done_ : -1;
    lock.unlock();
    const bool goes_on = call_user(done);
    lock.lock();
    stop_ = stop_ || !goes_on;
    if (done >= 0 || stop_) asks_ = false, changed_.notify_all();
    if (raised_) break;
  }
  give_up(lock);
}

/// Waits a little for the work, and no more for what goes on then.
bool Watch::give_up(std::unique_lock<std::mutex>& lock) {
  if (changed_.wait_for(lock, kPatience, [&] { return ended_; })) return true;
  abandoned_ = true;
  Worker::forget();
  return false;
}

bool Watch::leave(const std::shared_ptr<Task>& task, Worker& worker) {
  const Unlocked unlocked;
  worker.begin(task);
  std::unique_lock lock(mutex_);
  return give_up(lock);
}

void run(std::shared_ptr<Task> task, bool short_) {
  check_may_call();
  struct Late {
    ~Late() { let_go_late(); }
  } const late_ones;
  Watch& watch = task->watch;
  const bool looks = last.load() == std::thread::id{} && is_main();
  if (looks && short_ && watch.has_tried(*task)) {
    if (task->failure) std::rethrow_exception(std::exchange(task->failure, nullptr));
    return;
  }
  Worker* worker = looks ? Worker::free() : nullptr;
  watch.away_ = worker != nullptr;
  if (worker) {
    watch.look(task, *worker);
    if (watch.abandoned_) ++abandoned;
  } else {
    const Unlocked unlocked;
    do_work(*task);
  }
  if (watch.raised_) std::rethrow_exception(std::exchange(watch.raised_, nullptr));
  if (task->failure) std::rethrow_exception(std::exchange(task->failure, nullptr));
}

}  // namespace ballot::python
