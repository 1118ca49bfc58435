#include "engine/answer/stream.h"

#include <atomic>

namespace ballot {

namespace {

constexpr std::size_t kSets = 3;

}  // namespace

std::uint64_t count_hits(std::span<const Hit> hits) {
  std::atomic<std::uint64_t> count{0};
  for_chunks(hits.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    std::uint64_t some = 0;
    for (const Hit& h : hits.subspan(begin, end - begin)) some += h.prim != NO_HIT;
    count += some;
  });
  return count;
}

StreamRing& StreamRing::of(Context& gpu) {
  if (!gpu.stream_ring()) gpu.stream_ring() = std::make_shared<StreamRing>(gpu);
  return *gpu.stream_ring();
}

void StreamRing::make_room(std::uint64_t question_bytes, std::uint64_t answer_bytes) {
  if (question_bytes <= question_bytes_ && answer_bytes <= answer_bytes_ && !rooms_.empty()) return;
  question_bytes = std::max(question_bytes, question_bytes_), answer_bytes = std::max(answer_bytes, answer_bytes_);
  rooms_.clear();
  question_bytes_ = answer_bytes_ = 0;
  const auto make = [&] {
    Room room{{gpu_, question_bytes, Access::Storage, "questions"}, {gpu_, answer_bytes, Access::Storage, "answers"}};
    if (!acts_as_gpu_ && room.questions.mapped() && room.answers.mapped()) return room;  // the host sees them
    room.questions_here.emplace(gpu_, question_bytes, Access::Host, "questions of the host");
    room.answers_here.emplace(gpu_, answer_bytes, Access::Host, "answers of the host");
    return room;
  };
  while (rooms_.size() < (is_alone() ? 1 : kSets)) rooms_.push_back(make());
  question_bytes_ = question_bytes, answer_bytes_ = answer_bytes;
}

}  // namespace ballot
