// Where a query's list goes, for kernels that list. RECORD is the type of a record.
//
//   LISTS_ROWS     query i has ROW records from i * ROW on. What does not fit is left out.
//   LISTS_PLACES   it has those from places[i] on and before places[i + 1]. Queries whose list has no place, or fitted
//                  into a row of ROW records, are left out; with ROW = 0 none is.
//
//   begin_list(query)   returns false if the query is left out
//   list(record)        adds a record
#if BALLOT_LISTS != LISTS_NONE
layout(constant_id = SPEC_ROW) const uint ROW = 8;
layout(set = 0, binding = BIND_RECORDS, scalar) writeonly buffer Records { RECORD records[]; };
uint next_record, end_record;

void list(RECORD record) {
  if (next_record < end_record) records[next_record++] = record;
}
#endif

#if BALLOT_LISTS == LISTS_PLACES
layout(set = 0, binding = BIND_PLACES, scalar) readonly buffer Places { uint places[]; };

bool begin_list(uint query) {
  next_record = places[query];
  end_record = places[query + 1u];
  return end_record - next_record > ROW || ROW == 0u;
}
// Numbers that are known stay: places follow from them.
#define WRITES_NUMBER (ROW == 0u)
#else
bool begin_list(uint query) {
#if BALLOT_LISTS == LISTS_ROWS
  next_record = query * ROW;
  end_record = next_record + ROW;
#endif
  return true;
}
#define WRITES_NUMBER true
#endif
