// Converts a linear colour to a window pixel, with blue in the lowest byte.

float srgb_of(float x) {
  x = clamp(x, 0.0, 1.0);
  return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1.0 / 2.4) - 0.055;
}

uint pixel_word(vec3 linear) {
  vec3 color = vec3(srgb_of(linear.r), srgb_of(linear.g), srgb_of(linear.b));
  return packUnorm4x8(vec4(color.bgr, 1.0));
}
