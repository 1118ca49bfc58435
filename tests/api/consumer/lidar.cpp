// A program of somebody else in C++: a simulator's plug-in of a lidar. The simulator moves its bodies and tells where
// the sensor is; the plug-in answers with a point cloud, whose layout is that of ROS's sensor_msgs/PointCloud2.
#include <ballot/ballot.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <numbers>

namespace {

struct PointField {
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = 0;  // 4: uint16, 6: uint32, 7: float32
  std::uint32_t count = 1;
};
struct PointCloud {
  std::uint32_t height = 1, width = 0;
  std::vector<PointField> fields;
  bool is_bigendian = false;
  std::uint32_t point_step = 0, row_step = 0;
  std::vector<std::uint8_t> data;
  bool is_dense = true;
};
struct Point {
  float x, y, z, intensity, time;
  std::uint32_t id;
  std::uint16_t ring, return_number;
};

class Lidar {
 public:
  struct Options {
    int rings = 16, columns = 720;
    float lowest = -0.26f, highest = 0.26f, period = 0.1f, near = 0.1f, far = 100;
    std::uint32_t returns = 2;
  };

  explicit Lidar(const Options& options) : options_(options) {
    for (int ring = 0; ring < options.rings; ++ring)
      for (int column = 0; column < options.columns; ++column) {
        const float up = std::lerp(options.lowest, options.highest, float(ring) / float(options.rings - 1));
        const float around = 2 * std::numbers::pi_v<float> * float(column) / float(options.columns);
        directions_.insert(directions_.end(),
                           {std::cos(up) * std::cos(around), std::cos(up) * std::sin(around), std::sin(up)});
      }
  }

  // Scans from a pose, a 3 x 4 matrix by rows. Points are in the sensor's frame.
  PointCloud scan(const ballot::Scene& scene, std::span<const float> pose) {
    const std::size_t beams = directions_.size() / 3, each = options_.returns, all = beams * each;
    std::vector<float> t(all), normals(3 * all);
    std::vector<std::uint32_t> ids(all);
    ballot::RayView rays = ballot::from_poses(directions_, pose);
    rays.t_min = options_.near, rays.t_max = options_.far;
    scene.trace(rays, {.t = t.data(), .mesh_ids = ids.data(), .normals = normals.data()}, {.first = options_.returns});
    std::vector<Point> points;
    for (std::size_t i = 0; i < all; ++i) {
      if (!std::isfinite(t[i])) continue;
      const std::size_t beam = i / each, columns = std::size_t(options_.columns);
      const float* d = &directions_[3 * beam];
      float cosine = 0;  // intensity is that of the angle between beam and surface
      for (std::size_t k = 0; k < 3; ++k)
        cosine += normals[3 * i + k] * (pose[4 * k] * d[0] + pose[4 * k + 1] * d[1] + pose[4 * k + 2] * d[2]);
      points.push_back({t[i] * d[0], t[i] * d[1], t[i] * d[2], std::abs(cosine),
                        options_.period * float(beam % columns) / float(columns), ids[i], std::uint16_t(beam / columns),
                        std::uint16_t(i % each + 1)});
    }
    return packed(points);
  }

 private:
  static PointCloud packed(std::span<const Point> points) {
    PointCloud cloud;
    cloud.width = std::uint32_t(points.size()), cloud.point_step = sizeof(Point);
    cloud.row_step = cloud.width * cloud.point_step;
    cloud.fields = {{"x", 0, 7},     {"y", 4, 7},   {"z", 8, 7},     {"intensity", 12, 7},
                    {"time", 16, 7}, {"id", 20, 6}, {"ring", 24, 4}, {"return_number", 26, 4}};
    cloud.data.resize(cloud.row_step);
    if (!points.empty()) std::memcpy(cloud.data.data(), points.data(), points.size_bytes());
    return cloud;
  }

  Options options_;
  std::vector<float> directions_;
};

}  // namespace

int main() {
  try {
    const ballot::Device device;
    const std::vector<float> wall{0, -9, -9, 0, 9, -9, 0, 9, 9, 0, -9, 9};
    const std::vector<std::uint32_t> triangles{0, 1, 2, 0, 2, 3};
    ballot::Mesh mesh = ballot::mesh(wall, triangles);
    mesh.id = 5;
    const std::vector<float> places{1, 0, 0, 4, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 6, 0, 1, 0, 0, 0, 0, 1, 0};
    ballot::Scene scene(device, {mesh}, ballot::instances(places, std::vector<std::uint32_t>{0, 0}));
    Lidar lidar({});
    std::vector<float> pose{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    for (int step = 0; step < 3; ++step, pose[3] += 1) {  // the sensor drives towards the walls
      const PointCloud cloud = lidar.scan(scene, pose);
      std::vector<Point> points(cloud.width);
      if (!points.empty()) std::memcpy(points.data(), cloud.data.data(), cloud.data.size());
      std::printf("%u points from %g\n", cloud.width, double(pose[3]));
      if (points.empty()) return 1;
      for (const Point& point : points)
        if (std::abs(point.x + pose[3] - (point.return_number == 1 ? 4.f : 6.f)) > 1e-4f || point.id != 5) return 2;
    }
  } catch (const ballot::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 3;
  }
  return 0;
}
