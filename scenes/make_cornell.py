#!/usr/bin/env python3
"""Makes scenes/cornell.gltf: a Cornell box with a mirror sphere and a glass sphere. Metres, +y up, the box 2 m wide."""

import math
import os

from gltf_writer import Scene, run


def turned_box(mesh, centre, half, height, angle):
    """Adds an upright block that is turned about the y axis."""
    c, s = math.cos(angle), math.sin(angle)

    def at(x, y, z):
        return (centre[0] + c * x * half[0] + s * z * half[1], y, centre[1] - s * x * half[0] + c * z * half[1])

    corners = [(-1, 1), (1, 1), (1, -1), (-1, -1)]
    for k in range(4):
        (x, z), (u, w) = corners[k], corners[(k + 1) % 4]
        mesh.quad(at(x, 0, z), at(u, 0, w), at(u, height, w), at(x, height, z))
    mesh.quad(*(at(x, height, z) for x, z in corners))


def make():
    scene = Scene()
    white = scene.add_material("white", (0.73, 0.73, 0.73))
    red = scene.add_material("red", (0.63, 0.06, 0.05))
    green = scene.add_material("green", (0.12, 0.45, 0.09))
    block = scene.add_material("block", (0.68, 0.6, 0.48), roughness=0.6)
    light = scene.add_material("light", (0.78, 0.78, 0.78), emissive=(1.0, 0.82, 0.58), strength=17.0)
    mirror = scene.add_material("mirror", (0.95, 0.95, 0.97), metallic=1.0, roughness=0.0)
    glass = scene.add_material("glass", (1.0, 1.0, 1.0), roughness=0.0, transmission=1.0, ior=1.5)

    white.quad((-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1))  # floor
    white.quad((-1, 2, -1), (1, 2, -1), (1, 2, 1), (-1, 2, 1))  # ceiling
    white.quad((-1, 0, -1), (1, 0, -1), (1, 2, -1), (-1, 2, -1))  # back
    red.quad((-1, 0, 1), (-1, 0, -1), (-1, 2, -1), (-1, 2, 1))
    green.quad((1, 0, -1), (1, 0, 1), (1, 2, 1), (1, 2, -1))
    light.quad((-0.3, 1.99, -0.35), (0.3, 1.99, -0.35), (0.3, 1.99, 0.15), (-0.3, 1.99, 0.15))
    turned_box(block, (-0.38, -0.42), (0.3, 0.3), 0.6, 0.3)
    mirror.sphere((-0.38, 0.98, -0.42), 0.38, 48, 24)
    glass.sphere((0.42, 0.36, 0.28), 0.36, 48, 24)

    scene.add_view((0, 1, 3.7), (0, 0.98, 0), 40)
    scene.add_view((-0.85, 1.7, 0.95), (0.25, 0.35, -0.25), 70)
    scene.add_view((0.9, 1.35, 0.98), (-0.35, 0.62, -0.4), 65)
    scene.add_view((0.42, 0.5, 1.5), (0.4, 0.4, 0), 50)
    scene.add_view((-0.1, 1.8, 1.7), (0.02, 0.45, -0.15), 60)
    return scene


if __name__ == "__main__":
    run(make, __doc__, os.path.join(os.path.dirname(os.path.abspath(__file__)), "cornell.gltf"))
