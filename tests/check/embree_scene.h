// An Embree scene of Ballot's triangles or shapes, to compare with. It is robust and of high build quality, which
// includes spatial splits.
#pragma once

#include <embree3/rtcore.h>

#include <cstring>
#include <span>
#include <vector>

#include "engine/model/scene.h"

namespace ballot {

class EmbreeScene {
 public:
  explicit EmbreeScene(const UnsetVector<Triangle>& triangles) {
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
    RTCGeometry g = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* v = rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, triangles.size() * 3);
    auto* i = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles.size()));
    std::memcpy(v, triangles.data(), triangles.size() * sizeof(Triangle));
    for (std::size_t k = 0; k < triangles.size() * 3; ++k) i[k] = unsigned(k);
    finish(g);
  }
  /// Spheres, discs as oriented ones, or capsules as round linear curves.
  EmbreeScene(ShapeKind kind, std::span<const Shape> shapes) {
    const bool curves = kind == ShapeKind::Capsules, discs = kind == ShapeKind::Discs;
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
    RTCGeometry g = rtcNewGeometry(device_, curves  ? RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE
                                            : discs ? RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT
                                                    : RTC_GEOMETRY_TYPE_SPHERE_POINT);
    const std::size_t ends = curves ? 2 : 1;
    auto* v = static_cast<glm::vec4*>(
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 16, ends * shapes.size()));
    for (std::size_t k = 0; k < shapes.size(); ++k) {
      v[ends * k] = shapes[k].a;
      if (curves) v[2 * k + 1] = shapes[k].b;
    }
    if (curves) {
      auto* i = static_cast<unsigned*>(
          rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT, 4, shapes.size()));
      for (std::size_t k = 0; k < shapes.size(); ++k) i[k] = unsigned(2 * k);
    }
    if (discs) {
      auto* n = static_cast<glm::vec3*>(
          rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_NORMAL, 0, RTC_FORMAT_FLOAT3, 12, shapes.size()));
      for (std::size_t k = 0; k < shapes.size(); ++k) n[k] = glm::vec3(shapes[k].b);
    }
    finish(g);
  }
  ~EmbreeScene() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

 private:
  void finish(RTCGeometry g) {
    rtcSetGeometryBuildQuality(g, RTC_BUILD_QUALITY_HIGH);
    rtcCommitGeometry(g);
    rtcAttachGeometry(scene_, g);
    rtcReleaseGeometry(g);
    rtcCommitScene(scene_);
  }

 protected:
  RTCDevice device_ = rtcNewDevice(nullptr);
  RTCScene scene_ = rtcNewScene(device_);
};

}  // namespace ballot
