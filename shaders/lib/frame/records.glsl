// Buffers of rays, hits and path state that are read and written in units of 16 bytes. A compiler moves each scalar of
// a scalar record by itself, and every such access touches as many sectors of memory as the whole record.
//
//   RECORDS_IN(binding, Block, name)     a buffer that is read
//   RECORDS_OUT(binding, Block, name)    a buffer that is written
//   RECORDS_INOUT(binding, Block, name)  a buffer that is read and written
//   get_ray(name, i), get_hit, get_carried, get_shadow_payload, get_path -> record
//   put_record(name, i, record)          writes a record of 32 bytes: Ray, Carried
//   put_part(name, i, record)            writes a record of 16 bytes: Hit, ShadowPayload, Path
//
// With BALLOT_TEXEL_RECORDS (CPU devices: engine/gpu/pipeline.cpp) a buffer that is only read is a texel buffer,
// because lavapipe reads storage buffers lane by lane and word by word.
#ifndef BALLOT_TEXEL_RECORDS
#define BALLOT_TEXEL_RECORDS 0  // compiled without a device
#endif
#if BALLOT_TEXEL_RECORDS
#define RECORDS_IN(bound, Block, name)                          \
  layout(set = 0, binding = bound) uniform usamplerBuffer name; \
  uvec4 name##_part(uint i) { return texelFetch(name, int(i)); }
#else
#define RECORDS_IN(bound, Block, name)                                               \
  layout(set = 0, binding = bound, std430) readonly buffer Block { uvec4 name[]; };  \
  uvec4 name##_part(uint i) { return name[i]; }
#endif
#define RECORDS_OUT(bound, Block, name) \
  layout(set = 0, binding = bound, std430) writeonly buffer Block { uvec4 name[]; };
#define RECORDS_INOUT(bound, Block, name)                                  \
  layout(set = 0, binding = bound, std430) buffer Block { uvec4 name[]; }; \
  uvec4 name##_part(uint i) { return name[i]; }

uvec4 part_of(vec3 v, uint w) { return uvec4(floatBitsToUint(v), w); }
uvec4 part_of(vec3 v, float w) { return floatBitsToUint(vec4(v, w)); }

uvec4 first_part(Ray r) { return part_of(r.origin, r.t_min); }
uvec4 second_part(Ray r) { return part_of(r.dir, r.t_max); }
uvec4 first_part(Hit h) { return uvec4(floatBitsToUint(h.t), h.prim, floatBitsToUint(vec2(h.u, h.v))); }
uvec4 first_part(ShadowPayload a) { return part_of(a.radiance, a.path); }
uvec4 first_part(Path p) { return part_of(p.radiance, p.hit); }
uvec4 first_part(Carried c) { return part_of(c.throughput, c.path); }
uvec4 second_part(Carried c) { return part_of(vec3(c.pdf, c.width, c.spread), 0u); }

Ray ray_of(uvec4 a, uvec4 b) {
  vec4 first = uintBitsToFloat(a), second = uintBitsToFloat(b);
  return Ray(first.xyz, first.w, second.xyz, second.w);
}
Hit hit_of(uvec4 a) { return Hit(uintBitsToFloat(a.x), a.y, uintBitsToFloat(a.z), uintBitsToFloat(a.w)); }
ShadowPayload shadow_payload_of(uvec4 a) { return ShadowPayload(uintBitsToFloat(a.xyz), a.w); }
Carried carried_of(uvec4 a, uvec4 b) {
  vec3 cone = uintBitsToFloat(b.xyz);
  return Carried(uintBitsToFloat(a.xyz), a.w, cone.x, cone.y, cone.z, 0u);
}
Path path_of(uvec4 a) { return Path(uintBitsToFloat(a.xyz), a.w); }

#define get_ray(name, i) ray_of(name##_part(2u * (i)), name##_part(2u * (i) + 1u))
#define get_hit(name, i) hit_of(name##_part(i))
#define get_shadow_payload(name, i) shadow_payload_of(name##_part(i))
#define get_carried(name, i) carried_of(name##_part(2u * (i)), name##_part(2u * (i) + 1u))
#define get_path(name, i) path_of(name##_part(i))
#define put_part(name, i, record) name[i] = first_part(record)
#define put_record(name, i, record) name[2u * (i)] = first_part(record), name[2u * (i) + 1u] = second_part(record)
