// A program with Vulkan of its own: its compute pass draws a scene with shadows, by rays that Ballot's text walks.
//
//   consumer_foreign [PICTURE.ppm]
#include <ballot/ballot_vulkan.h>

#include <cmath>
#include <cstdio>

#include "own_vulkan.h"

namespace {

constexpr std::uint32_t kWidth = 640, kHeight = 360;

struct Pixel {  // as the shader writes it
  ballot::Ray ray;
  ballot::Hit hit;
  float color[3];
};
struct Look {  // its push constants
  float eye[3], sun[3];
  std::uint32_t width, height;
};

constexpr const char* kShader = R"(
layout(local_size_x = 8, local_size_y = 8) in;
struct Pixel { Ray ray; Hit hit; vec3 color; };
layout(set = 0, binding = 0, scalar) writeonly buffer Picture { Pixel pixels[]; };
layout(push_constant, scalar) uniform Look { vec3 eye, sun; uint width, height; };

vec3 color_at(Ray ray, Hit hit) {
  if (hit.prim == NO_HIT) return mix(vec3(0.9, 0.93, 1.0), vec3(0.3, 0.5, 0.9), clamp(2.0 * ray.dir.z, 0.0, 1.0));
  vec3 a = corner(hit.prim, 0u), normal = normalize(cross(corner(hit.prim, 1u) - a, corner(hit.prim, 2u) - a));
  normal = faceforward(normal, ray.dir, normal);
  vec3 at = ray.origin + hit.t * ray.dir;
  bool lit = dot(normal, sun) > 0.0 && !any(Ray(at + 1e-4 * normal, 0.0, sun, 1e30));
  uint instance = place(hit.prim).x;
  vec3 paint = instance == 0u ? vec3(0.75) : 0.5 + 0.4 * cos(vec3(0.0, 2.1, 4.2) + 1.7 * float(instance));
  return paint * (0.25 + (lit ? 0.75 * dot(normal, sun) : 0.0));
}

void main() {
  uvec2 at = gl_GlobalInvocationID.xy;
  if (at.x >= width || at.y >= height) return;
  vec2 film = (vec2(at) + 0.5 - 0.5 * vec2(width, height)) / float(height);
  vec3 ahead = normalize(vec3(0.0, 0.0, 0.9) - eye), right = normalize(cross(ahead, vec3(0.0, 0.0, 1.0)));
  Ray ray = Ray(eye, 0.0, normalize(1.6 * ahead + film.x * right - film.y * cross(right, ahead)), 1e30);
  Hit hit = nearest(ray);
  pixels[at.y * width + at.x] = Pixel(ray, hit, color_at(ray, hit));
}
)";

/// A ring about z, of squares.
std::vector<float> ring(int around, int across) {
  std::vector<float> corners;
  const auto add = [&](int i, int k) {
    const double a = 2 * M_PI * i / around, b = 2 * M_PI * k / across, r = 1 + 0.35 * std::cos(b);
    for (const double x : {r * std::cos(a), r * std::sin(a), 0.35 * std::sin(b)}) corners.push_back(float(x));
  };
  for (int i = 0; i < around; ++i)
    for (int k = 0; k < across; ++k)
      for (const auto& [di, dk] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}}) add(i + di, k + dk);
  return corners;
}

void write(const char* name, const Pixel* pixels) {
  std::ofstream out(name, std::ios::binary);
  out << "P6 " << kWidth << " " << kHeight << " 255\n";
  for (const Pixel* p = pixels; p < pixels + kWidth * kHeight; ++p)
    for (const float c : p->color) out.put(char(255.0f * std::sqrt(std::min(c, 1.0f)) + 0.5f));
}

int draw(const char* picture) {
  const OwnVulkan own;
  const ballot::Device device(ballot::Vulkan{.instance = *own.instance,
                                             .physical_device = *own.physical,
                                             .device = *own.device,
                                             .queue = *own.queue,
                                             .queue_family = own.family});
  const std::vector<float> ground{-9, -9, 0, 9, -9, 0, 9, 9, 0, -9, -9, 0, 9, 9, 0, -9, 9, 0}, torus = ring(64, 32);
  const std::vector<float> places{1, 0,    0, 0,     0, 1, 0,    0,     0,    0, 1, 0,      // the ground
                                  1, 0,    0, 0,     0, 1, 0,    0,     0,    0, 1, 0.35f,  // rings: one lies,
                                  1, 0,    0, 0,     0, 0, -1,   0.6f,  0,    1, 0, 1.4f,   // one stands in it,
                                  0, 0.5f, 0, -2.1f, 0, 0, 0.5f, -0.8f, 0.5f, 0, 0, 0.7f};  // a small one beside
  const ballot::Scene scene(device, {ballot::mesh(ground), ballot::mesh(torus)},
                            ballot::instances(places, std::vector<std::uint32_t>{0, 1, 1, 1}));
  const ballot::Include calls = ballot::shader_include(scene, {.calls = "nearest any corner place", .set = 1});
  const OwnBuffer pixels(own, kWidth * kHeight * sizeof(Pixel));
  const OwnPass pass(own, pixels, VkDescriptorSetLayout(calls.set_layout), sizeof(Look),
                     std::string("#version 460\n") + calls.text + kShader);
  const Look look{{1.7f, -6.3f, 2.9f}, {-0.48f, -0.36f, 0.8f}, kWidth, kHeight};
  pass.run(pixels, VkDescriptorSet(calls.set), look, (kWidth + 7) / 8, (kHeight + 7) / 8);
  const auto* found = static_cast<const Pixel*>(pixels.mapped);
  write(picture, found);
  std::vector<ballot::Ray> rays;
  for (const Pixel* p = found; p < found + kWidth * kHeight; ++p) rays.push_back(p->ray);
  std::vector<ballot::Hit> hits(rays.size());
  const std::uint64_t met = scene.trace(rays, hits).hits;
  for (std::size_t i = 0; i < hits.size(); ++i)
    if (std::memcmp(&hits[i], &found[i].hit, sizeof hits[i]) != 0) throw std::runtime_error("Ballot finds other hits");
  std::printf("%s: %llu of %zu rays hit\n", picture, static_cast<unsigned long long>(met), rays.size());
  return met > rays.size() / 2 ? 0 : 1;
}

}  // namespace

int main(int count, char** arguments) {
  try {
    return draw(count > 1 ? arguments[1] : "foreign.ppm");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
