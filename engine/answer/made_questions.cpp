#include "engine/answer/made_questions.h"

#include <utility>

#include "engine/answer/stream.h"

namespace ballot {

namespace {

KernelSource source_of(Made kind) {
  return {.name = fmt::format("query.made BALLOT_MADE={}", int(kind)),
          .file = "query/made.comp",
          .defines = {{"BALLOT_MADE", int(kind)}},
          .group_size = MADE_GROUP};
}

}  // namespace

std::vector<KernelSource> making_sources() {
  return {source_of(Made::Points), source_of(Made::Rays), source_of(Made::PosedRays)};
}

QuestionMaker::QuestionMaker(Context& gpu, QuestionTables tables)
    : gpu_(gpu),
      tables_(std::move(tables)),
      how_(gpu, 1, Access::Storage, "how questions are made"),
      words_(gpu, tables_.words.size(), Access::Storage, "tables of questions") {}

void QuestionMaker::record(std::uint64_t first, std::uint32_t count, const RawBuffer& to) {
  if (!std::exchange(sent_, true)) how_.record_upload({&tables_.how, 1}), words_.record_upload(tables_.words);
  Kernel& kernel = StreamRing::of(gpu_).kernel(source_of(tables_.kind));
  kernel.bind(BIND_MADE_HOW, how_);
  kernel.bind(BIND_MADE_WORDS, words_);
  kernel.bind(BIND_RAYS, to);
  const MadePush push{std::uint32_t(first), count};
  gpu_.pass("making questions", [&](Commands& cmd) { kernel.dispatch(cmd, groups_of(count, MADE_GROUP), push); });
}

}  // namespace ballot
