#!/usr/bin/env python3
"""Makes the bay: an island with a lighthouse, a jetty and a boat in the evening sun, and the sea. Metres, +y up.

Everything is computed from the numbers below. Random numbers come from a fixed seed."""

import math
import os
import random

from gltf_writer import Scene, cross, run, sub, unit

ISLAND = (5.0, -46.0)  # its middle, x and z
RADIUS = 24.0  # of the island, about
TOP = (9.0, -50.0)  # where the lighthouse stands
WAVES = 22
SUN = (0.62, -0.36, -0.55)  # the way its light travels


def hash_noise(i, j):
    """Returns a number in [0, 1) that depends on two whole numbers only."""
    n = (i * 374761393 + j * 668265263) & 0xffffffff
    n = ((n ^ (n >> 13)) * 1274126177) & 0xffffffff
    return (n ^ (n >> 16)) / 2**32


def noise(x, y):
    """Returns smooth noise in [0, 1] whose grains are one unit wide."""
    i, j = math.floor(x), math.floor(y)
    u, v = x - i, y - j
    u, v = u * u * (3 - 2 * u), v * v * (3 - 2 * v)
    low = hash_noise(i, j) * (1 - u) + hash_noise(i + 1, j) * u
    high = hash_noise(i, j + 1) * (1 - u) + hash_noise(i + 1, j + 1) * u
    return low * (1 - v) + high * v


def ridges(x, y, octaves):
    total, size = 0.0, 1.0
    for _ in range(octaves):
        total += size * (1 - abs(2 * noise(x, y) - 1))
        x, y, size = 2.03 * x + 17, 2.03 * y + 5, size / 2
    return total


def facet(mesh, a, b, c, up=(0, 1, 0)):
    """Adds a flat triangle whose normal is on the side of `up`."""
    n = unit(cross(sub(b, a), sub(c, a)))
    if sum(p * q for p, q in zip(n, up)) < 0:
        n, b, c = tuple(-p for p in n), c, b
    mesh.triangle(mesh.vertex(a, n), mesh.vertex(b, n), mesh.vertex(c, n))


def island_height(x, z):
    """Returns the height of the ground over the sea; far from the island it is below."""
    dx, dz = x - ISLAND[0], z - ISLAND[1]
    r = math.hypot(dx, 1.25 * dz) / RADIUS
    r += 0.32 * (noise(0.11 * x + 40, 0.11 * z + 9) - 0.5)
    base = 7.2 * max(0.0, 1 - r) ** 0.8 - 1.5 * max(0.0, r - 0.9)
    rough = (ridges(0.09 * x + 3, 0.09 * z + 7, 4) - 1.0) * min(1.0, max(0.0, 1.25 - r) * 1.6)
    hill = 3.2 * math.exp(-((x - TOP[0]) ** 2 + (z - TOP[1]) ** 2) / 90)
    plateau = math.exp(-((x - TOP[0]) ** 2 + (z - TOP[1]) ** 2) / 12)
    h = base + 2.6 * rough + hill
    return h * (1 - plateau) + 9.6 * plateau - 0.25


def add_island(mats):
    """Sand near the water, grass where it is level, rock where it is steep."""
    n, half = 120, 34.0
    rng = random.Random(3)

    def at(i, j):
        shake = random.Random(1000 * i + j)
        x = ISLAND[0] + half * (2 * (i + shake.uniform(-0.35, 0.35)) / n - 1)
        z = ISLAND[1] + half * (2 * (j + shake.uniform(-0.35, 0.35)) / n - 1)
        return (x, island_height(x, z), z)

    points = [[at(i, j) for j in range(n + 1)] for i in range(n + 1)]
    for i in range(n):
        for j in range(n):
            a, b, c, d = points[i][j], points[i + 1][j], points[i + 1][j + 1], points[i][j + 1]
            for triangle in ((a, b, c), (a, c, d)):
                height = sum(p[1] for p in triangle) / 3
                if height < -1.2:
                    continue
                steep = abs(unit(cross(sub(triangle[1], triangle[0]), sub(triangle[2], triangle[0])))[1])
                if height < 0.55:
                    name = "sand"
                elif steep < 0.72 or height < 1.0:
                    name = "rock" if rng.random() < 0.75 else "dark_rock"
                else:
                    name = "grass" if rng.random() < 0.7 else "moss"
                facet(mats[name], *triangle)


