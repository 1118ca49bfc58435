// Questions that the device makes of tables: what many rays or points share goes there once.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/gpu/kernel.h"
#include "shaders/shared/query.h"

namespace ballot {

/// What is made: points of three coordinates, rays, rays that are moved by a pose each.
enum class Made { Points = MADE_POINTS, Rays = MADE_RAYS, PosedRays = MADE_POSED_RAYS };

/// The tables of questions.
struct QuestionTables {
  Made kind;
  MadeQuestions how;
  std::vector<std::uint32_t> words;  // of all columns
};

/// Returns the sources of the kernels that make questions.
std::vector<KernelSource> making_sources();

/// Makes questions of tables that lie on the device. Belongs to the thread of its Context.
class QuestionMaker {
 public:
  /// Throws Error(Work) if the device has too little memory for the tables.
  QuestionMaker(Context& gpu, QuestionTables tables);
  /// Records a pass that writes questions [first, first + count) to the front of a buffer of Ray or ProbePoint. The
  /// first one sends the tables before, in the same submission if they are small.
  void record(std::uint64_t first, std::uint32_t count, const RawBuffer& to);

 private:
  Context& gpu_;
  QuestionTables tables_;
  bool sent_ = false;
  Buffer<MadeQuestions> how_;
  Buffer<std::uint32_t> words_;
};

}  // namespace ballot
