// Attributes of meshes on the device: numbers of a mesh, of its triangles or of its vertices; their values where rays
// hit.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/answer/columns.h"
#include "engine/answer/sums_there.h"
#include "engine/model/heights.h"

namespace ballot {

/// What the values of an attribute are of: VALUES_... of shaders/shared/query.h.
enum class ValuesOf : std::uint32_t {
  None = VALUES_NONE,
  Vertices = VALUES_OF_VERTICES,
  NearVertex = VALUES_OF_NEAR_VERTEX,
  Prims = VALUES_OF_PRIMS,
  Mesh = VALUES_OF_MESH
};

/// An attribute of a mesh.
struct MeshAttribute {
  std::string name;
  ValuesOf of = ValuesOf::None;
  std::uint32_t components = 1;                // numbers of a value, 1 to 4
  std::size_t count = 0;                       // of values
  std::shared_ptr<Buffer<float>> values = {};  // of several meshes, perhaps
  std::size_t first = 0;                       // number of them that is this mesh's

  std::size_t numbers() const { return count * components; }
  /// Returns true if the values of another one can be written over those of this one.
  bool is_like(const MeshAttribute& other) const {
    return name == other.name && of == other.of && components == other.components && count == other.count;
  }
};

/// What a mesh has of attributes, and the vertices of its triangles, three each: on the host, on the device, or told by
/// heights; none: they come in turn. Keeps a reference to the attributes.
struct AttributedMesh {
  std::vector<MeshAttribute>& attributes;
  std::span<const std::uint32_t> indices = {};
  const Buffer<std::uint32_t>* indices_there = nullptr;
  std::shared_ptr<const HeightField> heights = {};
};

/// Writes columns of values. What is needed beside the values is put on the device when somebody first asks; the values
/// of several meshes, which have one name, come to lie in one buffer then. Belongs to the thread of its Context.
class ValueWriter {
 public:
  /// `meshes`: those of the scene, in order, which must stay as long as this. Attributes of one name have as many
  /// components.
  ValueWriter(Context& gpu, SumTable places, std::vector<AttributedMesh> meshes)
      : gpu_(gpu), places_(std::move(places)), meshes_(std::move(meshes)) {}

  /// Records the writing of an attribute's values behind all earlier passes, NaN where there is none. `done` is given
  /// the device milliseconds of each pass. Throws Error(Work) if the device has no room.
  void record(const std::string& name, const ColumnRecords& from, const RawBuffer& to, const Context::Done& done);

 private:
  struct Joined {
    std::uint32_t components = 1;
    std::shared_ptr<Buffer<float>> values;
    std::size_t table = 0;  // where its words begin
  };
  void join();
  std::shared_ptr<Buffer<float>> join_values(const std::vector<MeshAttribute*>& of);
  std::vector<std::uint32_t> place_corners();

  Context& gpu_;
  SumTable places_;
  std::vector<AttributedMesh> meshes_;
  std::map<std::string, Joined> joined_;  // by name; none: join() is to be called
  std::unique_ptr<Buffer<std::uint32_t>> table_, corners_;
  std::map<std::string, std::unique_ptr<Kernel>> kernels_;  // by name
};

/// Returns the sources of all kernels that write values.
std::vector<KernelSource> value_sources();

}  // namespace ballot
