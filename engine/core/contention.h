// How busy the cores are with other work.
#pragma once

namespace ballot {

/// Returns how many times as long as on idle cores a thread takes for its work. That is the time in which the calling
/// thread ran or waited for a core since it last asked, or since it began, over that in which it ran. Another thread of
/// this process may have caused some of the wait, so that half a core's share of all cores is taken off. Where the
/// thread ran for less than 10 ms since, the answer is the same as before. At least 1, and 1 where the system does not
/// tell: it takes Linux's /proc/thread-self/schedstat. Thread-safe.
double contention();

}  // namespace ballot
