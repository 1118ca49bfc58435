// An Embree scene of Ballot's triangles, to compare with. It is robust and of high build quality, which includes
// spatial splits.
#pragma once

#include <embree3/rtcore.h>

#include <cstring>
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
    rtcSetGeometryBuildQuality(g, RTC_BUILD_QUALITY_HIGH);
    rtcCommitGeometry(g);
    rtcAttachGeometry(scene_, g);
    rtcReleaseGeometry(g);
    rtcCommitScene(scene_);
  }
  ~EmbreeScene() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

 protected:
  RTCDevice device_ = rtcNewDevice(nullptr);
  RTCScene scene_ = rtcNewScene(device_);
};

}  // namespace ballot
