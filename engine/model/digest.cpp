#include "engine/model/digest.h"

#include <bit>

#include "engine/model/instances.h"

namespace ballot {

namespace {

/// An FNV-1a hash that takes eight bytes at a time.
class Digest {
 public:
  std::uint64_t value() const { return hash_; }

  void word(std::uint64_t w) {
    hash_ = (hash_ ^ w) * 0x100000001B3u;
    hash_ ^= hash_ >> 32;  // the product carries only towards higher bits
  }
  void number(float f) { word(std::bit_cast<std::uint32_t>(f)); }
  void vector(const glm::vec3& v) {
    for (int i = 0; i < 3; ++i) number(v[i]);
  }
  /// Hashes the size too, so that moving an item from one list to the next changes the digest.
  template <class Items, class Each>
  void list(const Items& items, Each each) {
    word(items.size());
    for (const auto& item : items) each(item);
  }
  void corners(std::span<const std::array<glm::vec3, 3>> items) {
    list(items, [&](const auto& t) {
      for (const glm::vec3& v : t) vector(v);
    });
  }
  void use(const TextureUse& u) {
    word(u.texture);
    word(u.set);
    vector(u.row_u);
    vector(u.row_v);
  }

 private:
  std::uint64_t hash_ = 0xCBF29CE484222325u;
};

void add(Digest& d, const Material& m) {
  d.vector(m.base_color);
  d.vector(m.emissive);
  for (const float f : {m.metallic, m.roughness, m.transmission, m.ior, m.alpha, m.alpha_cutoff, m.normal_scale})
    d.number(f);
  d.word(std::uint64_t(m.alpha_mode));
  d.word(m.unlit);
  for (const TextureUse* use : m.uses()) d.use(*use);
}

void add(Digest& d, const Texture& t) {
  d.word(t.image);
  d.word(std::uint64_t(t.wrap_u));
  d.word(std::uint64_t(t.wrap_v));
  d.word(t.nearest);
}

void add(Digest& d, const TextureImage& i) {
  d.word(i.width);
  d.word(i.height);
  d.word(i.srgb);
  d.list(i.rgba, [&](std::uint8_t byte) { d.word(byte); });
}

void add(Digest& d, const Light& l) {
  d.word(std::uint64_t(l.kind));
  d.vector(l.position);
  d.vector(l.direction);
  d.vector(l.intensity);
  for (const float f : {l.range, l.inner_angle, l.outer_angle}) d.number(f);
}

void add(Digest& d, const Sky& s) {
  d.word(std::uint64_t(s.kind));
  for (const glm::vec3& c : {s.zenith, s.horizon, s.ground}) d.vector(c);
  d.word(s.width);
  d.word(s.height);
  d.list(s.map, [&](const glm::vec3& c) { d.vector(c); });
}

}  // namespace

std::uint64_t digest_of(const Scene& scene) {
  Digest d;
  d.corners(scene.triangles);
  d.corners(scene.normals);
  d.list(scene.material_of, [&](std::uint32_t m) { d.word(m); });
  d.list(scene.materials, [&](const Material& m) { add(d, m); });
  d.list(scene.textures, [&](const Texture& t) { add(d, t); });
  d.list(scene.images, [&](const TextureImage& i) { add(d, i); });
  for (const auto& set : scene.uvs)
    d.list(set, [&](const auto& t) {
      for (const glm::vec2& uv : t) d.number(uv.x), d.number(uv.y);
    });
  if (scene.instanced()) {  // meshes and names of flat scenes change no picture
    const TreeLayout layout = tree_layout(scene);
    d.list(layout.first, [&](std::size_t first) { d.word(first); });
    d.list(layout.placements, [&](const Placement& p) {
      d.word(p.mesh);
      for (const auto& row : p.transform.m)
        for (const float x : row) d.number(x);
    });
  }
  if (!scene.colors.empty())
    d.list(scene.colors, [&](const auto& t) {
      for (const glm::vec4& c : t) d.vector(glm::vec3(c)), d.number(c.a);
    });
  d.list(scene.lights, [&](const Light& l) { add(d, l); });
  add(d, scene.sky);
  return d.value();
}

}  // namespace ballot
