#!/usr/bin/env python3
"""Makes scenes of any number of triangles that move, as .glb, for `ballot bench --frames`.

grid   A height field whose waves travel: two morph targets, weighed by a cosine and a sine; "waves" takes 4 s.
tube   A tube that sways: a skin of 24 joints, four weights a vertex; "sway" takes 4 s.

Every vertex has a normal."""

import argparse
import array
import json
import math
import struct

SECONDS, FRAMES = 4.0, 64  # of both animations; keys of each
FLOAT, UINT, USHORT = 5126, 5125, 5123
WIDTH = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Document:
    """A glTF file in the making: its bytes, and the objects that name them."""

    def __init__(self):
        self.data, self.views, self.accessors = bytearray(), [], []
        self.json = {"asset": {"version": "2.0", "generator": "Ballot, moving_scene.py"}, "scene": 0}

    def add(self, values, kind, component=FLOAT, bounds=False):
        """Adds an accessor. Returns its number."""
        width = WIDTH[kind]
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(values) * values.itemsize})
        self.data.extend(values.tobytes())
        made = {"bufferView": len(self.views) - 1, "componentType": component, "count": len(values) // width,
                "type": kind}
        if bounds:
            made["min"] = [min(values[k::width]) for k in range(width)]
            made["max"] = [max(values[k::width]) for k in range(width)]
        self.accessors.append(made)
        return len(self.accessors) - 1

    def sampler(self, kind, value):
        """Adds keys value(turn), for turn in [0, 2 pi]. Returns the sampler."""
        times = array.array("f", (SECONDS * k / FRAMES for k in range(FRAMES + 1)))
        values = array.array("f", (c for k in range(FRAMES + 1) for c in value(2 * math.pi * k / FRAMES)))
        return {"input": self.add(times, "SCALAR", FLOAT, True), "output": self.add(values, kind)}

    def write(self, path):
        self.json.update(accessors=self.accessors, bufferViews=self.views, buffers=[{"byteLength": len(self.data)}])
        text = json.dumps(self.json, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        with open(path, "wb") as file:
            file.write(struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(self.data)))
            file.write(struct.pack("<I4s", len(text), b"JSON") + text)
            file.write(struct.pack("<I4s", len(self.data), b"BIN\0") + self.data)


