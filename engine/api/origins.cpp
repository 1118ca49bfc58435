#include "engine/api/origins.h"

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "engine/api/mesh_heights.h"
#include "engine/core/parallel.h"
#include "engine/model/recentring.h"

namespace ballot::api {

namespace {

constexpr std::size_t kVertices = 1 << 16;                                             // that a thread takes at a time
constexpr std::size_t kMostInstances = std::numeric_limits<std::uint32_t>::max() - 2;  // each has a triangle at least
constexpr double kFarthest = 1e30;                                                     // that a ray may start

/// A box in double; empty at first.
struct Box {
  glm::dvec3 lo{std::numeric_limits<double>::infinity()}, hi{-std::numeric_limits<double>::infinity()};

  bool is_empty() const { return !(lo.x <= hi.x); }
  void add(const glm::dvec3& p) {
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) lo = glm::min(lo, p), hi = glm::max(hi, p);
  }
  glm::dvec3 origin() const {
    const glm::dvec3 found = is_empty() ? glm::dvec3(0) : origin_for(lo, hi);
    for (int axis = 0; axis < 3; ++axis)
      if (std::abs(found[axis]) > kFarthest)
        refuse(fmt::format("coordinates lie about ({}, {}, {}); expected within +-{:g}, where rays may start", found.x,
                           found.y, found.z, kFarthest));
    return found;
  }
};

Box join(Box a, const Box& b) {
  a.lo = glm::min(a.lo, b.lo), a.hi = glm::max(a.hi, b.hi);
  return a;
}

glm::dvec3 vector_of(const double (&v)[3], const std::string& where) {
  for (const double x : v)
    if (!(std::abs(x) <= kFarthest))
      refuse(fmt::format("{}: origin is ({}, {}, {}); expected finite numbers within +-{:g}", where, v[0], v[1], v[2],
                         kFarthest));
  return {v[0], v[1], v[2]};
}

template <class Number>
glm::dvec3 vertex_at(const Number* first, std::size_t stride, std::size_t i) {
  std::array<Number, 3> v;
  std::memcpy(v.data(), reinterpret_cast<const char*>(first) + i * stride, sizeof v);
  return {v[0], v[1], v[2]};
}

template <class Number>
Box box_of(const Number* first, std::size_t stride, std::size_t count) {
  const auto of = [&](std::size_t begin, std::size_t end) {
    Box box;
    for (std::size_t i = begin; i < end; ++i) box.add(vertex_at(first, stride, i));
    return box;
  };
  return joined_chunks(count, kVertices, Box(), of, join);
}

template <class Number>
std::size_t stride_in(std::size_t given, std::size_t count, const std::string& where) {
  return stride_of(given, 3 * sizeof(Number), count, where + ": position_stride");
}

/// Returns the box of a mesh in its own space; empty if its vertices lie on the device.
Box box_of(const BallotMesh& m, const std::string& where) {
  if (m.positions_double)
    return box_of(m.positions_double, stride_in<double>(m.position_stride, m.vertex_count, where), m.vertex_count);
  if (m.heights) {
    const HeightBox box = box_of(*read_heights(m, where));
    return {box.lo, box.hi};
  }
  if (m.positions)
    return box_of(m.positions, stride_in<float>(m.position_stride, m.vertex_count, where), m.vertex_count);
  return {};
}

Box moved(const Box& box, const MatrixInDouble& m) {
  Box to;
  for (int corner = 0; corner < 8 && !box.is_empty(); ++corner) {
    const glm::dvec3 p(corner & 1 ? box.hi.x : box.lo.x, corner & 2 ? box.hi.y : box.lo.y,
                       corner & 4 ? box.hi.z : box.lo.z);
    glm::dvec3 q;
    for (int row = 0; row < 3; ++row) {
      const double* r = &m[std::size_t(4 * row)];
      q[row] = r[0] * p.x + r[1] * p.y + r[2] * p.z + r[3];
    }
    to.add(q);
  }
  return to;
}

bool is_identity(const MatrixInDouble& m) { return m == MatrixInDouble{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}; }

/// Returns true if an origin is found for a mesh.
bool is_in_double(const BallotMesh& m) { return m.positions_double || m.heights; }

std::string name_of(std::size_t mesh) { return fmt::format("mesh {}", mesh); }

/// Returns the box of all meshes in the world.
Box box_of_world(std::span<const Box> boxes, const GivenInstances* instances) {
  Box world;
  if (!instances)
    for (const Box& box : boxes) world = join(world, box);
  else
    for (std::size_t i = 0; i < instances->placements.size(); ++i)
      if (const std::uint32_t mesh = instances->placements[i].mesh; mesh < boxes.size())
        world = join(world, moved(boxes[mesh], instances->matrices[i]));
  return world;
}

}  // namespace

