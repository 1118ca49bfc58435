"""The inputs of `tools/dev.py scaling`: a wavy grid of any number of triangles, and batches of rays over it.

Every file is written a few rows at a time, because the memory of this process must stay below that of the programs that
it measures.
"""

import json
import math
import os
import random
import struct
from array import array
from contextlib import contextmanager
from pathlib import Path

HALF = 10.0  # half the side of the grid
WAVES = ((0.8, 1.3, 0.0), (-0.4, 1.1, 1.0), (0.2, -2.3, 2.0), (2.1, 1.7, 3.0))  # frequency along x and z, phase
HEIGHT = 0.5  # amplitude of each wave
LOW, HIGH = -HEIGHT * len(WAVES), HEIGHT * len(WAVES) + 2.0  # range of the origins of random rays along y
EYE = (0.0, 8.0, 16.0)  # position of the camera, which looks at the origin
YFOV = math.radians(50)
TILE = 4  # camera rays are stored in tiles of 4 x 4, so that neighbours in the file have similar directions
SOME = 1 << 16  # number of origins, and of directions, that random rays are made of
FAR = 1e30
JSON_BYTES = 2048  # size of the JSON part of a scene file, padded with spaces: its bounds are known last
KINDS = ("camera", "random")


@contextmanager
def replacing(path: Path):
    """Opens a binary file under a temporary name and renames it to `path` once it is complete."""
    temporary = path.with_name(f".{os.getpid()}-{path.name}")
    try:
        with temporary.open("wb") as file:
            yield file
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def near_square(cells: int) -> tuple[int, int]:
    """Returns two factors whose product is `cells` and that are as close to each other as possible."""
    rows = next(r for r in range(math.isqrt(cells), 0, -1) if cells % r == 0)
    return cells // rows, rows


def along(cells: int) -> list[float]:
    return [HALF * (2 * i / cells - 1) for i in range(cells + 1)]


def write_positions(file, columns: int, rows: int) -> tuple[float, float]:
    """Writes the vertices row by row; returns the least and the greatest height.

    sin(ax + bz + c) = sin(ax) cos(bz + c) + cos(ax) sin(bz + c), so few sines give many vertices."""
    low, high = math.inf, -math.inf
    xs = along(columns)
    parts = [(math.sin(a * x), math.cos(a * x)) for x in xs for a, _, _ in WAVES]
    row = array("f", bytes(12 * len(xs)))
    row[0::3] = array("f", xs)
    sines = [[parts[i * len(WAVES) + w] for i in range(len(xs))] for w in range(len(WAVES))]
    for z in along(rows):
        factors = [(HEIGHT * math.cos(b * z + c), HEIGHT * math.sin(b * z + c)) for _, b, c in WAVES]
        ((p0, q0), (p1, q1), (p2, q2), (p3, q3)) = factors
        heights = array("f", [s0 * p0 + c0 * q0 + s1 * p1 + c1 * q1 + s2 * p2 + c2 * q2 + s3 * p3 + c3 * q3
                              for (s0, c0), (s1, c1), (s2, c2), (s3, c3) in zip(*sines)])
        low, high = min(low, *heights), max(high, *heights)
        row[1::3] = heights
        row[2::3] = array("f", [z]) * len(xs)
        file.write(row.tobytes())
    return low, high


def write_indices(file, columns: int, rows: int) -> None:
    below = columns + 1  # index distance from a vertex to the one in the next row
    first = []
    for i in range(columns):
        first += [i, i + below, i + 1, i + 1, i + below, i + below + 1]
    for row in range(rows):
        file.write(array("I", map((row * below).__add__, first)).tobytes())


