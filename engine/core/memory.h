// How much memory a step may take. Loaders ask before they take it, so that a small file cannot claim the machine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace ballot {

/// Limits the resident memory of this process to `bytes`; 0: only the machine limits it. The limit is compared when
/// memory is asked for; it is no quota of the system. Thread-safe.
void set_memory_limit(std::uint64_t bytes);

/// Returns the bytes that this process can still take: the least of the machine's available memory, what is left in its
/// control group, in its address space and data (ulimit -v, -d), and below set_memory_limit().
std::uint64_t memory_left();

/// Throws Error(Work) if `bytes` more do not fit: "WHAT needs about X of memory, but Y is left; ADVICE or ...". Asks
/// nothing for less than 16 MiB unless a limit is set. Thread-safe.
void need_memory(std::uint64_t bytes, std::string_view what, std::string_view advice = "use a smaller file");

/// Throws Error(Device) if less than `bytes` and `threads` stacks are left below the limits that ulimit -v and -d set.
/// Drivers do not survive when these fail them, so they are asked for before. Asks nothing where there is no such
/// limit.
void need_driver_space(std::uint64_t bytes, std::size_t threads, std::string_view what);

/// Where ulimit -v limits the address space, keeps malloc to one arena: each further one takes 64 MiB of it.
void spare_address_space();

/// Gives the pages of a part of an array back to the system. The array must be allocated memory, and nobody may read
/// the part again: it is zero from then on. A loader so frees what it has used while it makes what stays.
void release_pages(std::span<const std::byte> used);

/// Returns a size in words, such as "1.50 GiB".
std::string size_text(std::uint64_t bytes);

/// Parses a size such as "512M", "4G", "1.5GiB" or "1000000"; K, M, G and T are powers of 1024.
/// Throws Error(Arguments), which names `option`.
std::uint64_t parse_bytes(std::string_view text, std::string_view option);

}  // namespace ballot
