#version 460
// Writes the length of a buffer, in numbers, that the kernel sees.

layout(local_size_x = 1) in;
layout(set = 0, binding = 0, std430) readonly buffer Numbers { uint numbers[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Seen { uint seen; };

void main() { seen = uint(numbers.length()); }
