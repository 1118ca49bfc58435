// The lists of a stream. Included by lists.h.
#pragma once

#include "engine/answer/repair.h"
#include "engine/core/parallel.h"

namespace ballot {

inline constexpr std::size_t kListChunk = 1 << 18;       // questions
inline constexpr std::uint32_t kMostRecords = 1 << 22;   // that a room holds; of lists, 64 MiB
inline constexpr std::uint32_t kLeastRecords = 1 << 20;  // to begin with
inline constexpr std::size_t kFewListed = 1024;          // fewer questions are not sorted
inline constexpr std::size_t kCollected = 1 << 12;       // lists that a thread puts in order at a time

/// Answers a stream of questions by the number of records of each. Those of a chunk are to be had while its numbers are
/// taken.
template <class Question, class Record>
class ListAnswerer : public Answerer<Question, std::uint32_t> {
 public:
  using Rooms = ListRooms<Question, Record>;
  using Part = ListPart<Question>;

  /// Has `rooms` as long as it lives: a stream that begins meanwhile makes others.
  ListAnswerer(Context& gpu, ListKind<Question, Record>& kind, Rooms& rooms)
      : gpu_(gpu),
        kind_(kind),
        kept_(rooms),
        rooms_(std::exchange(rooms, {})),
        stages_(gpu, kind, rooms_),
        alone_(StreamRing::of(gpu).is_alone()) {}
  ~ListAnswerer() override {
    gpu_.abandon();
    kept_ = std::move(rooms_);
  }

  /// Returns the records of the chunk whose numbers are taken, one list after the other.
  std::span<const Record> records() const { return records_; }
  /// The time that questions took which were asked again.
  TraceTimes& again() { return again_; }

  std::size_t most() const override {
    return std::min<std::size_t>({kind_.kernel(ListForm::Rows, false).most(), kListChunk, kMostRecords / kind_.row()});
  }
  void arrange(std::span<Question> questions) override {
    if (questions.size() >= kFewListed && kind_.order(questions, order_))
      rearranged_.arrange(questions, order_);
    else
      order_.clear();
  }

  void answer(const Chunk<Question, std::uint32_t>& chunk, TraceTimes& times) override {
    UnderWay now{kind_.words(chunk.first, chunk.here.size())};
    now.words.arrange(order_);
    QueryKernel& first = stages_.to_rows(chunk.here.size());
    kind_.bind_words(first, chunk.here.size(), now.words, false);
    stages_.walk(first, asked(chunk), times);
    if (!alone_) list(asked(chunk), now, times);
    under_way_.push_back(std::move(now));
  }

  std::span<const std::uint32_t> end(const Questions<Question>& asked, std::span<std::uint32_t> numbers) override {
    const UnderWay mine = std::move(under_way_.front());
    under_way_.pop_front();
    std::uint64_t sum = 0;
    std::uint32_t longest = 0;
    for (const std::uint32_t n : numbers) sum += n <= mine.longest ? n : 0, longest = std::max(longest, n);
    rooms_.records = std::max(rooms_.records, std::uint32_t(std::min<std::uint64_t>(kMostRecords, std::bit_ceil(sum))));
    if (!alone_ && sum <= mine.room && longest <= std::min(mine.longest, kind_.most()) && !kind_.reorders()) {
      records_ = mine.records.first(std::size_t(sum));
      return numbers;
    }
    const std::span<const Question> questions = asked.all();
    Lists lists{alone_ ? rows(numbers) : places(numbers, mine), {}};
    lists.records = alone_ ? mapped(*rooms_.rows) : mine.records;
    list_open({questions, mine.words, numbers}, lists);
    collect(questions, lists);
    return std::span<const std::uint32_t>(rooms_.counts).first(numbers.size());
  }

  /// Lists the records of a question whose walk the driver cut short, in no order.
  std::vector<Record> list_in_pieces(const Part& part) {
    Walks walks{*this, part};
    typename Walks::Answer answer{UNFINISHED};
    repair(walks, std::span(&answer, 1), kFirstPieces, gpu_, again_);
    return answer.number == UNSURE ? kind_.settle(part)[0] : std::move(answer.list);
  }

 private:
  /// A chunk that the device has not ended, or the host not taken.
  struct UnderWay {
    FilterWords words;
    std::uint32_t longest = ~0u;  // list that has a place
    std::uint64_t room = 0;
    std::span<const Record> records = {};  // the lists, once the device has ended
  };
  /// The questions of a chunk as they were asked, and the numbers of their records.
  struct Asked {
    std::span<const Question> questions;
    const FilterWords& words;
    std::span<const std::uint32_t> numbers;
  };
  /// The records of questions before they are put into order. Those of most lie in rows or places; few questions have a
  /// list of their own.
  struct Place {
    std::uint32_t begin = 0, count = 0, apart = 0;  // apart: 1 and the number of a list of its own, or 0
  };
  struct Lists {
    std::span<const Record> of(const Place& p) const {
      return p.apart ? std::span<const Record>(apart[p.apart - 1]) : records.subspan(p.begin, p.count);
    }
    std::vector<Place> places;  // of each question
    std::vector<std::vector<Record>> apart = {};
    std::span<const Record> records = {};
  };

