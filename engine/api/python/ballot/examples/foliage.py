"""Lidar through foliage: how far each pulse comes, and the share of it that leaves let pass on the way.

>>> scene, first_leaf = wood()
>>> ranges, passed = scan(scene, first_leaf, sensor=(0, 0, 25), through=0.5)
>>> ranges.shape, bool((passed > 0).all() and (passed <= 1).all())
((64, 64), True)
>>> clear, _ = scan(scene, first_leaf, sensor=(0, 0, 25), through=1.0)  # the ground is where it was
>>> bool((clear == ranges).all()), bool((passed < 1).mean() > 0.1)
(True, True)
"""

from __future__ import annotations

import numpy as np

import ballot
from ballot.examples._ground import ground

GLSL = """
readonly buffer Pulses { vec3 pulses[]; };  // directions
buffer Ranges { float ranges[]; };
buffer Passed { float passed[]; };
uniform vec3 sensor;
uniform uint first_leaf;
uniform float through;  // the share of a pulse that passes a leaf

bool counts_leaves;
bool accept(Hit hit) { return hit.prim >= first_leaf == counts_leaves; }

void main(uint index) {
  Ray pulse = Ray(sensor, 0.0, pulses[index], 1e9);
  counts_leaves = false;
  Hit solid = nearest(pulse);
  ranges[index] = solid.t;
  pulse.t_max = solid.prim == NO_HIT ? pulse.t_max : solid.t;
  counts_leaves = true;
  passed[index] = pow(through, float(count(pulse)));  // each leaf once, whatever the order of the walk
}
"""


def wood(leaves: int = 20000, seed: int = 1) -> tuple[ballot.Scene, int]:
    """Returns ground with a crown of leaves above it, and the number of the first leaf."""
    random = np.random.default_rng(seed)
    middle = random.normal(size=(leaves, 1, 3)) * (3.0, 3.0, 1.5) + (0, 0, 12)
    corners = (middle + random.normal(0, 0.1, (leaves, 3, 3))).astype(np.float32)
    vertices, triangles = ground()
    scene = ballot.Scene(meshes=[(vertices, triangles), (corners.reshape(-1, 3), np.arange(3 * leaves).reshape(-1, 3))])
    return scene, len(triangles)


def scan(
    scene: ballot.Scene, first_leaf: int, sensor: tuple[float, float, float], through: float, width: int = 64
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the ranges to what is solid and the shares that pass, (width, width) float32, of pulses downwards."""
    slope = np.linspace(-0.6, 0.6, width, dtype=np.float32)
    x, y = np.meshgrid(slope, slope)
    pulses = np.stack([x, y, np.full_like(x, -1)], axis=-1)
    pulses /= np.linalg.norm(pulses, axis=-1, keepdims=True)
    ranges, passed = np.zeros((2, width, width), np.float32)
    kernel = ballot.Kernel(GLSL, name="foliage")
    buffers = {"pulses": pulses, "ranges": ranges, "passed": passed}
    kernel(scene, width * width, buffers, sensor=sensor, first_leaf=first_leaf, through=through)
    return ranges, passed


if __name__ == "__main__":
    _, share = scan(*wood(), sensor=(0, 0, 25), through=0.5)
    print(f"{(share < 1).mean():.1%} of {share.size} pulses meet leaves, and {share.mean():.1%} of the light passes")
