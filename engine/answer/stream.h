// Answers streams of questions from host memory: copying in, answering and copying out overlap where the device allows
// it.
#pragma once

#include <algorithm>
#include <bit>
#include <concepts>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/answer/dispatch.h"
#include "engine/core/parallel.h"
#include "engine/gpu/kernel.h"

namespace ballot {

/// Records passes that write questions [first, first + count) to the front of a buffer on the device.
template <class Question>
using MakeQuestions = std::function<void(std::uint64_t first, std::uint32_t count, const Buffer<Question>& to)>;

/// The two ends of a stream of questions, such as rays or points. They are called from the thread that asks, in the
/// order of the questions.
template <class Question, class Answer>
struct Stream {
  std::uint64_t most = ~0ull;  // no more questions than this will come; smaller streams get smaller buffers
  /// Writes the questions from number `first` on, which come next, to the front of `room` and returns how many. Fewer
  /// than room.size() end the stream.
  std::function<std::size_t(std::uint64_t first, std::span<Question> room)> next = {};
  /// Has a device that is no CPU make the questions, of which there are `most`. The host then calls next() for those
  /// that it has to look at, in any order. May be empty.
  MakeQuestions<Question> make = {};
  /// Takes the answers to the questions from number `first` on, which come next: Answerer::width() for each. The span
  /// is valid until the function returns. If the device wrote the answers in place, it is the span that in_place()
  /// gave; if the driver refused that memory, it is another.
  std::function<void(std::uint64_t first, std::span<const Answer> answers)> take = {};
  /// Where questions lie in the host's memory, and where their answers belong. If `questions` is null, they come
  /// through next(). If `answers` is null, the answers have no place of their own. take() is called either way.
  struct Places {
    const Question* questions = nullptr;
    Answer* answers = nullptr;
  };
  /// Returns the places of the next `count` questions, from number `first` on. It is called only for a device that is
  /// the CPU, which uses the caller's arrays in place. Questions with a place do not come through next(). The function
  /// may be empty.
  std::function<Places(std::uint64_t first, std::size_t count)> in_place = {};
  /// Is called now and then with the number of questions that are done. May throw to end the stream. May be empty.
  std::function<void(std::uint64_t done)> progress = {};
};

using RayStream = Stream<Ray, Hit>;

/// Returns the stream of questions in an array, whose answers go to another of the same length. Both must outlive it.
template <class Question, class Answer>
Stream<Question, Answer> stream_of(std::span<const Question> questions, std::span<Answer> answers);

/// Returns how many of the records are hits: their prim is not NO_HIT.
std::uint64_t count_hits(std::span<const Hit> hits);

/// Questions of a chunk in the host's memory. Those that the device makes are read when they are asked for.
template <class Question>
class Questions {
 public:
  using Read = std::function<void(std::size_t first, std::span<Question> to)>;
  template <std::convertible_to<std::span<const Question>> Here>
  Questions(const Here& here) : here_(here) {
    size_ = here_.size();
  }
  Questions(std::size_t size, Read read) : size_(size), read_(std::move(read)) {}

  std::size_t size() const { return size_; }
  /// Returns questions [first, first + count).
  std::vector<Question> part(std::size_t first, std::size_t count) const {
    std::vector<Question> some(count);
    if (read_)
      read_(first, some);
    else
      std::ranges::copy(here_.subspan(first, count), some.begin());
    return some;
  }
  /// Returns all questions, valid as long as this object.
  std::span<const Question> all() const {
    if (here_.size() < size_) here_ = kept_ = part(0, size_);
    return here_;
  }

 private:
  std::size_t size_ = 0;
  Read read_ = {};
  mutable std::vector<Question> kept_;
  mutable std::span<const Question> here_;
};

/// Questions of a stream that are answered together, and where their answers go.
template <class Question, class Answer>
struct Chunk {
  const Buffer<Question>& questions;
  Buffer<Answer>& answers;
  const Questions<Question>& here;  // the same questions in the host's memory
  std::uint64_t first = 0;          // the number of the first
  /// To be called, if the device works in parts, with the number of answers that it has.
  const std::function<void(std::uint32_t)>& launched;