GivenInstances read_instances(const BallotInstances& given) {
  if (given.transforms && given.transforms_double)
    refuse("instances: both transforms and transforms_double are set; expected one of them");
  if (given.count && !given.transforms && !given.transforms_double)
    refuse(fmt::format("instances: transforms is NULL, but count is {}", given.count));
  if (given.count > kMostInstances)
    refuse(fmt::format("instances: count is {}; at most {} are possible", given.count, kMostInstances));
  GivenInstances all;
  all.in_double = given.transforms_double != nullptr;
  const std::size_t stride =
      stride_of(given.transform_stride, all.in_double ? sizeof(MatrixInDouble) : sizeof(Transform), given.count,
                "instances: transform_stride");
  all.placements.resize(given.count);
  all.matrices.resize(given.count);
  for (std::size_t i = 0; i < given.count; ++i) {
    Placement& p = all.placements[i];
    if (given.meshes) p.mesh = given.meshes[i];
    if (given.masks) p.mask = given.masks[i];
    if (given.groups) p.group = given.groups[i];
    all.matrices[i] =
        all.in_double ? matrix_at(given.transforms_double, stride, i) : matrix_at(given.transforms, stride, i);
    p.transform = about(all.matrices[i], glm::dvec3(0), glm::dvec3(0));
  }
  return all;
}

Transform about(const MatrixInDouble& m, const glm::dvec3& mesh, const glm::dvec3& scene) {
  Transform t;
  for (int row = 0; row < 3; ++row) {
    const double* r = &m[std::size_t(4 * row)];
    for (int column = 0; column < 3; ++column) t.m[row][column] = float(r[column]);
    double place = r[3];
    if (mesh != glm::dvec3(0) || scene != glm::dvec3(0))  // else zeros keep their sign
      place = (place - scene[row]) + (r[0] * mesh.x + r[1] * mesh.y + r[2] * mesh.z);
    t.m[row][3] = float(place);
  }
  return t;
}

glm::dvec3 own_origin(const BallotMesh& m, const std::string& where) {
  const glm::dvec3 given = vector_of(m.origin, where);
  if (given != glm::dvec3(0) || !is_in_double(m)) return given;
  check_mesh(m, where);
  return box_of(m, where).origin();
}

Origins find_origins(const BallotMesh* meshes, std::size_t count, const GivenInstances* instances,
                     const double (&scene)[3]) {
  Origins origins{vector_of(scene, "scene"), std::vector<glm::dvec3>(count)};
  std::vector<BallotMesh> all(count);
  bool in_double = instances && instances->in_double;
  for (std::size_t i = 0; i < count; ++i) {
    all[i] = mesh_struct(meshes, i);
    origins.meshes[i] = vector_of(all[i].origin, name_of(i));
    in_double = in_double || is_in_double(all[i]);
  }
  const bool is_found = origins.scene == glm::dvec3(0);
  if (is_found && !in_double) return origins;
  std::vector<Box> boxes;
  for (std::size_t i = 0; i < count; ++i) {
    check_mesh(all[i], name_of(i));
    boxes.push_back(box_of(all[i], name_of(i)));
  }
  if (is_found) origins.scene = box_of_world(boxes, instances).origin();
  std::vector<bool> in_world(count, true);
  for (std::size_t i = 0; instances && i < instances->placements.size(); ++i)
    if (const std::uint32_t mesh = instances->placements[i].mesh; mesh < count && !is_identity(instances->matrices[i]))
      in_world[mesh] = false;
  for (std::size_t i = 0; i < count; ++i) {
    if (is_found && origins.scene != glm::dvec3(0) && all[i].vertex_buffer)
      refuse(
          fmt::format("mesh {}: vertex_buffer has float32 about the scene's origin, which would be found as "
                      "({}, {}, {}); expected one that is named: BallotSceneOptions::origin",
                      i, origins.scene.x, origins.scene.y, origins.scene.z));
    if (origins.meshes[i] != glm::dvec3(0)) continue;
    if (in_world[i])
      origins.meshes[i] = origins.scene;
    else if (is_in_double(all[i]))
      origins.meshes[i] = boxes[i].origin();
  }
  return origins;
}

RoundedVertices round_vertices(const float* positions, const double* in_double, std::size_t count, std::size_t stride,
                               const glm::dvec3& origin, const std::string& where) {
  const std::size_t step = in_double ? stride_in<double>(stride, count, where) : stride_in<float>(stride, count, where);
  if (!in_double && origin == glm::dvec3(0)) return {DenseVertices(positions, step, count), 0};
  DenseVertices made;
  made.gathered.resize(count);
  const auto round = [&](std::size_t begin, std::size_t end) {
    double most = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const glm::dvec3 p = (in_double ? vertex_at(in_double, step, i) : vertex_at(positions, step, i)) - origin;
      made.gathered[i] = glm::vec3(p);
      most = std::max(most, glm::length(glm::dvec3(made.gathered[i]) - p));
    }
    return most;
  };
  const double moved = joined_chunks(count, kVertices, 0.0, round, [](double a, double b) { return std::max(a, b); });
  made.all = made.gathered;
  if (moved == 0) return {std::move(made), 0};
  std::vector<glm::dvec3> exact(count);
  for_chunks(count, kVertices, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      exact[i] = (in_double ? vertex_at(in_double, step, i) : vertex_at(positions, step, i)) - origin;
  });
  return {std::move(made), moved, std::make_shared<const std::vector<glm::dvec3>>(std::move(exact))};
}

}  // namespace ballot::api
