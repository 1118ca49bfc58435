#include "engine/answer/lists.h"

namespace ballot {

KernelSource places_source() {
  return {.name = "query.places", .file = "query/places.comp", .group_size = PLACES_GROUP};
}

KernelSource order_source(std::uint32_t record_words) {
  return {.name = fmt::format("query.order BALLOT_RECORD_WORDS={}", record_words),
          .file = "query/order.comp",
          .defines = {{"BALLOT_RECORD_WORDS", int(record_words)}},
          .group_size = ORDER_GROUP};
}

}  // namespace ballot