def cone(mesh, foot, radius, height, sides, turn):
    tip = (foot[0], foot[1] + height, foot[2])
    ring = [(foot[0] + radius * math.cos(turn + 2 * math.pi * k / sides), foot[1] + (k % 2) * 0.06 * height,
             foot[2] + radius * math.sin(turn + 2 * math.pi * k / sides)) for k in range(sides)]
    for k in range(sides):
        out = sub(ring[k], foot)
        facet(mesh, ring[k], ring[(k + 1) % sides], tip, (out[0], 0.1, out[2]))


def pine(mats, x, z, size, rng):
    y = island_height(x, z) - 0.1
    mats["bark"].lathe((x, y, z), [(0.13 * size, 0), (0.1 * size, 0.9 * size)], 6)
    leaves = mats["pine" if rng.random() < 0.6 else "pine_light"]
    for k in range(4):
        cone(leaves, (x, y + (0.55 + 0.62 * k) * size, z), (1.0 - 0.2 * k) * size, (1.35 - 0.12 * k) * size, 9,
             rng.uniform(0, 6))


def add_pines(mats):
    rng = random.Random(11)
    placed = 0
    while placed < 95:
        x, z = ISLAND[0] + rng.uniform(-24, 24), ISLAND[1] + rng.uniform(-20, 20)
        h = island_height(x, z)
        slope = abs(island_height(x + 0.5, z) - h) + abs(island_height(x, z + 0.5) - h)
        clear = all(math.hypot(x - u, z - w) > r for u, w, r in ((*TOP, 4.2), (1.5, -33.0, 5), (11.5, -36.0, 4.5)))
        if h > 1.3 and slope < 0.7 and clear and noise(0.16 * x + 80, 0.16 * z) > 0.42:
            pine(mats, x, z, rng.uniform(0.75, 1.5), rng)
            placed += 1


def add_lighthouse(mats):
    x, z = TOP
    y = island_height(x, z) - 0.4
    mats["stone"].lathe((x, y, z), [(2.1, 0), (2.0, 0.9), (1.75, 0.9)], 20)
    radius, step = 1.45, 1.5
    for k in range(6):
        low, high = radius - 0.095 * k, radius - 0.095 * (k + 1)
        mats["red" if k % 2 else "white"].lathe((x, y + 0.9 + step * k, z), [(low, 0), (high, step)], 28)
    top = y + 0.9 + 6 * step
    mats["iron"].lathe((x, top, z), [(0.88, -0.25), (1.35, 0.0), (1.35, 0.12), (0.0, 0.12)], 28)
    for k in range(18):
        a = 2 * math.pi * k / 18
        mats["iron"].lathe((x + 1.27 * math.cos(a), top + 0.12, z + 1.27 * math.sin(a)), [(0.025, 0), (0.025, 0.6)], 5)
    mats["iron"].lathe((x, top + 0.7, z), [(1.24, 0), (1.30, 0), (1.30, 0.05), (1.24, 0.05), (1.24, 0)], 28)
    for k in range(8):
        a = 2 * math.pi * k / 8
        mats["iron"].lathe((x + 0.72 * math.cos(a), top + 0.12, z + 0.72 * math.sin(a)), [(0.035, 0), (0.035, 1.3)], 5)
    mats["lamp"].sphere((x, top + 0.75, z), 0.36, 24, 14)
    mats["red"].lathe((x, top + 1.42, z), [(0.95, 0), (0.95, 0.06), (0.55, 0.5), (0.12, 0.75), (0.12, 0.95), (0, 1.0)],
                      24)
    for k, (h, a) in enumerate(((2.2, 0.9), (4.9, 1.4), (7.6, 1.1))):
        r = 1.47 - 0.0633 * (h - 0.1) + 0.02
        mats["lamp_window"].lathe((x, y + 0.9 + h, z), [(r, 0), (r - 0.035, 0.62)], 2, start=a - 0.14 * (k + 3) / 3,
                                  turn=0.3)


