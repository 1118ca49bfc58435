// Queries and result arrays as Python hands them over.
#pragma once

#include "common.h"

namespace ballot::python {

/// How to find hits.
struct QueryObject {
  Query query;
};

/// Arrays for results, of which any may be missing: flat, contiguous, in the host's memory.
class ResultArrays {
 public:
  template <class T>
  using Column = std::optional<nb::ndarray<T, nb::ndim<1>, nb::c_contig, nb::device::cpu>>;

  ResultArrays(Column<float> hits, Column<float> t, Column<std::uint32_t> prims, Column<std::uint32_t> mesh_ids,
               Column<float> uvs, Column<float> normals, Column<std::uint8_t> occluded, Column<std::uint32_t> instances)
      : hits_(std::move(hits)),
        t_(std::move(t)),
        uvs_(std::move(uvs)),
        normals_(std::move(normals)),
        prims_(std::move(prims)),
        mesh_ids_(std::move(mesh_ids)),
        instances_(std::move(instances)),
        occluded_(std::move(occluded)) {}

  /// Returns the pointers. Throws Error(Argument) unless each array has room for `count` rays and no more.
  Results results(std::size_t count) const {
    Results r;
    r.hits = reinterpret_cast<Hit*>(column(hits_, 4 * count, "hits"));
    r.t = column(t_, count, "t");
    r.prims = column(prims_, count, "prims");
    r.mesh_ids = column(mesh_ids_, count, "mesh_ids");
    r.uvs = column(uvs_, 2 * count, "uvs");
    r.normals = column(normals_, 3 * count, "normals");
    r.occluded = column(occluded_, count, "occluded");
    r.instances = column(instances_, count, "instances");
    return r;
  }

 private:
  template <class T>
  static T* column(const Column<T>& array, std::size_t expected, const char* name) {
    if (!array) return nullptr;
    if (array->size() != expected)
      throw Error(Code::Argument, std::string(name) + " has " + std::to_string(array->size()) + " numbers; expected " +
                                      std::to_string(expected));
    return array->data();
  }

  Column<float> hits_, t_, uvs_, normals_;
  Column<std::uint32_t> prims_, mesh_ids_, instances_;
  Column<std::uint8_t> occluded_;
};

}  // namespace ballot::python
