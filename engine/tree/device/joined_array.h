// An array of all meshes of a scene in one buffer.
#pragma once

#include <glm/vec4.hpp>
#include <optional>
#include <span>
#include <vector>

#include "engine/gpu/buffer.h"

namespace ballot {

using Texels = Buffer<glm::uvec4>;

/// Texels of meshes, one mesh behind the other, each in a region of its own. A region tells of which revision of its
/// mesh its content is, so that only what has changed is written anew. A single mesh has the whole buffer. Belongs to
/// the thread of its Context.
class JoinedArray {
 public:
  JoinedArray(Context& gpu, Access access, const char* name) : gpu_(gpu), access_(access), name_(name) {}

  /// Returns true if the content of a mesh's region is of this revision.
  bool is_current(std::size_t mesh, std::uint64_t revision) const {
    return mesh < regions_.size() && regions_[mesh].revision == revision;
  }
  void set_revision(std::size_t mesh, std::uint64_t revision) { regions_[mesh].revision = revision; }

  /// A mesh and the texels that it is to have.
  struct Wanted {
    std::size_t mesh, texels;
  };
  /// Makes room: the array has `meshes` regions then, and those that are wanted hold so many texels, whose content is
  /// lost. Others keep theirs. What does not fit moves to another buffer, which waits for all passes. Throws
  /// Error(Work) if there is no room.
  void make_room(std::size_t meshes, std::span<const Wanted> wanted);

  /// Gives each mesh the region that another number had; none: it has nothing yet.
  void renumber(std::span<const std::optional<std::uint32_t>> from);

  /// Return the buffer; a mesh's first texel there; and its region.
  const Texels& texels() const { return *texels_; }
  std::uint32_t first(std::size_t mesh) const { return std::uint32_t(regions_[mesh].first); }
  BufferPart part(std::size_t mesh) const;
  /// Returns the texels of a mesh's region.
  std::vector<glm::uvec4> download(std::size_t mesh) const {
    std::vector<glm::uvec4> texels(regions_[mesh].room);
    texels_->download(texels, regions_[mesh].first);
    return texels;
  }
  void upload(std::size_t mesh, std::span<const glm::uvec4> texels) { texels_->upload(texels, regions_[mesh].first); }

  bool used = true;  // since the last change of the tree

 private:
  struct Region {
    std::size_t first = 0, room = 0;
    std::uint64_t revision = 0;  // 0: nothing
  };
  bool fits(std::size_t meshes, std::span<const Wanted> wanted) const;

  Context& gpu_;
  Access access_;
  const char* name_;
  std::optional<Texels> texels_;
  std::vector<Region> regions_;
};

}  // namespace ballot