  std::uint32_t count() const { return std::uint32_t(here.size()); }
};

/// Puts questions into an order in which neighbours are near each other, and answers back.
template <class Question, class Answer>
class Rearranged {
 public:
  /// Moves question order[i] to place i.
  void arrange(std::span<Question> questions, const std::vector<std::uint32_t>& order);
  /// Returns the answers, `width` to each question, in the order in which the questions came. They are valid until the
  /// next call.
  std::span<const Answer> back(std::span<const Answer> answers, const std::vector<std::uint32_t>& order,
                               std::size_t width = 1);

 private:
  std::vector<Question> sorted_;
  std::vector<Answer> found_;
};

/// How a kind of question is answered: the kernels, and what the host adds.
template <class Question, class Answer>
class Answerer {
 public:
  virtual ~Answerer() = default;
  /// Returns the most questions of a chunk.
  virtual std::size_t most() const = 0;
  /// Returns the number of answers to each question.
  virtual std::size_t width() const { return 1; }
  /// Returns true if the device answers chunks where the caller has them, as Stream::in_place() says.
  virtual bool in_place() const { return false; }
  /// Puts the questions of a chunk into a better order. Devices that are the CPU alone.
  virtual void arrange(std::span<Question>) {}
  /// Has the device answer a chunk: records that, or does it and waits.
  virtual void answer(const Chunk<Question, Answer>& chunk, TraceTimes& times) = 0;
  /// Completes the answers of a chunk in the host's memory, and returns them in the order in which the questions came.
  virtual std::span<const Answer> end(const Questions<Question>&, std::span<Answer> answers) { return answers; }
};

/// The buffers that streams go through. They are kept for the next stream, of any kind. A GPU has three sets: while it
/// answers one chunk, the host fills the next and empties the one before. They take at most 192 MiB on the device. A
/// GPU with memory of its own needs as much again on the host, to copy from and to. A device that is the CPU has one
/// set, and it uses the caller's arrays in place where Stream::in_place names them.
///
/// Belongs to the thread of its Context.
class StreamRing {
 public:
  explicit StreamRing(Context& gpu) : gpu_(gpu) {}
  /// Returns the ring of a device, made on first use.
  static StreamRing& of(Context& gpu);

  /// Answers a stream. Throws what the stream's functions throw; the ring can be used again after that.
  template <class Question, class Answer>
  TraceTimes run(const Stream<Question, Answer>& stream, Answerer<Question, Answer>& answerer);

  /// Returns a kernel that makes questions of streams, which is kept for others.
  Kernel& kernel(const KernelSource& source) {
    std::unique_ptr<Kernel>& kernel = kernels_[source.name];
    refresh(gpu_, kernel, source);
    return *kernel;
  }
  /// True if one chunk is under way at a time, which the host sees: devices that are the CPU.
  bool is_alone() const { return gpu_.info().is_cpu() && !acts_as_gpu_; }
  /// Returns the most questions of a chunk; but for tests any number.
  std::size_t most() const { return most_; }
  /// For tests: a CPU device has three sets, and copies, as a GPU with memory of its own; chunks have `most` questions.
  void act_as_gpu(std::size_t most) { rooms_.clear(), acts_as_gpu_ = true, most_ = most; }

 private:
  template <class Question, class Answer>
  class Run;  // has the rooms while it lives: a stream that begins meanwhile makes others
  /// The buffers of one chunk; on a device with memory of its own those of the host's side, too.
  struct Room {
    RawBuffer questions, answers;
    std::optional<RawBuffer> questions_here = {}, answers_here = {};
  };
  void make_room(std::uint64_t question_bytes, std::uint64_t answer_bytes);

  Context& gpu_;
  std::vector<Room> rooms_;
  std::map<std::string, std::unique_ptr<Kernel>> kernels_;
  std::uint64_t question_bytes_ = 0, answer_bytes_ = 0;  // of a room
  bool imports_ = true;                                  // no import of a caller's questions has failed yet
  bool acts_as_gpu_ = false;
  std::size_t most_ = ~std::size_t{0};  // questions of a chunk
};

}  // namespace ballot

#include "engine/answer/stream_run.h"  // the templates
