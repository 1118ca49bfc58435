#include "engine/answer/lists.h"

namespace ballot {

KernelSource places_source(int of) {
  return {.name = of == PLACES_LISTS ? "query.places" : fmt::format("query.places BALLOT_PLACES={}", of),
          .file = "query/places.comp",
          .defines = {{"BALLOT_PLACES", of}},
          .group_size = PLACES_GROUP};
}

KernelSource order_source(std::uint32_t record_words, bool of_long) {
  return {.name = fmt::format("query.order BALLOT_RECORD_WORDS={}{}", record_words, of_long ? " BALLOT_LONG=1" : ""),
          .file = "query/order.comp",
          .defines = {{"BALLOT_RECORD_WORDS", int(record_words)}, {"BALLOT_LONG", int(of_long)}},
          .group_size = ORDER_GROUP};
}

KernelSource pick_source(bool widens) {
  return {.name = fmt::format("query.pick BALLOT_WIDENS={}", int(widens)),
          .file = "query/pick.comp",
          .defines = {{"BALLOT_WIDENS", int(widens)}},
          .group_size = ORDER_GROUP};
}

}  // namespace ballot