def gltf_of(vertices: int, indices: int, low: float, high: float) -> dict:
    pitch = -math.atan2(EYE[1], EYE[2])
    return {
        "asset": {"version": "2.0", "generator": "Ballot's tools/dev.py scaling"},
        "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0, "name": "waves"},
                  {"camera": 0, "name": "camera", "translation": list(EYE),
                   "rotation": [math.sin(pitch / 2), 0, 0, math.cos(pitch / 2)]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": YFOV, "znear": 0.01, "aspectRatio": 1}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": vertices, "type": "VEC3",
                       "min": [-HALF, low, -HALF], "max": [HALF, high, HALF]},
                      {"bufferView": 1, "componentType": 5125, "count": indices, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 12 * vertices, "target": 34962},
                        {"buffer": 0, "byteOffset": 12 * vertices, "byteLength": 4 * indices, "target": 34963}],
        "buffers": [{"byteLength": 12 * vertices + 4 * indices}],
    }


def write_scene(path: Path, triangles: int) -> None:
    """Writes a scene. The waves are the same for every number of triangles; more triangles follow them more closely."""
    columns, rows = near_square(triangles // 2)
    vertices, indices = (columns + 1) * (rows + 1), 6 * columns * rows
    size = 12 * vertices + 4 * indices
    with replacing(path) as file:
        file.seek(20 + JSON_BYTES)
        file.write(struct.pack("<II", size, 0x004E4942))
        low, high = write_positions(file, columns, rows)
        write_indices(file, columns, rows)
        file.seek(0)
        file.write(struct.pack("<4sIIII", b"glTF", 2, 28 + JSON_BYTES + size, JSON_BYTES, 0x4E4F534A))
        file.write(json.dumps(gltf_of(vertices, indices, low, high)).encode().ljust(JSON_BYTES))


def npy_header(count: int) -> bytes:
    text = f"{{'descr': '<f4', 'fortran_order': False, 'shape': ({count}, 8), }}"
    text += " " * (-(len(text) + 11) % 64) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode()


def write_camera_rays(file, count: int) -> None:
    """Writes the rays of a square picture from the scene's camera. More rays give a finer picture of the same view."""
    across, down = near_square(count // TILE ** 2)
    distance, extent = math.hypot(*EYE), math.tan(YFOV / 2)
    forward, up = [-c / distance for c in EYE], [0.0, EYE[2] / distance, -EYE[1] / distance]  # right is x
    lanes = TILE ** 2 * across
    strip = array("f", bytes(32 * lanes))
    for axis in range(3):
        strip[axis::8] = array("f", [EYE[axis]]) * lanes
    width, height = TILE * across, TILE * down
    strip[4::8] = array("f", [extent * ((2 * (TILE * tile + x) + 1) / width - 1)
                              for tile in range(across) for _ in range(TILE) for x in range(TILE)])
    strip[7::8] = array("f", [FAR]) * lanes
    for tile_row in range(down):
        ys = [extent * (1 - (2 * (TILE * tile_row + y) + 1) / height) for y in range(TILE)]
        for axis in (1, 2):
            strip[4 + axis::8] = array("f", [forward[axis] + y * up[axis] for y in ys for _ in range(TILE)]) * across
        file.write(strip.tobytes())


def write_random_rays(file, count: int) -> None:
    """Writes rays from random points around the waves in random directions: each combines one of 65536 origins with one
    of 65536 directions."""
    rng = random.Random(1)
    origins = [struct.pack("<4f", rng.uniform(-HALF, HALF), rng.uniform(LOW, HIGH), rng.uniform(-HALF, HALF), 0)
               for _ in range(SOME)]
    directions = []
    for _ in range(SOME):
        y, angle = rng.uniform(-1, 1), rng.uniform(0, 2 * math.pi)  # uniform on the sphere (Archimedes)
        flat = math.sqrt(1 - y * y)
        directions.append(struct.pack("<4f", flat * math.cos(angle), y, flat * math.sin(angle), FAR))
    for first in range(0, count, SOME):
        rays = min(SOME, count - first)
        choices = array("H", rng.randbytes(4 * rays))
        halves: list[bytes] = [b""] * (2 * rays)
        halves[0::2] = map(origins.__getitem__, choices[:rays])
        halves[1::2] = map(directions.__getitem__, choices[rays:])
        file.write(b"".join(halves))


def write_rays(path: Path, kind: str, count: int) -> None:
    with replacing(path) as file:
        file.write(npy_header(count))
        {"camera": write_camera_rays, "random": write_random_rays}[kind](file, count)
