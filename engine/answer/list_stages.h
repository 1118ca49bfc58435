// What a device does of lists, in passes. Included by lists.h.
#pragma once

namespace ballot {

/// Makes the lists of questions on the device: walks, places, order. Belongs to the thread of its Context.
template <class Question, class Record>
class ListStages {
 public:
  using Rooms = ListRooms<Question, Record>;
  /// Questions on the device, and a word for the number of records of each.
  struct Asked {
    BufferPart questions, numbers;
    std::uint32_t count;
    const std::function<void(std::uint32_t)>& launched;
  };

  /// Keeps references to all arguments.
  ListStages(Context& gpu, ListKind<Question, Record>& kind, Rooms& rooms) : gpu_(gpu), kind_(kind), rooms_(rooms) {}

  /// Returns the kernel that writes the first records of up to `count` questions to rows.
  QueryKernel& to_rows(std::size_t count) {
    QueryKernel& kernel = kind_.kernel(ListForm::Rows, false);
    const std::size_t rows = std::bit_ceil(std::max(count, kLeastChunk)) * kind_.row();
    kernel.bind(BIND_RECORDS, buffer_for(rooms_.rows, gpu_, rows, "rows of lists"));
    return kernel;
  }
  /// Returns the kernel that writes what does not fit into rows to its place.
  QueryKernel& to_places(Buffer<Record>& records) {
    QueryKernel& kernel = kind_.kernel(ListForm::Rest, false);
    kernel.bind(BIND_PLACES, *rooms_.places);
    kernel.bind(BIND_RECORDS, records);
    return kernel;
  }
  /// Walks the tree. Returns how many walks the driver cut short.
  std::uint32_t walk(QueryKernel& kernel, const Asked& asked, TraceTimes& times) {
    kernel.bind(BIND_RAYS, asked.questions);
    kernel.bind(BIND_CROSSINGS, asked.numbers);
    return kernel.answer(0, asked.count, kind_.whole(), times, asked.launched);
  }

  /// Finds where the lists begin that are no longer than `longest`, among `room` records.
  void place(const Asked& asked, std::uint32_t longest, std::uint32_t room, TraceTimes& times) {
    refresh(gpu_, rooms_.sums, places_source(PLACES_LISTS));
    place(*rooms_.sums, asked, longest, room, times);
  }
  /// The same for lists of any length, which lie behind those that `earlier` sums up. Adds them to these. Writes where
  /// they begin to `offsets`, too, and their end.
  void append(const Asked& asked, const BufferPart& offsets, std::uint32_t room, Buffer<AppendedLists>& earlier,
              TraceTimes& times) {
    refresh(gpu_, rooms_.appends, places_source(PLACES_APPENDED));
    rooms_.appends->bind(BIND_OFFSETS, offsets);
    rooms_.appends->bind(BIND_APPENDED, earlier);
    place(*rooms_.appends, asked, LONGEST_LIST, room, times);
  }

  /// Writes the lists that lie in rows to their places, and puts all in order that are no longer than `longest`.
  void put_in_order(const Asked& asked, Buffer<Record>& records, std::uint32_t longest, TraceTimes& times) {
    refresh(gpu_, rooms_.order, order_source(sizeof(Record) / 4));
    rooms_.order->bind(BIND_CROSSINGS, asked.numbers);
    rooms_.order->bind(BIND_PLACES, *rooms_.places);
    rooms_.order->bind(BIND_ROWS, *rooms_.rows);
    rooms_.order->bind(BIND_RECORDS, records);
    pass(*rooms_.order, asked.count / ORDER_GROUP + 1, OrderPush{asked.count, ORDER_LISTS, kind_.row(), longest},
         times);
  }
  /// Puts those in order that are longer than LONGEST_LIST, but not than `longest`.
  void put_long_in_order(const Asked& asked, Buffer<Record>& records, std::uint32_t longest, TraceTimes& times) {
    refresh(gpu_, rooms_.long_order, order_source(sizeof(Record) / 4, true));
    rooms_.long_order->bind(BIND_CROSSINGS, asked.numbers);
    rooms_.long_order->bind(BIND_PLACES, *rooms_.places);
    rooms_.long_order->bind(BIND_RECORDS, records);
    pass(*rooms_.long_order, asked.count / ORDER_GROUP + 1, OrderPush{asked.count, ORDER_LISTS, kind_.row(), longest},
         times);
  }
  /// Copies all records of the lists to other memory, and no more than there are.
  void carry(const Asked& asked, Buffer<Record>& records, Buffer<Record>& to, TraceTimes& times) {
    rooms_.order->bind(BIND_ROWS, records);
    rooms_.order->bind(BIND_RECORDS, to);
    pass(*rooms_.order, kCarryGroups, OrderPush{asked.count, ORDER_CARRY, 0, 0}, times);
  }

  /// Records a dispatch.
  template <class Push>
  void pass(Kernel& kernel, std::uint32_t groups, const Push& push, TraceTimes& times) {
    gpu_.pass(
        kernel.name(), [&](Commands& cmd) { kernel.dispatch(cmd, groups, push); },
        [&times](double ms) { times.device_ms += ms; });
    ++times.dispatches;
  }

 private:
  static constexpr std::uint32_t kCarryGroups = 1024;

  void place(Kernel& kernel, const Asked& asked, std::uint32_t longest, std::uint32_t room, TraceTimes& times) {
    const std::uint32_t tiles = asked.count / PLACES_TILE + 1;  // a place behind the last list has the sum of all
    const std::size_t most = std::bit_ceil(std::max<std::size_t>(asked.count, kLeastChunk)) + 1;
    kernel.bind(BIND_CROSSINGS, asked.numbers);
    kernel.bind(BIND_PLACES, buffer_for(rooms_.places, gpu_, most, "places of lists"));
    kernel.bind(BIND_TILES, buffer_for(rooms_.tiles, gpu_, 2 * (most / PLACES_TILE + 1), "sums of lists"));
    for (const std::uint32_t step : {PLACES_TILES, PLACES_SUM, PLACES_PLACE})
      pass(kernel, step == PLACES_SUM ? 1 : tiles, PlacesPush{asked.count, tiles, step, longest, room}, times);
  }

  Context& gpu_;
  ListKind<Question, Record>& kind_;
  Rooms& rooms_;
};

}  // namespace ballot