  static std::span<const Record> mapped(const Buffer<Record>& buffer) {
    return {reinterpret_cast<const Record*>(buffer.mapped()), buffer.size()};
  }

  using OnDevice = typename ListStages<Question, Record>::Asked;
  static OnDevice asked(const Chunk<Question, std::uint32_t>& chunk) {
    return {chunk.questions, chunk.answers, chunk.count(), chunk.launched};
  }

  Buffer<Record>& records_of(typename Rooms::Room& room) {
    rooms_.records = std::max(rooms_.records, kLeastRecords);
    return buffer_for(room.records, gpu_, rooms_.records, "lists");
  }

  /// Has the device make the lists of a chunk, whose first records lie in rows.
  void list(const OnDevice& chunk, UnderWay& now, TraceTimes& times) {
    typename Rooms::Room& room = rooms_.rooms[turn_++ % rooms_.rooms.size()];
    Buffer<Record>& records = records_of(room);
    now.room = records.size();
    now.longest = kind_.has_rest() ? LONGEST_LIST : kind_.row();
    stages_.place(chunk, now.longest, std::uint32_t(now.room), times);
    if (kind_.has_rest() && stages_.walk(stages_.to_places(records), chunk, times) > 0) {  // the driver cuts such walks
      now.longest = kind_.row();
      stages_.place(chunk, now.longest, std::uint32_t(now.room), times);
    }
    stages_.put_in_order(chunk, records, now.longest, times);
    const bool carries = !records.mapped() || gpu_.info().is_cpu();
    if (carries) stages_.carry(chunk, records, buffer_of_host(room, records.size()), times);
    now.records = mapped(carries ? *room.here : records);
  }

  Buffer<Record>& buffer_of_host(typename Rooms::Room& room, std::size_t records) {
    if (!room.here || room.here->size() < records) {
      room.here.reset();
      room.here = std::make_unique<Buffer<Record>>(gpu_, records, Access::Storage | Access::Host, "lists of the host");
    }
    return *room.here;
  }

  std::vector<Place> rows(std::span<const std::uint32_t> numbers) const {
    std::vector<Place> all(numbers.size());
    const std::uint32_t row = kind_.row();
    for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = {i * row, std::min(numbers[i], row)};
    return all;
  }
  static std::vector<Place> places(std::span<const std::uint32_t> numbers, const UnderWay& mine) {
    std::vector<Place> all(numbers.size());
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const std::uint32_t n = numbers[i] <= mine.longest ? numbers[i] : 0;
      if (sum + n <= mine.room) all[i] = {std::uint32_t(sum), n};
      sum += n;
    }
    return all;
  }

  /// Asks questions apart: whole, or a piece of the tree.
  void ask(QueryKernel& kernel, const Part& part, const TreePiece& piece, std::span<std::uint32_t> numbers) {
    Buffer<Question>& questions = buffer_for(rooms_.questions, gpu_, part.size(), "questions apart");
    questions.upload(part.questions);
    kernel.bind(BIND_RAYS, questions);
    kernel.bind(BIND_CROSSINGS, buffer_for(rooms_.numbers, gpu_, part.size(), "lengths of lists apart"));
    kind_.bind_words(kernel, part.size(), part.words, true);
    kernel.run(std::uint32_t(part.size()), piece, again_);
    rooms_.numbers->download(numbers);
  }

  /// Lists the records of questions, of which number i has room from to[i] on and before to[i + 1].
  std::vector<Record> list_apart(const Part& part, std::span<const std::uint32_t> to, std::span<std::uint32_t> numbers,
                                 const TreePiece* piece = nullptr) {
    QueryKernel& kernel = kind_.kernel(ListForm::Apart, piece);
    buffer_for(rooms_.places_apart, gpu_, to.size(), "places apart").upload(to);
    kernel.bind(BIND_PLACES, *rooms_.places_apart);
    kernel.bind(BIND_RECORDS, buffer_for(rooms_.records_apart, gpu_, to.back(), "lists apart"));
    ask(kernel, part, piece ? *piece : kind_.whole(), numbers);
    std::vector<Record> found(to.back());
    if (!found.empty()) rooms_.records_apart->download(std::span(found));
    return found;
  }

  /// A question whose records are listed in pieces of the tree.
  struct Walks {
    struct Answer {
      std::uint32_t number = 0;
      std::vector<Record> list = {};
      friend bool is_unfinished(const Answer& a) { return a.number == UNFINISHED; }
    };
    static constexpr const char* kQueries = "questions";

    ListAnswerer& answerer;
    const Part& part;

