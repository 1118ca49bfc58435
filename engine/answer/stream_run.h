// One stream through the buffers of a StreamRing. Included by stream.h.
#pragma once

#include "engine/core/error.h"

namespace ballot {

/// Sizes of chunks, in questions.
inline constexpr std::size_t kChunk = 1u << 20;       // of a GPU, at most: rays are 32 MiB in, 16 MiB out
inline constexpr std::size_t kLeastChunk = 1u << 12;  // so that small batches of other sizes need no new buffers
inline constexpr std::size_t kMoved = 1u << 14;       // that a thread moves at a time
/// Questions that are answered in place at once. Their arrays have a size that llvmpipe compiles no kernel anew for
/// (steady_size() in gpu/buffer.cpp).
inline constexpr std::size_t kInPlace = (1u << 18) - 8;

template <class Question, class Answer>
Stream<Question, Answer> stream_of(std::span<const Question> questions, std::span<Answer> answers) {
  using Places = typename Stream<Question, Answer>::Places;
  Stream<Question, Answer> stream{.most = questions.size()};
  stream.next = [=](std::uint64_t first, std::span<Question> room) {
    copy_parallel(questions.subspan(std::size_t(first), room.size()), room);
    return room.size();
  };
  stream.take = [=](std::uint64_t first, std::span<const Answer> some) {
    if (some.data() != answers.data() + first) copy_parallel(some, answers.subspan(std::size_t(first), some.size()));
  };
  stream.in_place = [=](std::uint64_t first, std::size_t) {
    return Places{questions.data() + first, answers.data() + first};
  };
  return stream;
}

template <class Question, class Answer>
void Rearranged<Question, Answer>::arrange(std::span<Question> questions, const std::vector<std::uint32_t>& order) {
  sorted_.resize(questions.size());
  for_chunks(questions.size(), kMoved, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) sorted_[i] = questions[order[i]];
  });
  copy_parallel(std::span<const Question>(sorted_), questions);
}

template <class Question, class Answer>
std::span<const Answer> Rearranged<Question, Answer>::back(std::span<const Answer> answers,
                                                           const std::vector<std::uint32_t>& order, std::size_t width) {
  found_.resize(answers.size());
  for_chunks(order.size(), kMoved, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) std::copy_n(&answers[i * width], width, &found_[order[i] * width]);
  });
  return found_;
}

/// A stream under way. Its chunks have the rooms of the ring while it lives.
template <class Question, class Answer>
class StreamRing::Run {
 public:
  Run(StreamRing& ring, const Stream<Question, Answer>& stream, Answerer<Question, Answer>& answerer)
      : gpu_(ring.gpu_), ring_(ring), stream_(stream), answerer_(answerer), width_(answerer.width()) {
    const std::size_t most = std::min(answerer.most(), ring.most_);
    const std::size_t wanted = std::size_t(std::min<std::uint64_t>(stream.most, most));
    chunk_ = std::clamp(std::bit_ceil(wanted), std::min(kLeastChunk, most), most);
    ring.make_room(chunk_ * sizeof(Question), chunk_ * width_ * sizeof(Answer));
    rooms_ = std::exchange(ring.rooms_, {});
    for (Room& room : rooms_) slots_.emplace_back(std::move(room));
  }
  ~Run() {
    gpu_.abandon();
    for (std::size_t i = 0; i < slots_.size(); ++i) rooms_[i] = std::move(slots_[i]).room();
    ring_.rooms_ = std::move(rooms_);
  }
  Run(const Run&) = delete;

  TraceTimes run() {
    std::size_t turn = 0;
    for (bool more = stream_.most > 0; more; ++turn) {
      Slot& slot = slots_[turn % slots_.size()];
      deliver(slot);
      auto asked = std::size_t(std::min<std::uint64_t>(chunk_, stream_.most - begun_));
      const std::size_t count = fill(slot, asked);
      begun_ += count;
      more = count == asked && begun_ < stream_.most;
      if (count == 0) break;
      slot.count = std::uint32_t(count), slot.first = begun_ - count;
      answer(slot);
    }
    for (std::size_t i = 0; i < slots_.size(); ++i) deliver(slots_[(turn + i) % slots_.size()]);
    return times_;
  }

 private:
  /// A chunk.
  struct Slot {
    explicit Slot(Room&& room) : questions(std::move(room.questions)), answers(std::move(room.answers)) {
      if (room.questions_here) questions_here.emplace(std::move(*room.questions_here));
      if (room.answers_here) answers_here.emplace(std::move(*room.answers_here));
    }
    Room room() && {
      Room room{std::move(questions), std::move(answers)};
      if (questions_here) room.questions_here.emplace(std::move(*questions_here));
      if (answers_here) room.answers_here.emplace(std::move(*answers_here));
      return room;
    }