def camera(translation, degrees_down):
    tilt = math.radians(-degrees_down) / 2
    return ({"name": "view0", "camera": 0, "translation": translation,
             "rotation": [math.sin(tilt), 0, 0, math.cos(tilt)]},
            [{"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.01, "aspectRatio": 1}}])


def cells(columns, rows):
    """Returns the indices of two triangles for each cell of a grid of (columns + 1) x (rows + 1) vertices."""
    indices = array.array("I")
    for j in range(rows):
        for i in range(columns):
            a = j * (columns + 1) + i
            b = a + columns + 1
            indices.extend((a, b, a + 1, a + 1, b, b + 1))
    return indices


def grid(count):
    side = max(1, round(math.sqrt(count / 2)))
    height, waves = 0.03, 11.0
    positions, normals, *moved = [array.array("f") for _ in range(6)]
    for j in range(side + 1):
        for i in range(side + 1):
            x, z = 2 * i / side - 1, 2 * j / side - 1
            positions.extend((x, 0.1 * math.sin(9 * x + 4 * z) + 0.05 * math.sin(23 * z - 7 * x), z))
            slope_x = 0.9 * math.cos(9 * x + 4 * z) - 0.35 * math.cos(23 * z - 7 * x)
            slope_z = 0.4 * math.cos(9 * x + 4 * z) + 1.15 * math.cos(23 * z - 7 * x)
            length = math.sqrt(1 + slope_x * slope_x + slope_z * slope_z)
            normals.extend((-slope_x / length, 1 / length, -slope_z / length))
            for target, shift in ((0, 0.0), (2, math.pi / 2)):
                phase = waves * (x + 0.6 * z) + shift
                tilt = -height * waves * math.cos(phase) / length
                moved[target].extend((0, height * math.sin(phase), 0))
                moved[target + 1].extend((tilt, 0, 0.6 * tilt))
    d = Document()
    targets = [{"POSITION": d.add(moved[k], "VEC3", FLOAT, True), "NORMAL": d.add(moved[k + 1], "VEC3")}
               for k in (0, 2)]
    primitive = {"attributes": {"POSITION": d.add(positions, "VEC3", FLOAT, True), "NORMAL": d.add(normals, "VEC3")},
                 "indices": d.add(cells(side, side), "SCALAR", UINT), "targets": targets}
    view, cameras = camera([0, 1.5, 2.1], 35)
    d.json.update(scenes=[{"nodes": [0, 1]}], nodes=[{"name": "grid", "mesh": 0}, view], cameras=cameras,
                  meshes=[{"weights": [1, 0], "primitives": [primitive]}],
                  animations=[{"name": "waves",
                               "samplers": [d.sampler("SCALAR", lambda turn: (math.cos(turn), math.sin(turn)))],
                               "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}]}])
    return d, 2 * side * side


def tube(count):
    joints, length, radius = 24, 4.0, 0.25
    around = max(3, round(math.sqrt(count / 2 * 2 * math.pi * radius / length)))
    along = max(joints, round(count / 2 / around))
    positions, normals, weights = [array.array("f") for _ in range(3)]
    names = array.array("H")
    for j in range(along + 1):
        at = (joints - 1) * j / along
        first = min(max(int(at) - 1, 0), joints - 4)
        near = [max(0.0, 1.5 - abs(at - (first + k))) for k in range(4)]
        for i in range(around + 1):
            turn = 2 * math.pi * i / around
            positions.extend((radius * math.sin(turn), length * j / along, radius * math.cos(turn)))
            normals.extend((math.sin(turn), 0, math.cos(turn)))
            names.extend(range(first, first + 4))
            weights.extend(w / sum(near) for w in near)
    d = Document()
    step = length / (joints - 1)
    inverse = array.array("f", (c for k in range(joints)
                                for c in (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -step * k, 0, 1)))
    primitive = {"attributes": {"POSITION": d.add(positions, "VEC3", FLOAT, True), "NORMAL": d.add(normals, "VEC3"),
                                "JOINTS_0": d.add(names, "VEC4", USHORT), "WEIGHTS_0": d.add(weights, "VEC4")},
                 "indices": d.add(cells(around, along), "SCALAR", UINT)}
    view, cameras = camera([0, 2, 5.5], 0)
    bones = [{"name": f"joint{k}", "translation": [0, step if k else 0, 0]} for k in range(joints)]
    for k in range(joints - 1):
        bones[k]["children"] = [k + 3]
    samplers = [d.sampler("VEC4", lambda turn, k=k: (0, 0, math.sin(0.06 * math.sin(turn + 0.3 * k)),
                                                     math.cos(0.06 * math.sin(turn + 0.3 * k)))) for k in range(joints)]
    d.json.update(scenes=[{"nodes": [0, 1, 2]}], nodes=[{"name": "tube", "mesh": 0, "skin": 0}, view, *bones],
                  cameras=cameras, meshes=[{"primitives": [primitive]}],
                  skins=[{"joints": list(range(2, joints + 2)), "inverseBindMatrices": d.add(inverse, "MAT4")}],
                  animations=[{"name": "sway", "samplers": samplers,
                               "channels": [{"sampler": k, "target": {"node": k + 2, "path": "rotation"}}
                                            for k in range(joints)]}])
    return d, 2 * around * along


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=("grid", "tube"))
    parser.add_argument("out", help=".glb to write")
    parser.add_argument("--triangles", type=float, default=1e6, help="about how many, 100 to 3e7 [%(default)g]")
    args = parser.parse_args()
    if not 100 <= args.triangles <= 3e7:
        parser.error(f"--triangles {args.triangles:g}: expected 100 to 3e7")
    made, count = {"grid": grid, "tube": tube}[args.kind](args.triangles)
    made.write(args.out)
    print(f"{args.out}: {count} triangles")


if __name__ == "__main__":
    main()
