#!/usr/bin/env python3
"""Makes scenes/meadow.gltf: thousands of plants of a few meshes, which nodes and EXT_mesh_gpu_instancing place, and
pinwheels that turn. Metres, +y up. Animation "wind" lasts 2 s and ends as it begins."""

import math
import os
import random

from gltf_writer import Mesh, run, unit
from make_dance import MovingScene, turn, without_slivers

SIDE = 9.0  # half the width of the meadow


def ground(x, z):
    """Returns the height of the ground."""
    return 0.35 * math.sin(0.55 * x + 0.4) * math.cos(0.5 * z) + 0.12 * math.sin(1.3 * z - 0.5 * x)


def blade(mesh, foot, lean, height, width, steps):
    """Adds a blade of grass, or a leaf: a strip that bends outwards and ends in a point."""
    side = unit((lean[1], 0, -lean[0]))
    rows = []
    for k in range(steps + 1):
        t = k / steps
        middle = (foot[0] + lean[0] * t * t, foot[1] + height * t * (1 - 0.25 * t), foot[2] + lean[1] * t * t)
        w = width * (1 - t) * (0.6 + t)
        along = unit((2 * t * lean[0], height * (1 - 0.5 * t), 2 * t * lean[1]))
        normal = unit((side[1] * along[2] - side[2] * along[1], side[2] * along[0] - side[0] * along[2],
                       side[0] * along[1] - side[1] * along[0]))
        rows.append([mesh.vertex(tuple(m + s * w * i for m, s in zip(middle, side)), normal) for i in (-1, 1)])
    for (a, b), (c, d) in zip(rows, rows[1:]):
        mesh.triangle(a, b, d)
        mesh.triangle(a, d, c)


def tuft(rng):
    mesh = Mesh()
    for _ in range(16):
        angle, reach = rng.uniform(0, 2 * math.pi), rng.uniform(0.03, 0.16)
        foot = (rng.uniform(-0.06, 0.06), 0, rng.uniform(-0.06, 0.06))
        blade(mesh, foot, (reach * math.cos(angle), reach * math.sin(angle)), rng.uniform(0.14, 0.3), 0.008, 4)
    return mesh


def flower():
    """Returns stalk and leaves, petals, and the middle of a flower."""
    green, petals, middle = Mesh(), Mesh(), Mesh()
    green.lathe((0, 0, 0), [(0.008 - 0.004 * k / 6, 0.42 * k / 6) for k in range(7)], 7)
    for k in range(5):
        angle = 2.4 * k
        blade(green, (0, 0.05 * k, 0), (0.13 * math.cos(angle), 0.13 * math.sin(angle)), 0.12, 0.02, 5)
    for k in range(13):
        angle, c = 2 * math.pi * k / 13, 0.016

        def point(u, v, a=angle):
            r, w = 0.02 + 0.085 * v, 0.045 * math.sin(math.pi * min(0.12 + 0.88 * v, 1)) * (u - 0.5)
            return (r * math.cos(a) - w * math.sin(a), 0.42 + c * math.sin(2.6 * v), r * math.sin(a) + w * math.cos(a))

        petals.grid(point, lambda u, v, a=angle: unit((-0.3 * v * math.cos(a), 1, -0.3 * v * math.sin(a))), 4, 6)
    middle.sphere((0, 0.424, 0), 0.026, 12, 8)
    return green, petals, middle


def tree(rng):
    trunk, leaves = Mesh(), Mesh()
    trunk.lathe((0, 0, 0), [(0.09 * (1 - 0.7 * k / 6) + 0.05 * (k == 0), 1.3 * k / 6) for k in range(7)], 9)
    for _ in range(230):
        out = unit(tuple(rng.gauss(0, 1) for _ in range(3)))
        far = rng.uniform(0.7, 1) ** 0.5
        at = (0.62 * out[0] * far, 1.55 + 0.55 * out[1] * far, 0.62 * out[2] * far)
        angle = rng.uniform(0, 2 * math.pi)
        blade(leaves, at, (0.16 * math.cos(angle), 0.16 * math.sin(angle)), rng.uniform(-0.1, 0.12), 0.06, 2)
    return trunk, leaves


