// The BSDF of a surface: Lambert's law; with BALLOT_HAS_GLOSS also metals and dielectrics with GGX microfacets; with
// BALLOT_HAS_GLASS also refracting dielectrics.
//
// The model is glTF 2.0's metallic-roughness (appendix B), with the exact Fresnel equations for dielectrics in place of
// Schlick's. Microfacets: Walter et al., Microfacet Models for Refraction through Rough Surfaces, EGSR 2007; visible
// normals: Dupuy, Benyoub, Sampling Visible GGX Normals with Spherical Caps, HPG 2023. The throughput is of radiance
// over squared index, which a refraction does not change (Veach 1997, section 5.2).

#include "hemisphere.glsl"

// The BSDF at a hit. `eta` is the index of refraction on the ray's side over the index behind the surface.
struct Bsdf {
  vec3 n;
  vec3 to_eye;
  vec3 base;
  float metallic, alpha, transmission, eta;
  bool lambert, mirror;
  float p_mirrored, p_refracted;  // probabilities of the lobes; the rest is diffuse
};

#if BALLOT_HAS_GLOSS
// Returns the Fresnel reflectance of a dielectric for unpolarised light; 1 at total reflection.
float fresnel(float cosine, float eta) {
  float c = clamp(abs(cosine), 0.0, 1.0), s2 = eta * eta * (1.0 - c * c);
  if (s2 >= 1.0) return 1.0;
  float t = sqrt(1.0 - s2);
  float across = (eta * c - t) / (eta * c + t), along = (c - eta * t) / (c + eta * t);
  return 0.5 * (across * across + along * along);
}

vec3 fresnel_of(Bsdf b, float cosine) {
  float c = clamp(1.0 - abs(cosine), 0.0, 1.0), c2 = c * c;
  vec3 metal = b.base + (1.0 - b.base) * (c2 * c2 * c);
  return mix(vec3(fresnel(cosine, b.eta)), metal, b.metallic);
}

// The GGX distribution of facet normals, and its Smith masking.
float facets(Bsdf b, float cosine) {
  float a2 = b.alpha * b.alpha, d = cosine * cosine * (a2 - 1.0) + 1.0;
  return a2 / (PI * d * d);
}
float smith(Bsdf b, float cosine) {
  float a2 = b.alpha * b.alpha, c = abs(cosine);
  return 2.0 * c / (c + sqrt(a2 + (1.0 - a2) * c * c));
}

// Samples the normal of a facet that is visible from to_eye.
vec3 sample_facet(Bsdf b, vec2 r) {
  vec3 x, y;
  basis_of(b.n, x, y);
  vec3 v = normalize(vec3(b.alpha * dot(b.to_eye, x), b.alpha * dot(b.to_eye, y), dot(b.to_eye, b.n)));
  float z = (1.0 - r.x) * (1.0 + v.z) - v.z, across = sqrt(clamp(1.0 - z * z, 0.0, 1.0)), phi = 2.0 * PI * r.y;
  vec3 h = vec3(across * cos(phi), across * sin(phi), z) + v;
  return normalize(x * (b.alpha * h.x) + y * (b.alpha * h.y) + b.n * max(h.z, 1e-6));
}
#endif

#if BALLOT_HAS_GLOSS && (BALLOT_HAS_NORMALS || BALLOT_HAS_NORMAL_TEXTURE)
// Returns the shading normal n, turned so far that the mirrored ray does not go into the surface. `flat_n` is the
// surface's geometric normal. This lets the rims of smooth bodies reflect (Keller et al., The Iray Light Transport
// Simulation and Rendering System, 2017).
vec3 turned(vec3 n, vec3 dir, vec3 flat_n) {
  vec3 to = reflect(dir, n);
  float over = dot(to, flat_n);
  if (over >= 0.0) return n;
  return normalize(normalize(to + flat_n * (0.01 - over)) - dir);
}
#endif

