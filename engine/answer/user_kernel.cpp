#include "engine/answer/user_kernel.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>
#include <optional>

#include "engine/answer/point_instances.h"
#include "engine/answer/query_kernel.h"
#include "engine/answer/user_include.h"
#include "engine/answer/user_text.h"
#include "engine/core/error.h"
#include "engine/core/registry.h"
#include "engine/model/shapes.h"

namespace ballot {

namespace {

const TreeFacts kFlat{.depth = 32, .largest_leaf = MAX_LEAF_TRIANGLES};

/// Notes what an element of each array takes, as the compiler tells.
void take_sizes(const UserText& text, const std::map<std::uint32_t, std::uint32_t>& known,
                std::vector<UserArray>& arrays) {
  for (std::size_t i = 0; i < arrays.size(); ++i) {
    const auto found = known.find(BIND_USER_ARRAYS + std::uint32_t(i));
    if (found == known.end())
      fail(Failure::Arguments,
           "kernel {}: {}: array '{}' is declared where nothing is compiled; take it out of its #if", text.name,
           text.file, arrays[i].name);
    arrays[i].bytes = found->second;
  }
}

OwnText own_text(const UserText& text, const WholeText& whole) {
  return {whole.text, text.name, text.numeric, text.include_set.has_value()};
}

}  // namespace

UserInputs inputs_of(Context& gpu, const UserText& text) {
  WholeText whole = whole_text(text);
  for (const char* define : {"BALLOT_HAS_INSTANCES", "BALLOT_STORED", "BALLOT_HAS_SHAPES"})
    whole.defines.emplace_back(define, 0);
  const KernelSource source = own_source("called", gpu.info(), kFlat, whole.defines, own_text(text, whole));
  Reflection reflection;
  try {
    reflection = reflect(compiled(gpu, source).words, source.name);
  } catch (const Error& error) {
    std::string message = error.what();
    message.erase(message.find_last_not_of(" \n") + 1);
    throw Error(Failure::Arguments, message);  // it is the text that the compiler refuses
  }
  take_sizes(text, reflection.element_bytes, whole.arrays);
  return {std::move(whole.arrays), std::move(whole.numbers)};
}

struct UserKernel::Parts {
  Parts(Context& device, DeviceTree& tree, UserText user, UserTriangles of)
      : gpu(device),
        scene(tree),
        text(std::move(user)),
        whole(whole_text(text)),
        triangles(std::move(of)),
        once(device, tree) {
    if ((whole.calls.corner || whole.calls.place) && !triangles.bind)
      fail(Failure::Arguments, "kernel {}: {} calls corner() or place(), and this scene has no triangles to read",
           text.name, text.file);
    whole.defines.insert(whole.defines.end(), triangles.defines.begin(), triangles.defines.end());
    std::size_t bytes = 0;
    for (const UserNumber& n : whole.numbers) {
      offsets.push_back(bytes);
      bytes += n.bytes;
    }
    values.resize(bytes);
    bound.resize(whole.arrays.size());
    prepare();
    take_sizes(text, kernel->element_bytes(), whole.arrays);
  }

  /// Counting, and showing each hit once, takes a tree that has each triangle once. Shapes take one whose boxes hold
  /// them whole.
  bool wants_each_once() const { return whole.calls.count || whole.calls.accepts || whole.calls.intersects; }