def mushroom():
    stalk, cap = Mesh(), Mesh()
    stalk.lathe((0, 0, 0), [(0.022, 0), (0.015, 0.05), (0.014, 0.1)], 10)
    cap.lathe((0, 0.09, 0), [(0.0, -0.004), (0.06, 0.0), (0.052, 0.025), (0.03, 0.045), (0.0, 0.052)], 14)
    return stalk, cap


def pinwheel():
    wheel = Mesh()
    for k in range(6):
        a = math.pi * k / 3

        def point(u, v, a=a):
            r, w = 0.05 + 0.45 * v, (u - 0.3) * 0.22 * (0.4 + v)
            return (r * math.cos(a) - w * math.sin(a), r * math.sin(a) + w * math.cos(a), 0.1 * (u - 0.3))

        wheel.grid(point, lambda u, v: (0, 0, 1), 3, 6)
    wheel.sphere((0, 0, 0), 0.06, 16, 10)
    return wheel


class Meadow(MovingScene):
    """Places each mesh many times."""

    def triangle_count(self):
        if not self.built:
            return super().triangle_count()
        count = [sum(self.built["accessors"][p["indices"]]["count"] for p in mesh["primitives"]) // 3
                 for mesh in self.built["meshes"]]
        many = [node.get("extensions", {}).get("EXT_mesh_gpu_instancing", {}).get("attributes", {}).get("TRANSLATION")
                for node in self.built["nodes"]]
        return sum(count[node["mesh"]] * (1 if places is None else self.built["accessors"][places]["count"])
                   for node, places in zip(self.built["nodes"], many) if "mesh" in node)

    def joined(self, name, parts):
        """Adds a mesh of several primitives: (mesh, colour, options of its material). Returns its number."""
        primitives = []
        for k, (mesh, color, options) in enumerate(parts):
            without_slivers(mesh)
            primitives.append(self.mesh(f"{name}{k}", mesh, color, **options)[1])
            self.built["meshes"].pop()
        self.built["meshes"].append({"name": name, "primitives": primitives})
        return len(self.built["meshes"]) - 1

    def rotations(self, turns):
        """Adds an accessor of quaternions (x, y, z, w) as normalized bytes, which the reader brings to length 1."""
        made = self.accessor([round(c * 127) & 255 for q in turns for c in q], "VEC4", "B")
        self.built["accessors"][made].update(componentType=5120, normalized=True)
        return made

    def plant(self, name, mesh, places, rng, scales, lean):
        """Places a mesh upon the ground, in as many sizes as there are scales."""
        for k, scale in enumerate(scales):
            some = places[k::len(scales)]
            translations = [round(c / scale, 3) for x, z in some for c in (x, ground(x, z), z)]
            turns = []
            for _ in some:
                yaw, tip, way = rng.uniform(0, math.pi), rng.uniform(0, lean), rng.uniform(0, 2 * math.pi)
                s, c = math.sin(yaw), math.cos(yaw)
                turns.append((tip * math.cos(way), s, tip * math.sin(way), c))
            attributes = {"TRANSLATION": self.accessor(translations, "VEC3"), "ROTATION": self.rotations(turns)}
            self.node(f"{name}{k}", mesh=mesh, scale=[scale] * 3,
                      extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}})

    def add_pinwheels(self, mesh, pole):
        self.animation("wind")
        for k, (x, z) in enumerate(((-1.9, 1.5), (0.2, -0.4), (2.3, 1.1))):
            mirror = -1 if k == 1 else 1  # its mesh is the mirror image of the others', and turns the other way
            foot = self.node(f"pole{k}", mesh=pole, translation=[x, round(ground(x, z), 4), z])
            hub = self.node(f"hub{k}", foot, translation=[0, 1.25, 0.08], scale=[mirror, 1, 1])
            wheel = self.node(f"pinwheel{k}", hub, mesh=mesh)
            self.channel(wheel, "rotation", [0, 0.5, 1, 1.5, 2], [turn(2, 30 * k + a) for a in (0, 90, 180, 270, 360)])

    def add_motion(self):
        rng = random.Random(7)

        def places(count, half, least=0.0):
            at = ((rng.uniform(-half, half), rng.uniform(-half, half - 1)) for _ in range(100 * count))
            return [p for p in at if math.hypot(p[0], p[1] - 4) >= least][:count]

        self.built["extensionsUsed"] = sorted({*self.built["extensionsUsed"], "EXT_mesh_gpu_instancing"})
        green, petals, middle = flower()
        trunk, leaves = tree(rng)
        stalk, cap = mushroom()
        grass = self.joined("grass", [(tuft(rng), (0.2, 0.42, 0.08), {})])
        daisy = self.joined("daisy", [(green, (0.16, 0.38, 0.07), {}), (petals, (0.9, 0.88, 0.82), {}),
                                      (middle, (0.85, 0.55, 0.05), {})])
        birch = self.joined("birch", [(trunk, (0.42, 0.32, 0.24), {}), (leaves, (0.28, 0.44, 0.1), {})])
        shroom = self.joined("mushroom", [(stalk, (0.8, 0.75, 0.65), {}),
                                          (cap, (0.9, 0.3, 0.1), {"emissive": (1.0, 0.45, 0.12), "strength": 3.0})])
        wheel = self.joined("pinwheel", [(pinwheel(), (0.75, 0.1, 0.1), {"roughness": 0.4})])
        post = Mesh()
        post.lathe((0, -0.3, 0), [(0.025, 0), (0.025, 1.55)], 9)
        pole = self.joined("pole", [(post, (0.75, 0.72, 0.68), {})])
        self.plant("grass", grass, places(2600, SIDE), rng, (0.9, 1.1, 1.4), 0.12)
        self.plant("daisy", daisy, places(720, 0.75 * SIDE, 0.5), rng, (0.7, 0.9, 1.1), 0.1)
        self.plant("birch", birch, places(60, SIDE, 4.5), rng, (1.0, 1.3), 0.03)
        self.plant("mushroom", shroom, places(40, 0.5 * SIDE), rng, (1.0, 1.5), 0.06)
        # A birch that leans, by a matrix that shears it.
        foot = (-3.2, ground(-3.2, -0.5), -0.5)
        self.node("sheared", mesh=birch, matrix=[1, 0, 0, 0, 0.35, 1, 0.1, 0, 0, 0, 1, 0, *foot, 1])
        self.add_pinwheels(wheel, pole)


def make():
    scene = Meadow()
    soil = scene.add_material("soil", (0.23, 0.19, 0.11))

    def point(u, v):
        x, z = SIDE * (2 * u - 1), SIDE * (2 * v - 1)
        return (round(x, 4), round(ground(x, z), 4), round(z, 4))

    def normal(u, v):
        x, z, d = SIDE * (2 * u - 1), SIDE * (2 * v - 1), 1e-3
        return unit(((ground(x - d, z) - ground(x + d, z)) / d, 2, (ground(x, z - d) - ground(x, z + d)) / d))

    soil.grid(point, normal, 24, 24)
    scene.add_view((0, 1.35, 6.8), (0, 0.75, 0), 50)
    scene.add_view((0.3, 0.62, 4.3), (0.1, 0.36, 2.6), 45)
    scene.add_sun((-0.5, -0.8, -0.45), (1.0, 0.95, 0.85), 2.6)
    return scene


if __name__ == "__main__":
    run(make, __doc__, os.path.join(os.path.dirname(os.path.abspath(__file__)), "meadow.gltf"))
