// Kernels of users: a text in GLSL that reads and writes arrays of theirs and asks a scene, compiled at run time.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "engine/answer/dispatch.h"
#include "engine/gpu/kernel.h"
#include "engine/tree/device/device_tree.h"

namespace ballot {

/// An array that a kernel's text declares, as `buffer NAME { TYPE name[]; };`. The type is float, int or uint, a vector
/// of 2 to 4 of them, Ray, Hit or Nearest, or a struct of the text, in scalar layout: vec3 takes 12 bytes.
struct UserArray {
  std::string name, type;
  bool written = false;     // false: it is declared as readonly
  std::uint32_t bytes = 0;  // of an element
};

/// A number, the same in all invocations, that a text declares, as `uniform TYPE name;`: float, int, uint or a vector
/// of them.
struct UserNumber {
  std::string name, type;
  std::uint32_t bytes = 0;
};

/// What a text declares, in its order.
struct UserInputs {
  std::vector<UserArray> arrays;
  std::vector<UserNumber> numbers;
};

/// The text of a kernel, and what it is about.
struct UserText {
  std::string name = "kernel";  // in messages
  /// GLSL (version 460, for Vulkan) with `void main(uint index)`, which is called once for each index. It may have
  /// arrays and numbers, functions, constants, variables of an invocation, structs and macros of its own, whatever
  /// their names, but for those of shaders/lib/called/scene.glsl, whose calls it may make, and names that begin with
  /// `ballot_`. It has no #include, #version or layout(), no arrays in an #if, and no barrier(), as some invocations
  /// have no index.
  std::string text = {};
  std::string file = "kernel.glsl";  // in messages of the compiler, which count lines from first_line on
  std::uint32_t first_line = 1;
  /// The numeric mode of nearest() and any(): watertight, plain or fast. Other calls, and shapes, take watertight.
  std::string numeric = "watertight";
  /// The set of descriptors of an include for a program's own shader, which is no kernel. Then `text` lists names, with
  /// blanks between them: of calls, and of hooks that the program has.
  std::optional<std::uint32_t> include_set = {};
};

/// What a shader of a program's own takes to call a scene (engine/answer/user_include.h).
struct UserInclude {
  const std::string& text;                // in GLSL, without directives but for extensions; this object's
  std::uint64_t set_layout = 0, set = 0;  // Vulkan's handles, this object's; valid until the scene changes
};

/// What kernels need to read the triangles of a scene: corner() and place() in their texts.
struct UserTriangles {
  Defines defines = {};                    // of shaders/lib/shade/triangles.glsl
  std::function<void(Kernel&)> bind = {};  // binds what that reads
  /// Returns the first triangle and the number of each instance that is placed, in ascending order.
  std::function<std::vector<glm::uvec2>()> places = {};
};

/// Returns what a text declares. Compiles it for a flat scene: throws Error(Arguments) for wrong names and types, for a
/// text without `void main(uint index)`, and with the compiler's message, which names the user's file and line.
UserInputs inputs_of(Context& gpu, const UserText& text);

/// A user's kernel over a scene. Its calls of the scene have the bits of the answers that Tracer, by method
/// while-while, RayQueries and PointQueries give; in mode watertight all methods have the same bits. Each call is a
/// walk of its invocation alone, in any control flow. Follows the scene's tree when it changes. Belongs to the thread
/// of its Context.
///
/// Arrays: an index beyond the end of an array is the kernel's fault. On devices with VK_EXT_pipeline_robustness it
/// reads something or nothing, and writes nothing outside of the array (is_robust()); on others it may read and write
/// whatever there is, and the device may be lost.
///
/// Time: runs go in launches of a tenth of a second, or less where the device asks for that, by the time of those
/// before. Between them a caller can end the run. An invocation that never ends is ended by the system alone: GPUs with
/// a screen are reset after seconds (DeviceLost); other GPUs and CPU devices go on for ever.
class UserKernel {
 public:
  /// Keeps references to gpu and scene. Throws as inputs_of() does; Error(Work) if the device has too few bindings for
  /// the text's arrays.
  /// `triangles`: without them a text that calls corner() or place() is refused.
  UserKernel(Context& gpu, DeviceTree& scene, UserText text, UserTriangles triangles = {});
  ~UserKernel();
  UserKernel(UserKernel&& other) noexcept;

  /// Binds an array for all runs from now on, which must live as long. Throws Error(Arguments) if there is none of this
  /// name, or the bytes are no multiple of its elements'.
  void bind(std::string_view array, const BufferPart& part);
  /// Sets a number for all runs from now on; those never set are 0. Throws Error(Arguments) if there is none of this
  /// name, or if it has another size.
  void set(std::string_view number, std::span<const std::byte> value);
  template <class T>
  void set(std::string_view number, const T& value) {
    static_assert(std::is_trivially_copyable_v<T>, "the device sees bytes, not objects");
    set(number, std::as_bytes(std::span(&value, 1)));
  }

  /// Calls main() for each index below `count`, in no order, and waits. `progress` is called now and then with the
  /// number of indices that are done; it may be empty, and may throw to end the run. Throws Error(Arguments) if an
  /// array is not bound; Error(Work) if the driver stopped loops early (Mesa's lavapipe before version 25 does so after
  /// 65 535 iterations of an invocation), and what was written then is not to be used.
  TraceTimes run(std::uint32_t count, const std::function<void(std::uint32_t)>& progress = {});
  /// Returns true if a run of so many indices can be recorded between other passes, so that nobody waits for it.
  bool can_record(std::uint32_t count);
  /// Records such a run behind all earlier passes. Adds the time to `times`, which must outlive it.
  void record(std::uint32_t count, TraceTimes& times);

  /// Of a text with include_set: returns what the program takes for the scene as it is now. Waits for all passes.
  UserInclude include();

  /// Returns true if the device keeps indices within arrays.
  bool is_robust() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Returns triangles that stand in for shapes of a user's in a scene, as his intersect() finds what rays meet of them:
/// each has the bounds of a box, which is widened where it has no area. Throws Error(Arguments) for a box that ends
/// before it starts or is NaN.
UnsetVector<Triangle> stand_ins(std::span<const Bounds> boxes);

/// Returns the sources of kernels of users that together make every call in every way, for a device.
std::vector<KernelSource> user_sources(const DeviceInfo& device);

}  // namespace ballot