  /// Makes or renews the kernel for the tree as it is now.
  void prepare() {
    if (wants_each_once() && once.update()) kernel.reset();
    DeviceTree& tree = this->tree();
    if (!kernel) kernel.emplace(gpu, tree, "called", whole.defines, false, SpecConstants(), own_text(text, whole));
    kernel->prepare();
    if (whole.calls.corner) kernel->bind(triangles.bind);
    if (whole.calls.place) bind_places();
    if (!whole.calls.closest || !tree.forest()) return;
    instances.update(gpu, tree, kernel->fetch());
    kernel->bind(BIND_POINT_INSTANCES, instances.device());
  }
  void bind_places() {
    if (!places || places_of != scene.generation()) {
      const std::vector<glm::uvec2> all = triangles.places();
      places.emplace(gpu, all.size(), Access::Storage, "instances of a kernel");
      places->upload(all);
      places_of = scene.generation();
    }
    kernel->bind(BIND_USER_PLACES,
                 BufferPart(*places, 0, places->size() * sizeof(glm::uvec2)));  // the buffer may have more
  }
  DeviceTree& tree() { return wants_each_once() ? once.tree() : scene; }

  /// Prepares the kernel and binds its arrays and numbers.
  QueryKernel& ready() {
    prepare();
    for (std::size_t i = 0; i < bound.size(); ++i) {
      if (!bound[i])
        fail(Failure::Arguments, "kernel {}: array '{}' is not bound; give it a buffer before the kernel runs",
             text.name, whole.arrays[i].name);
      kernel->bind(BIND_USER_ARRAYS + std::uint32_t(i), *bound[i]);
    }
    if (values.empty()) return *kernel;
    if (!numbers) numbers.emplace(gpu, values.size(), Access::Uniform, fmt::format("numbers of kernel {}", text.name));
    kernel->bind(BIND_USER_NUMBERS, *numbers);
    return *kernel;
  }