def house(mats, x, z, turn, wide, deep, tall):
    """A house with a gable roof, two lit windows and a door."""
    y = island_height(x, z) - 0.5
    c, s = math.cos(turn), math.sin(turn)

    def at(u, v, w):
        return (x + c * u + s * w, y + v, z - s * u + c * w)

    def slab(mesh, u0, u1, v0, v1, w):
        mesh.quad(at(u0, v0, w), at(u1, v0, w), at(u1, v1, w), at(u0, v1, w), (s, 0, c))

    walls, half = mats["white"], wide / 2
    corners = [(-half, deep / 2), (half, deep / 2), (half, -deep / 2), (-half, -deep / 2)]
    for k in range(4):
        (u, w), (p, q) = corners[k], corners[(k + 1) % 4]
        walls.quad(at(u, 0, w), at(p, 0, q), at(p, tall, q), at(u, tall, w))
        mats["stone"].quad(at(1.04 * u, -3, 1.04 * w), at(1.04 * p, -3, 1.04 * q), at(1.04 * p, 0.25, 1.04 * q),
                           at(1.04 * u, 0.25, 1.04 * w))
    ridge = tall + 0.42 * deep
    for u, side in ((half, 1), (-half, -1)):
        facet(walls, at(u, tall, deep / 2), at(u, tall, -deep / 2), at(u, ridge, 0), (side * c, 0.0, -side * s))
    for side in (1, -1):
        edge = side * (deep / 2 + 0.3)
        low = tall - 0.3 * (ridge - tall) / (deep / 2)
        for rise in (0.0, 0.12):
            mats["roof"].quad(at(-half - 0.25, low + rise, edge), at(half + 0.25, low + rise, edge),
                              at(half + 0.25, ridge + rise, 0), at(-half - 0.25, ridge + rise, 0),
                              unit((side * s * 0.6, 1, side * c * 0.6)))
    mats["stone"].box((x + 0.3, y + tall, z - 0.3), (x + 0.8, y + ridge + 0.5, z + 0.2))
    for u in (-0.3 * wide, 0.3 * wide):
        slab(mats["bark"], u - 0.42, u + 0.42, 1.3, 2.3, deep / 2 + 0.02)
        slab(mats["lamp_window"], u - 0.34, u + 0.34, 1.38, 2.22, deep / 2 + 0.04)
    slab(mats["red"], -0.4, 0.4, 0.4, 2.2, deep / 2 + 0.03)


def add_jetty(mats):
    """Planks on posts, from the shore towards the viewer."""
    x, z0, z1 = -1.6, -30.5, -20.0
    count = 34
    rng = random.Random(5)
    for k in range(count):
        z = z0 + (z1 - z0) * k / count
        lift = rng.uniform(-0.015, 0.015)
        mats["plank"].box((x - 0.85 + lift, 0.62 + lift, z), (x + 0.85 + 2 * lift, 0.70 + lift, z + 0.27))
    for k in range(6):
        z = z0 + 0.5 + (z1 - z0 - 0.6) * k / 5
        for side in (-0.8, 0.8):
            mats["bark"].lathe((x + side, -1.0, z), [(0.11, 0), (0.1, 2.1), (0.0, 2.12)], 8)
    mats["iron"].lathe((x - 0.8, 1.1, z1 - 0.1), [(0.03, 0), (0.03, 1.2)], 6)
    mats["lamp"].sphere((x - 0.8, 2.4, z1 - 0.1), 0.12, 14, 8)


