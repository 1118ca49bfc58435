#!/usr/bin/env python3
"""Measures a lidar of 64 channels x 1800 columns in 20 places of a wood whose leaves are cut out by alpha.

Three returns of each beam, by ballot.sensors, and by Scene.crossings() and NumPy. The calls take turns. Prints the
least seconds of each, and the least that the process's threads used:

    build/release/python/venv/bin/python tests/speed/python_lidar.py [--device gpu] [--leaves 40000] [--repeat 5]
"""

import argparse
import base64
import json
import os
import struct
import tempfile
import time
import zlib

import ballot
import numpy as np


def leaf_png() -> bytes:
    """Returns a picture of a leaf, whose outside is transparent."""
    y, x = np.mgrid[0:64, 0:64] / 31.5 - 1
    rows = np.zeros((64, 1 + 4 * 64), np.uint8)  # each begins with its filter: none
    pixels = rows[:, 1:].reshape(64, 64, 4)
    pixels[..., :3], pixels[..., 3] = (70, 130, 40), 255 * ((x / 0.6) ** 2 + y**2 < 1)
    head = struct.pack(">IIBBBBB", 64, 64, 8, 6, 0, 0, 0)
    parts = (b"IHDR", head), (b"IDAT", zlib.compress(rows.tobytes())), (b"IEND", b"")
    chunks = [struct.pack(">I", len(d)) + n + d + struct.pack(">I", zlib.crc32(n + d)) for n, d in parts]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def ground() -> tuple[np.ndarray, np.ndarray]:
    x, y = np.meshgrid(*[np.linspace(-40, 40, 65)] * 2)
    i = np.arange(65 * 64).reshape(64, 65)[:, :-1].ravel()
    triangles = np.stack([i, i + 1, i + 66, i, i + 66, i + 65], -1).reshape(-1, 3)
    return np.stack([x, y, 0.3 * np.sin(x / 5) * np.cos(y / 7)], -1).reshape(-1, 3), triangles


def leaves(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns vertices, triangles and texture coordinates of squares in the crowns of 60 trees."""
    random = np.random.default_rng(1)
    tree = np.c_[random.uniform(-25, 25, (60, 2)), np.full(60, 4.0)]
    middle = tree[random.integers(0, 60, count)] + random.normal(size=(count, 3)) * (1.3, 1.3, 1.0)
    a, b = random.normal(size=(2, count, 3))
    b = np.cross(a, b)
    a, b = (0.15 * v / np.linalg.norm(v, axis=1, keepdims=True) for v in (a, b))
    vertices = (middle[:, None] + np.stack([-a - b, a - b, a + b, b - a], 1)).reshape(-1, 3)
    triangles = (4 * np.arange(count)[:, None] + [0, 1, 2, 0, 2, 3]).reshape(-1, 3)
    return vertices, triangles, np.tile([[0, 0], [1, 0], [1, 1], [0, 1]], (count, 1))


def write_wood(path: str, count: int) -> None:
    """Writes the wood as glTF."""
    views, accessors, data = [], [], b""
    for array in (*ground(), *leaves(count)):
        numbers = array.astype("<u4" if array.shape[1] == 3 and array.dtype.kind == "i" else "<f4")
        indices = numbers.dtype.kind == "u"
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": numbers.nbytes})
        accessors.append({"bufferView": len(accessors), "componentType": 5125 if indices else 5126,
                          "count": numbers.size if indices else len(numbers),
                          "type": "SCALAR" if indices else f"VEC{numbers.shape[1]}"})  # fmt: skip
        if not indices:
            accessors[-1] |= {"min": numbers.min(0).tolist(), "max": numbers.max(0).tolist()}
        data += numbers.tobytes()
    embedded = [f"data:{kind};base64,{base64.b64encode(part).decode()}"
                for kind, part in (("application/octet-stream", data), ("image/png", leaf_png()))]  # fmt: skip
    surface = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "alphaMode": "MASK", "doubleSided": True}
    mesh = {"primitives": [{"attributes": {"POSITION": 2, "TEXCOORD_0": 4}, "indices": 3, "material": 0}]}
    content = {"asset": {"version": "2.0"}, "buffers": [{"byteLength": len(data), "uri": embedded[0]}],
               "bufferViews": views, "accessors": accessors, "images": [{"uri": embedded[1]}],
               "textures": [{"source": 0}], "materials": [surface], "nodes": [{"mesh": 0}, {"mesh": 1}],
               "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}, mesh],
               "scenes": [{"nodes": [0, 1]}]}  # fmt: skip
    with open(path, "w", encoding="utf-8") as file:
        json.dump(content, file)


def by_hand(scene: ballot.Scene, beams: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """Returns the points of the first three crossings of each beam."""
    counts, hits = scene.crossings(ballot.Pattern(beams), poses=poses, t=(0.5, 100), alpha=True)
    counts = counts.reshape(-1)
    kept = np.arange(len(hits)) - np.repeat(np.cumsum(counts) - counts, counts) < 3
    ray = np.repeat(np.arange(len(counts)), counts)[kept]
    pose, beam = np.divmod(ray, beams.size // 3)
    directions = np.einsum("nij,nj->ni", poses[pose, :, :3], beams.reshape(-1, 3)[beam])
    return poses[pose, :, 3] + hits["t"][kept][:, None] * directions


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--device", help="as `ballot.Device` takes it")
    parser.add_argument("--leaves", type=int, default=40000)
    parser.add_argument("--repeat", type=int, default=5)
    options = parser.parse_args()
    device = ballot.Device(options.device) if options.device else ballot.default_device()
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "wood.gltf")
        write_wood(path, options.leaves)
        scene = ballot.load_scene(path, device=device)
    sensor = ballot.sensors.spinning(np.deg2rad(np.linspace(-25, 15, 64)), 1800, near=0.5, far=100)
    poses = np.tile(np.eye(3, 4), (20, 1, 1))
    poses[:, 0, 3], poses[:, 2, 3] = np.linspace(-15, 15, 20), 1.8
    place = ("x", "y", "z")
    calls = {
        "first three hits": lambda: scene.trace(sensor.pattern, poses=poses, t=(0.5, 100), first=3, alpha=True),
        "scan: x y z": lambda: sensor.scan(scene, poses, returns=3, alpha=True, fields=place),
        "scan: x y z range intensity ring time id": lambda: sensor.scan(scene, poses, returns=3, alpha=True),
        "crossings, x y z by hand": lambda: by_hand(scene, sensor.directions(), poses),
    }
    print(f"{device.info.name}, {scene.info.triangles} triangles, {20 * 64 * 1800} beams")
    points, spent = {}, {name: [] for name in calls}
    for _ in range(options.repeat):
        for name, call in calls.items():
            begin = np.array([time.perf_counter(), time.process_time()])
            points[name] = call()
            spent[name].append([time.perf_counter(), time.process_time()] - begin)
    for name, times in spent.items():
        print("{:42} {:7.3f} s, of threads {:7.3f} s".format(name, *np.min(times, axis=0)))
    cloud, hand = points["scan: x y z"], points["crossings, x y z by hand"]
    error = max(float(abs(cloud[axis] - hand[:, k]).max()) for k, axis in enumerate(place))
    print(f"{len(cloud)} points; by hand {len(hand)}, {error:.1e} away at most")


if __name__ == "__main__":
    main()