  Context& gpu;
  DeviceTree& scene;
  UserText text;
  WholeText whole;
  UserTriangles triangles;
  WholeTree once;
  std::optional<QueryKernel> kernel;
  PointInstances instances;
  std::vector<std::optional<BufferPart>> bound;  // of each array
  std::vector<std::size_t> offsets;              // of each number
  std::vector<std::byte> values;                 // of all numbers
  std::optional<Buffer<std::byte>> numbers;
  std::optional<Buffer<glm::uvec2>> places;
  std::uint64_t places_of = 0;  // generation of the scene
  std::string flat;             // the include, as it was made of a source
  KernelSource flat_of;
};

UserKernel::UserKernel(Context& gpu, DeviceTree& scene, UserText text, UserTriangles triangles)
    : parts_(std::make_unique<Parts>(gpu, scene, std::move(text), std::move(triangles))) {}

UserKernel::~UserKernel() = default;
UserKernel::UserKernel(UserKernel&& other) noexcept = default;

void UserKernel::bind(std::string_view array, const BufferPart& part) {
  const std::vector<UserArray>& arrays = parts_->whole.arrays;
  const UserArray& found = find_named(arrays, array, fmt::format("array of kernel {}", parts_->text.name));
  constexpr std::uint64_t kLeast = 16;  // bytes of the smallest buffer
  const std::uint64_t size = found.bytes, whole = part.bytes / size * size;
  if (whole == 0 || (whole != part.bytes && part.bytes > kLeast))
    fail(Failure::Arguments, "kernel {}: array '{}' is of {} with {} bytes each; found {} bytes", parts_->text.name,
         array, found.type, size, part.bytes);
  parts_->bound[std::size_t(&found - arrays.data())].emplace(part.buffer, part.offset, whole);
}

void UserKernel::set(std::string_view number, std::span<const std::byte> value) {
  const std::vector<UserNumber>& numbers = parts_->whole.numbers;
  const UserNumber& found = find_named(numbers, number, fmt::format("number of kernel {}", parts_->text.name));
  if (value.size() != found.bytes)
    fail(Failure::Arguments, "kernel {}: number '{}' is of {} with {} bytes; found {} bytes", parts_->text.name, number,
         found.type, found.bytes, value.size());
  std::ranges::copy(value,
                    parts_->values.begin() + std::ptrdiff_t(parts_->offsets[std::size_t(&found - numbers.data())]));
}

TraceTimes UserKernel::run(std::uint32_t count, const std::function<void(std::uint32_t)>& progress) {
  TraceTimes times;
  Parts& p = *parts_;
  QueryKernel& kernel = p.ready();
  if (p.numbers) p.numbers->upload(p.values);
  const std::uint32_t unfinished = kernel.run(0, count, {p.tree().root()}, times, progress);
  if (unfinished)
    fail(Failure::Work,
         "kernel {}: {} of {} invocations could not be finished on {}: its driver stops loops after a few iterations; "
         "let each invocation do less, or use Mesa 25 or later",
         p.text.name, unfinished, count, p.gpu.info().name);
  return times;
}

bool UserKernel::can_record(std::uint32_t count) {
  parts_->prepare();
  return parts_->kernel->can_record(count);
}

void UserKernel::record(std::uint32_t count, TraceTimes& times) {
  Parts& p = *parts_;
  QueryKernel& kernel = p.ready();
  if (p.numbers)
    p.gpu.pass(p.text.name, [&](Commands& cmd) { cmd.write(*p.numbers, 0, p.values.data(), p.values.size()); });
  kernel.record(0, count, {p.tree().root()}, times);
}

UserInclude UserKernel::include() {
  Parts& p = *parts_;
  QueryKernel& kernel = p.ready();
  kernel.bind_pushes({p.tree().root()});
  if (p.flat.empty() || !is_made_from(p.flat_of, kernel.source())) {
    p.flat = flat_include(p.text, kernel.source(), p.gpu.info());
    p.flat_of = kernel.source();
  }
  p.gpu.finish();
  const auto [layout, set] = kernel.descriptors();
  return {p.flat, layout, set};
}

UnsetVector<Triangle> stand_ins(std::span<const Bounds> boxes) {
  UnsetVector<Triangle> all;
  all.reserve(boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Bounds& box = boxes[i];
    if (!glm::all(glm::lessThanEqual(box.lo, box.hi)))
      fail(Failure::Arguments,
           "box {} of shapes: from ({}, {}, {}) to ({}, {}, {}); each end must be at or above its start", i, box.lo.x,
           box.lo.y, box.lo.z, box.hi.x, box.hi.y, box.hi.z);
    all.push_back(stand_in(box));
  }
  return all;
}

bool UserKernel::is_robust() const { return parts_->gpu.info().robust_buffers(); }

std::vector<KernelSource> user_sources(const DeviceInfo& device) {
  constexpr std::pair<const char*, const char*> kCalls[] = {
      {"nearest", "sums[index] = nearest(rays[index]).t;"},
      {"any", "sums[index] = float(any(rays[index]));"},
      {"count", "sums[index] = float(count(rays[index]));"},
      {"closest", "sums[index] = closest(rays[index].origin).distance;"}};
  TreeFacts far = kFlat, instances = kFlat;
  far.far = true;
  instances.top_depth = 24;
  std::vector<KernelSource> sources;
  for (const TreeFacts& tree : {kFlat, far, instances})
    for (const bool accepts : {false, true})
      for (std::uint32_t set = 1; set < 1u << std::size(kCalls); ++set) {
        UserText user{.text =
                          "readonly buffer Rays { Ray rays[]; };\nbuffer Sums { float sums[]; };\n"
                          "uniform float radius;\n"};
        std::string body, names;
        for (std::size_t i = 0; i < std::size(kCalls); ++i)
          if (set >> i & 1) body += kCalls[i].second, names += fmt::format(" {}", kCalls[i].first);
        if (accepts) user.text += "bool accept(Hit hit) { return hit.t > radius; }\n";
        user.text += "void main(uint index) { " + body + " }";
        const WholeText whole = whole_text(user);
        const std::string name = fmt::format("user{}{}{}{}", names, accepts ? " accept" : "", tree.far ? " far=1" : "",
                                             tree.top_depth ? " instances=1" : "");
        sources.push_back(own_source("called", device, tree, whole.defines, {whole.text, name}));
      }
  return sources;
}

}  // namespace ballot