Bsdf bsdf_of(Look look, vec3 dir, vec3 flat_n, bool front) {
  Bsdf b;
  b.n = look.normal;
  b.to_eye = -dir;
  b.base = look.m.base_color;
  b.lambert = true;
  b.mirror = false;
  b.p_mirrored = 0.0;
  b.p_refracted = 0.0;
#if BALLOT_HAS_GLOSS
  b.lambert = (look.m.flags & MATERIAL_LAMBERT) != 0u;
  if (b.lambert) return b;
#if BALLOT_HAS_NORMALS || BALLOT_HAS_NORMAL_TEXTURE
  b.n = turned(b.n, dir, flat_n);
#endif
  b.metallic = clamp(look.m.metallic, 0.0, 1.0);
  b.mirror = look.m.roughness < MIRROR_ROUGHNESS;
  b.alpha = max(look.m.roughness * look.m.roughness, 1e-3);
  b.transmission = 0.0;
  b.eta = 1.0 / look.m.ior;  // no ray is inside a body that transmits nothing
#if BALLOT_HAS_GLASS
  b.transmission = look.m.transmission;
  if (b.transmission > 0.0 && !front) b.eta = look.m.ior;
#endif
  vec3 f = fresnel_of(b, dot(b.n, b.to_eye));
  float mirrored = luminance(f), rest = luminance((1.0 - f) * b.base) * (1.0 - b.metallic);
  float refracted = luminance(1.0 - f) * (1.0 - b.metallic) * b.transmission;
  float sum = mirrored + refracted + rest * (1.0 - b.transmission);
  if (sum > 0.0) {
    b.p_mirrored = mirrored / sum;
    b.p_refracted = refracted / sum;
  }
#endif
  return b;
}

// Returns the BSDF for the unit direction `to`, times the cosine, without perfectly specular lobes. `density` is the
// density with which sample_bsdf chooses the direction.
vec3 eval_bsdf(Bsdf b, vec3 to, out float density) {
  float c = dot(b.n, to);
  density = 0.0;
  if (c <= 0.0) return vec3(0.0);
#if BALLOT_HAS_GLOSS
  if (!b.lambert) {
    float p_diffuse = max(1.0 - b.p_mirrored - b.p_refracted, 0.0);
    vec3 h = normalize(b.to_eye + to);
    float h_eye = abs(dot(h, b.to_eye)), n_eye = max(dot(b.n, b.to_eye), 1e-4);
    vec3 f = fresnel_of(b, h_eye);
    vec3 value = (1.0 - f) * b.base * ((1.0 - b.metallic) * (1.0 - b.transmission) * c / PI);
    density = p_diffuse * c / PI;
    if (!b.mirror) {
      float d = facets(b, dot(b.n, h)), g_eye = smith(b, n_eye);
      value += f * (d * g_eye * smith(b, c) / (4.0 * n_eye));
      density += b.p_mirrored * d * g_eye / (4.0 * n_eye);
    }
    return value;
  }
#endif
  density = c / PI;
  return b.base * (c / PI);
}

#if BALLOT_HAS_GLASS
// Returns the direction refracted through a facet h; zero at total reflection.
vec3 refracted(Bsdf b, vec3 h) { return refract(-b.to_eye, h, b.eta); }
#endif

// Samples a direction. `weight` is the BSDF times the cosine over the density, `density` the density by solid angle, or
// 0 if light sampling cannot find the direction. `side` is -1 behind the surface and 1 otherwise.
vec3 sample_bsdf(Bsdf b, float lobe, vec2 r, out vec3 weight, out float density, out float side) {
  side = 1.0;
#if BALLOT_HAS_GLOSS
  if (!b.lambert && lobe < b.p_mirrored + b.p_refracted) {
    vec3 h = b.mirror ? b.n : sample_facet(b, r);
    float h_eye = dot(h, b.to_eye);
#if BALLOT_HAS_GLASS
    if (lobe >= b.p_mirrored) {
      side = -1.0;
      density = 0.0;
      vec3 to = refracted(b, h);
      weight = (1.0 - fresnel_of(b, h_eye)) * b.base * ((1.0 - b.metallic) * b.transmission / b.p_refracted);
      if (!b.mirror) weight *= smith(b, dot(b.n, to));
      if (dot(to, to) < 0.5 || dot(b.n, to) >= 0.0) weight = vec3(0.0);
      return dot(to, to) < 0.5 ? b.n : normalize(to);
    }
#endif
    vec3 to = normalize(reflect(-b.to_eye, h));
    if (b.mirror) {
      density = 0.0;
      weight = fresnel_of(b, h_eye) / b.p_mirrored;
      if (dot(b.n, to) <= 0.0) weight = vec3(0.0);
      return to;
    }
    weight = eval_bsdf(b, to, density);
    weight = density > 0.0 ? weight / density : vec3(0.0);
    return to;
  }
#endif
  vec3 to = cosine_about(b.n, r);
  weight = eval_bsdf(b, to, density);
  weight = density > 0.0 ? weight / density : vec3(0.0);
  return to;
}