    static Answer none() { return {}; }
    static std::string name() { return "lists"; }
    static void choose(std::span<const std::uint32_t>) {}
    std::vector<TreePiece> pieces(std::uint64_t limit) { return answerer.kind_.pieces(limit); }
    void ask(const TreePiece& piece, std::span<Answer> found) {
      std::uint32_t& number = found[0].number;
      found[0].list.clear();
      answerer.ask(answerer.kind_.kernel(ListForm::Numbers, true), part, piece, {&number, 1});
      if (number == 0 || number >= UNSURE) return;
      const std::uint32_t to[2] = {0, number};
      found[0].list = answerer.list_apart(part, to, {&number, 1}, &piece);
    }
    static void add(std::size_t, Answer& all, const Answer& found) {
      all.number = all.number == UNSURE || found.number == UNSURE ? UNSURE : all.number + found.number;
      all.list.insert(all.list.end(), found.list.begin(), found.list.end());
    }
  };

  /// Lists the questions whose records have no place, were cut short or are unsure, apart.
  void list_open(const Asked& asked, Lists& lists) {
    const auto apart = [&](std::size_t i, std::vector<Record> list) {
      lists.places[i] = {0, std::uint32_t(list.size()), std::uint32_t(lists.apart.size() + 1)};
      lists.apart.push_back(std::move(list));
    };
    const auto part_of = [&](std::size_t i) {
      Part one;
      one.add(asked.questions, asked.words, i);
      return one;
    };
    std::vector<std::uint32_t> more, unsure, cut;  // more: questions that need more room
    Part unsure_part;
    for (std::uint32_t i = 0; i < asked.numbers.size(); ++i) {
      if (asked.numbers[i] == UNFINISHED)
        cut.push_back(i);
      else if (asked.numbers[i] == UNSURE)
        unsure.push_back(i), unsure_part.add(asked.questions, asked.words, i);
      else if (asked.numbers[i] > lists.places[i].count)
        more.push_back(i);
    }
    if (!unsure.empty()) {
      std::vector<std::vector<Record>> settled = kind_.settle(unsure_part);
      for (std::size_t k = 0; k < unsure.size(); ++k) apart(unsure[k], std::move(settled[k]));
    }
    for (std::size_t first = 0, end = 0; first < more.size(); first = end) {
      Part part;
      std::vector<std::uint32_t> to{0};
      for (; end < more.size() && (end == first || to.back() + std::uint64_t{asked.numbers[more[end]]} <= kMostRecords);
           ++end) {
        part.add(asked.questions, asked.words, more[end]);
        to.push_back(to.back() + asked.numbers[more[end]]);
      }
      std::vector<std::uint32_t> numbers(part.size());
      const std::vector<Record> found = list_apart(part, to, numbers);
      for (std::size_t k = 0; k < numbers.size(); ++k) {
        if (numbers[k] == UNFINISHED)
          cut.push_back(more[first + k]);
        else
          apart(more[first + k], {found.begin() + to[k], found.begin() + to[k + 1]});
      }
    }
    for (const std::uint32_t i : cut) apart(i, list_in_pieces(part_of(i)));
  }

  /// Writes the lists in the order in which the questions came, each in order.
  void collect(std::span<const Question> questions, const Lists& lists) {
    const std::size_t count = questions.size();
    if (rooms_.counts.size() < count) rooms_.counts.resize(count);
    const auto number_of = [&](std::size_t i) { return order_.empty() ? i : std::size_t(order_[i]); };
    std::vector<std::size_t> to(count + 1);
    for (std::size_t i = 0; i < count; ++i) rooms_.counts[number_of(i)] = std::min(lists.places[i].count, kind_.most());
    for (std::size_t i = 0; i < count; ++i) to[i + 1] = to[i] + rooms_.counts[i];
    if (rooms_.lists.size() < to[count]) rooms_.lists.resize(to[count]);
    for_chunks(count, kCollected, [&](std::size_t first, std::size_t last) {
      std::vector<Record> spare;
      for (std::size_t i = first; i < last; ++i) {
        const std::size_t n = number_of(i);
        if (to[n] == to[n + 1]) continue;
        const std::span<const Record> list = lists.of(lists.places[i]);
        spare.assign(list.begin(), list.end());
        kind_.put_in_order(questions[i], spare);
        std::copy_n(spare.begin(), to[n + 1] - to[n], rooms_.lists.begin() + std::ptrdiff_t(to[n]));
      }
    });
    records_ = std::span<const Record>(rooms_.lists).first(to[count]);
  }

  Context& gpu_;
  ListKind<Question, Record>& kind_;
  Rooms& kept_;
  Rooms rooms_;
  ListStages<Question, Record> stages_;
  bool alone_;
  std::size_t turn_ = 0;
  std::vector<std::uint32_t> order_;  // of the chunk under way; empty: as they came
  Rearranged<Question, std::uint32_t> rearranged_;
  std::deque<UnderWay> under_way_;
  std::span<const Record> records_;
  TraceTimes again_;
};

}  // namespace ballot