    Buffer<Question> questions;
    Buffer<Answer> answers;
    std::optional<Buffer<Question>> questions_here = {};  // the host's side, on a device with memory of its own
    std::optional<Buffer<Answer>> answers_here = {};
    std::uint32_t count = 0;                                  // questions in it; 0: free
    std::uint64_t first = 0;                                  // number of the first
    std::uint64_t submission = 0;                             // that answers them
    std::optional<Buffer<Question>> questions_in_place = {};  // the caller's arrays, while the device uses them
    std::optional<Buffer<Answer>> answers_in_place = {};

    Buffer<Question>& from() { return questions_in_place ? *questions_in_place : questions; }
    Buffer<Answer>& to() { return answers_in_place ? *answers_in_place : answers; }
    Buffer<Question>& from_here() { return questions_here ? *questions_here : from(); }
    Buffer<Answer>& to_here() { return answers_here ? *answers_here : to(); }
    /// Returns the questions, and the answers, in the host's memory.
    std::span<Question> asked() { return {reinterpret_cast<Question*>(from_here().mapped()), count}; }
    std::span<Answer> given(std::size_t width) {
      return {reinterpret_cast<Answer*>(to_here().mapped()), count * width};
    }
  };

  std::span<Question> room(Slot& slot) {
    Buffer<Question>& here = slot.questions_here ? *slot.questions_here : slot.questions;
    return {reinterpret_cast<Question*>(here.mapped()), chunk_};
  }

  /// Returns a buffer over memory of the host; none if the driver refuses it.
  template <class T>
  std::optional<Buffer<T>> import(T* data, const char* name) {
    if (!data || !RawBuffer::can_import(gpu_, data)) return {};
    try {
      return Buffer<T>(gpu_, std::span(data, kInPlace), name);
    } catch (const Error&) {
      return {};
    }
  }

  /// Fills a slot with up to `asked` questions and returns their number. Asks for fewer, and says so in `asked`, if the
  /// device uses the caller's arrays in place.
  std::size_t fill(Slot& slot, std::size_t& asked) {
    slot.questions_in_place.reset(), slot.answers_in_place.reset();
    if (makes()) return asked;
    const bool alone = slots_.size() == 1;
    if (alone && answerer_.in_place() && stream_.in_place && ring_.imports_ && asked >= kInPlace) {
      const auto places = stream_.in_place(begun_, kInPlace);
      if (places.questions || places.answers) asked = kInPlace;
      slot.answers_in_place = import(places.answers, "answers in place");
      if (places.questions) {
        slot.questions_in_place = import(const_cast<Question*>(places.questions), "questions in place");  // read alone
        ring_.imports_ = slot.questions_in_place.has_value();
        if (!ring_.imports_) copy_parallel(std::span(places.questions, kInPlace), room(slot).first(kInPlace));
        return kInPlace;
      }
    }
    const std::size_t count = stream_.next(begun_, room(slot).first(asked));
    if (alone && count) answerer_.arrange(room(slot).first(count));
    return count;
  }

  /// Returns true if the device makes the questions.
  bool makes() const { return stream_.make && !ring_.is_alone(); }
  Questions<Question> asked(Slot& slot) const {
    if (!makes()) return std::span<const Question>(slot.asked());
    return {slot.count,
            [this, from = slot.first](std::size_t first, std::span<Question> to) { stream_.next(from + first, to); }};
  }

  void answer(Slot& slot) {
    if (makes())
      stream_.make(slot.first, slot.count, slot.questions);
    else if (slot.questions_here)
      gpu_.pass("copying questions in",
                [&](Commands& cmd) { cmd.copy(*slot.questions_here, slot.questions, slot.count * sizeof(Question)); });
    const std::function<void(std::uint32_t)> launched = [&](std::uint32_t done) {
      if (stream_.progress && done < slot.count) stream_.progress(done_ + done);
    };
    const Questions<Question> here = asked(slot);
    answerer_.answer({slot.from(), slot.to(), here, slot.first, launched}, times_);
    if (slot.answers_here)
      gpu_.pass("copying answers out", [&](Commands& cmd) {
        cmd.copy(slot.answers, *slot.answers_here, slot.count * width_ * sizeof(Answer));
      });
    slot.submission = gpu_.flush();
  }

  void deliver(Slot& slot) {
    if (slot.count == 0) return;
    gpu_.wait(slot.submission);
    const std::span<const Answer> answers = answerer_.end(asked(slot), slot.given(width_));
    stream_.take(done_, answers);
    done_ += std::exchange(slot.count, 0);
    if (stream_.progress) stream_.progress(done_);
  }

  Context& gpu_;
  StreamRing& ring_;
  const Stream<Question, Answer>& stream_;
  Answerer<Question, Answer>& answerer_;
  std::vector<Room> rooms_;  // empty: the slots have what was in them
  std::vector<Slot> slots_;
  std::size_t chunk_ = 0, width_;
  std::uint64_t begun_ = 0, done_ = 0;  // questions
  TraceTimes times_;
};

template <class Question, class Answer>
TraceTimes StreamRing::run(const Stream<Question, Answer>& stream, Answerer<Question, Answer>& answerer) {
  return Run<Question, Answer>(*this, stream, answerer).run();
}

}  // namespace ballot