def add_boat(mats, x, z, heading, size):
    """A sailing boat: a hull of cross-sections, a deck, mast, boom, mainsail and jib."""
    c, s = math.cos(heading), math.sin(heading)

    def at(along, up, across):
        return (x + size * (c * along + s * across), size * up, z + size * (-s * along + c * across))

    def turned(along, up, across):
        return unit((c * along + s * across, up, -s * along + c * across))

    def half_width(u):
        return 0.95 * math.sin(math.pi * min(1.0, 0.16 + 0.84 * u)) ** 0.7 if u < 0.999 else 0.02

    def hull(u, v):
        w, side = half_width(u), 2 * v - 1
        keel = -0.35 * math.sin(math.pi * (0.12 + 0.8 * u))
        rim = 0.62 + 0.3 * (2 * u - 0.9) ** 2
        return at(5.2 * (u - 0.5), keel + (rim - keel) * abs(side) ** 2.2, w * math.copysign(abs(side) ** 0.6, side))

    def hull_normal(u, v):
        e = 1e-3
        n = unit(cross(sub(hull(min(u + e, 1), v), hull(max(u - e, 0), v)), sub(hull(u, v + e), hull(u, v - e))))
        out = turned(0, -0.3, 2 * v - 1)
        return n if sum(p * q for p, q in zip(n, out)) > 0 else tuple(-p for p in n)

    def stern(u, v):
        left, right = hull(0, u / 2), hull(0, 1 - u / 2)
        return tuple(p + (q - p) * v for p, q in zip(left, right))

    mats["hull"].grid(hull, hull_normal, 28, 18)
    mats["hull"].grid(stern, lambda u, v: turned(-1, 0, 0), 9, 2)
    mats["plank"].grid(lambda u, v: at(5.2 * (u - 0.5), 0.52 + 0.26 * (2 * u - 0.9) ** 2, half_width(u) * (2 * v - 1)),
                       lambda u, v: (0, 1, 0), 20, 2)
    mats["bark"].lathe(at(0.25, 0.4, 0), [(0.055 * size, 0), (0.035 * size, 6.6 * size)], 8)
    mast, top = 0.25, 6.7

    def main_sail(u, v):
        foot = mast - 0.06 - 2.6 * (1 - v) * u
        belly = 0.42 * math.sin(math.pi * u) * (1 - v) * math.sin(math.pi * (0.25 + 0.75 * v))
        return at(foot, 1.25 + (top - 1.35) * v + 0.1 * u * (1 - v), belly + 0.28 * u * (1 - v))

    def jib(u, v):
        belly = 0.3 * math.sin(math.pi * u) * math.sin(math.pi * min(1.0, v + 0.15)) * (1 - v)
        return at(2.45 + (mast - 2.15) * (u + v - u * v) * 0.92, 0.95 + 4.9 * v, belly)

    for sail in (main_sail, jib):
        def normal(u, v, sail=sail):
            e = 1e-3
            u, v = min(max(u, e), 1 - e), min(max(v, e), 1 - 2 * e)
            return unit(cross(sub(sail(u + e, v), sail(u - e, v)), sub(sail(u, v + e), sail(u, v - e))))

        mats["sail"].grid(sail, normal, 14, 18)
    a, b = at(mast, 1.2, 0), at(mast - 2.7, 1.3, 0.3)
    for k in range(2):
        mats["bark"].grid(lambda u, v: tuple(p + (q - p) * u + 0.045 * (math.cos(6.2832 * v) if i == 1 else
                                                                         math.sin(6.2832 * v) if i == 2 else 0)
                                             for i, (p, q) in enumerate(zip(a, b))),
                          lambda u, v: (0, math.cos(6.2832 * v), math.sin(6.2832 * v)), 1, 8)
    facet(mats["red"], at(mast, top, 0), at(mast, top + 0.45, 0), at(mast - 0.8, top + 0.22, 0.1), turned(0, 0, 1))


def add_sea(mats):
    """Waves that are finer near the viewer. Those shorter than two cells of the grid are left out."""
    rng = random.Random(23)
    waves = []
    for k in range(WAVES):
        length = 0.55 * 1.24 ** k
        way = 0.35 + rng.gauss(0, 0.55)
        waves.append((2 * math.pi / length * math.cos(way), 2 * math.pi / length * math.sin(way), length,
                      0.0062 * length / (1 + 0.05 * length), rng.uniform(0, 2 * math.pi)))
    rows, columns, near = 330, 300, 18.0

    def place(u, v):
        away = 2.2 * (1.0 + (math.exp(7.4 * v) - 1) / 12)  # metres before the viewer
        return ((2 * u - 1) * (4 + 0.95 * away), near - away, away)

    def sums(u, v):
        x, z, away = place(u, v)
        cell = max(2 * (4 + 0.95 * away) / columns, 2.2 * math.exp(7.4 * v) / 12 * 7.4 / rows)
        height = slope_x = slope_z = 0.0
        for kx, kz, length, size, phase in waves:
            part = min(1.0, max(0.0, length / (2.5 * cell) - 1))
            if part == 0:
                continue
            angle = kx * x + kz * z + phase
            height += part * size * math.sin(angle)
            slope = part * size * math.cos(angle)
            slope_x += kx * slope
            slope_z += kz * slope
        return (x, height, z), unit((-slope_x, 1, -slope_z))

    water = mats["water"]
    first = len(water.positions) // 3
    for j in range(rows + 1):
        for i in range(columns + 1):
            water.vertex(*sums(i / columns, j / rows))
    for j in range(rows):
        for i in range(columns):
            a = first + j * (columns + 1) + i
            water.triangle(a, a + 1, a + columns + 2)
            water.triangle(a, a + columns + 2, a + columns + 1)


