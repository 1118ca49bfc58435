// Camera rays.
//
//   pixel (0, 0) is top left:      corner --- step_x -->          the camera looks along -z of its frame, +y is up,
//                                    |                            right-handed; a ray goes through
//                                  step_y                         corner + x * step_x + y * step_y
//                                    v

#if !defined(BALLOT_PERSPECTIVE) || !defined(BALLOT_ORTHOGRAPHIC)
#error a variant must give BALLOT_PERSPECTIVE and BALLOT_ORTHOGRAPHIC: engine/render/data/camera.cpp
#elif !BALLOT_PERSPECTIVE && !BALLOT_ORTHOGRAPHIC
#error a variant must have a kind of camera
#endif

const float CAMERA_T_MAX = 1e30;

// Returns the camera ray of a sample of a pixel; a dead ray outside the picture. `number` stands for the pixel in the
// random numbers. A single sample goes through the pixel's centre.
Ray camera_ray(PrimaryPush camera, uvec2 pixel, uint number, uint sample_index) {
  vec2 offset = vec2(0.5);
  if (camera.sample_count > 1u) offset = sample_pair(number, sample_index, 0u);
  precise vec2 at = vec2(pixel) + offset;
  precise vec3 plane = camera.corner + at.x * camera.step_x + at.y * camera.step_y;
  bool inside = pixel.x < camera.width && pixel.y < camera.height;
  float t_max = inside ? CAMERA_T_MAX : 0.0;
#if BALLOT_PERSPECTIVE && BALLOT_ORTHOGRAPHIC
  if (camera.orthographic != 0u) return Ray(plane, 0.0, camera.origin, t_max);
#endif
#if BALLOT_PERSPECTIVE
  return Ray(camera.origin, 0.0, plane, t_max);
#else
  return Ray(plane, 0.0, camera.origin, t_max);
#endif
}
