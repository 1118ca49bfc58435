// Walks of the host over the tree that a CPU device has in memory: for a few questions, which it answers in less time
// than the device takes to begin.
#pragma once

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <optional>
#include <span>

#include "engine/answer/kernel_arrays.h"
#include "engine/answer/stream.h"
#include "engine/core/interruption.h"
#include "engine/core/stopwatch.h"
#include "engine/core/want.h"
#include "shaders/shared/query.h"

namespace ballot {

/// Answers single questions in mode watertight with the bits of the kernels: the arithmetic of
/// shaders/lib/numeric/triangle_watertight.glsl, shaders/query/closest_point.comp and shaders/query/inside.comp,
/// operation by operation, as lavapipe rounds it. Which hit is some hit (Want::Any) depends on the walk, as it does
/// among methods. It is valid until the next generation of its tree. Thread-safe.
class HostWalk {
 public:
  enum class Of { Rays, Points };

  /// Returns a walk of the arrays that kernels for rays or for points read. Makes arrays that are not there, for which
  /// the caller is asked first (ask_interruption()), and waits for all passes. Returns none where the device has to
  /// answer: of forests, on GPUs, with a driver whose arithmetic is not known, or Context::answers_few() is false.
  /// `layout`: for tests, another one than that of the kernels.
  static std::optional<HostWalk> over(Context& gpu, DeviceTree& tree, Of what, std::optional<NodeLayout> layout = {});

  Hit trace(const Ray& ray, Want want) const;
  /// Returns the nearest point of the triangles within the point's limit. `pseudonormals`: PSEUDONORMALS of each
  /// triangle, for Nearest::behind, or none.
  Nearest nearest(const ProbePoint& point, std::span<const glm::vec3> pseudonormals = {}) const;
  /// Returns true if the ray along +x crosses an odd number of triangles; each is to be in one leaf (WholeTree).
  bool inside(const glm::vec3& point) const;

 private:
  HostWalk() = default;

  const glm::uvec4 *nodes_ = nullptr, *leaves_ = nullptr;
  NodeLayout layout_ = NodeLayout::Interleaved;
  std::uint32_t root_ = END_OF_TREE;
  Bounds scene_;
  glm::vec3 box_origin_{0};
  float shear_scale_ = 0, shear_near_ = 0;
};

/// Answers a stream of few questions by walk(question) for each: here, or with other threads if there are more than
/// `alone`. Adds the seconds to `walked_s`.
template <class Question, class Answer, class Walk>
TraceTimes answer_here(const Stream<Question, Answer>& stream, std::size_t alone, double& walked_s, const Walk& walk) {
  std::vector<Question> questions(stream.most);
  questions.resize(stream.most ? stream.next(0, questions) : 0);
  std::vector<Answer> answers(questions.size());
  const auto some = [&](std::size_t begin, std::size_t end) {
    check_interruption();
    for (std::size_t i = begin; i < end; ++i) answers[i] = walk(questions[i]);
  };
  const Timer timer;
  const std::size_t count = answers.size(), step = alone / 8;  // few, as a walk may take long
  if (count > alone)
    for_chunks(count, step, some);
  else
    for (std::size_t i = 0; i < count; i += step) some(i, std::min(i + step, count));
  const double seconds = timer.seconds();
  walked_s += seconds;
  if (count) stream.take(0, answers);
  if (count && stream.progress) stream.progress(count);
  return {.device_ms = 1e3 * seconds};
}

}  // namespace ballot