def add_mountains(mats):
    """Three ranges at the horizon, each paler than the one before it."""
    for k, (name, away, tall, wide) in enumerate((("range1", 420, 46, 620), ("range2", 700, 95, 1000),
                                                  ("range3", 1100, 150, 1500))):
        n = 70
        rows = []
        for j in range(5):
            row = []
            for i in range(n + 1):
                x = wide * (2 * i / n - 1)
                ridge = ridges(0.006 * x * (620 / wide) + 13 * k, 0.5 * k, 4) / 1.9
                middle = 0.35 + 0.65 * min(1.0, abs(x - 40 * (k - 1)) / (0.55 * wide))
                peak = tall * ridge * middle * (1.0 if k else 0.8)
                depth = -away - 55 * j * (k + 1) / 2
                shake = hash_noise(i + 100 * k, j) - 0.5
                height = peak * (-0.06, 0.38, 0.72, 1.0, 0.6)[j] * (1 + (0.3 if 0 < j < 3 else 0) * shake)
                row.append((x + 0.5 * wide / n * shake, height, depth))
            rows.append(row)
        for low, high in zip(rows, rows[1:]):
            for i in range(n):
                facet(mats[name], low[i], low[i + 1], high[i + 1], (0, 0.3, 1))
                facet(mats[name], low[i], high[i + 1], high[i], (0, 0.3, 1))


def materials(scene):
    made = {}

    def add(name, *args, **options):
        made[name] = scene.add_material(name, *args, **options)

    add("sand", (0.76, 0.62, 0.42))
    add("rock", (0.42, 0.37, 0.33))
    add("dark_rock", (0.30, 0.27, 0.26))
    add("grass", (0.30, 0.40, 0.12))
    add("moss", (0.38, 0.44, 0.13))
    add("bark", (0.24, 0.15, 0.09))
    add("pine", (0.07, 0.20, 0.10))
    add("pine_light", (0.11, 0.27, 0.10))
    add("stone", (0.55, 0.52, 0.48))
    add("white", (0.86, 0.84, 0.80))
    add("red", (0.62, 0.07, 0.05))
    add("roof", (0.50, 0.17, 0.09))
    add("iron", (0.06, 0.06, 0.07), roughness=0.5)
    add("plank", (0.45, 0.32, 0.20))
    add("hull", (0.05, 0.12, 0.26), roughness=0.4)
    add("sail", (0.90, 0.87, 0.80))
    add("lamp", (1.0, 0.85, 0.6), emissive=(1.0, 0.66, 0.28), strength=9.0)
    add("lamp_window", (1.0, 0.8, 0.5), emissive=(1.0, 0.60, 0.22), strength=3.0)
    add("water", (0.010, 0.040, 0.052), roughness=0.0, ior=1.33)
    add("range1", (0.22, 0.27, 0.30))
    add("range2", (0.36, 0.40, 0.47))
    add("range3", (0.52, 0.54, 0.62))
    return made


def make():
    scene = Scene()
    mats = materials(scene)
    add_sea(mats)
    add_mountains(mats)
    add_island(mats)
    add_pines(mats)
    add_lighthouse(mats)
    house(mats, 1.5, -34.0, 0.35, 4.4, 3.2, 2.9)
    house(mats, 11.5, -37.0, -0.35, 3.4, 2.8, 2.7)
    add_jetty(mats)
    add_boat(mats, -12.5, -27.0, 0.5, 1.0)
    scene.add_sun(SUN, (1.0, 0.74, 0.46), 4.2)
    scene.add_view((-5.5, 2.3, 3.0), (-0.4, 5.6, -40.0), 36)
    scene.add_view((-19.5, 2.6, -14.0), (1.1, 4.6, -42.0), 44)
    return scene


if __name__ == "__main__":
    run(make, __doc__.splitlines()[0], os.path.join("build", "scenes", "bay.glb"))
