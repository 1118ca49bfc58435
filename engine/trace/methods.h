// Every traversal method there is. A new one is a line here and a file under shaders/traverse/: the command line,
// tests, benchmark and documents list it without further change.
#pragma once

#include <span>
#include <string_view>

#include "engine/trace/formulation.h"

namespace ballot {

/// Which data path and stack a method wants on a class of devices; rows of tuning.cpp correct it for single drivers.
struct Wants {
  Fetch fetch;
  StackPlace stack;
};

struct Method {
  std::string_view name;
  std::string_view kernel;  // under shaders/
  std::string_view summary;
  bool packet;  // the subgroup shares one path and votes; knobs vote, packet_stack and cooperative apply
  Wants on_cpu, on_gpu;
};

inline constexpr Method kMethods[] = {
    {"packet",
     "traverse/packet.comp",
     "one path for the subgroup, by vote (Vinkler 3.1)",
     true,
     {Fetch::Texel, StackPlace::Shared},
     {Fetch::Reference, StackPlace::Private}},
    {"if-if",
     "traverse/if_if.comp",
     "each ray by itself, a node or a leaf at a time (Vinkler 3.2)",
     false,
     {Fetch::Texel, StackPlace::Shared},
     {Fetch::Reference, StackPlace::Private}},
    {"while-while",
     "traverse/while_while.comp",
     "each ray by itself, nodes until a leaf (Aila and Laine 2009)",
     false,
     {Fetch::Texel, StackPlace::Shared},
     {Fetch::Reference, StackPlace::Private}},
};

/// The method that measured best on every device so far; it holds until `auto` exists.
inline constexpr std::string_view kDefaultMethod = "while-while";

/// Throws Error(Arguments) that lists the methods there are.
const Method& find_method(std::string_view name);

}  // namespace ballot
