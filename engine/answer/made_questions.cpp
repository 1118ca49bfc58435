#include "engine/answer/made_questions.h"

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

QuestionMaker::QuestionMaker(Context& gpu, const QuestionTables& tables)
    : gpu_(gpu),
      how_(gpu, 1, Access::Storage, "how questions are made"),
      words_(gpu, tables.words.size(), Access::Storage, "tables of questions"),
      kernel_(gpu, source_of(tables.kind)) {
  how_.upload({&tables.how, 1});
  words_.upload(tables.words);
  kernel_.bind(BIND_MADE_HOW, how_);
  kernel_.bind(BIND_MADE_WORDS, words_);
}

void QuestionMaker::record(std::uint64_t first, std::uint32_t count, const RawBuffer& to) {
  kernel_.bind(BIND_RAYS, to);
  const MadePush push{std::uint32_t(first), count};
  gpu_.pass("making questions", [&](Commands& cmd) { kernel_.dispatch(cmd, groups_of(count, MADE_GROUP), push); });
}

}  // namespace ballot
