#!/usr/bin/env python3
"""Makes the atrium: a two-storey court of arcades under the open sky, 78 502 triangles. Metres, +y up.

Everything is computed from the numbers below. Random numbers come from a fixed seed."""

import math
import os
import random

from gltf_writer import Scene, cross, run, sub, unit

HALF_X, HALF_Z = 10.0, 6.0  # half the size of the open court, to the axes of its columns
WALK = 3.4  # width of the galleries
WALL = 0.24  # half the thickness of the arcades
FLOORS = (0.3, 5.6)  # heights of the floors; the galleries are two steps above the court
SPRING = 2.9  # height above a floor where the arches begin
STOREY = 5.0  # from a floor to the top of its arcade
LONG_BAYS, SHORT_BAYS = 8, 5
ARCH_STEPS = 16

SHAFT = [(0.30, 0.0), (0.30, 0.14), (0.25, 0.14), (0.285, 0.19), (0.285, 0.24), (0.235, 0.30), (0.225, 1.2),
         (0.185, 2.45), (0.215, 2.45), (0.215, 2.5), (0.19, 2.5), (0.22, 2.6), (0.30, 2.74)]
BALUSTER = [(0.055, 0.0), (0.035, 0.10), (0.07, 0.26), (0.028, 0.48), (0.05, 0.60)]
URN = [(0.26, 0.0), (0.26, 0.08), (0.12, 0.16), (0.10, 0.26), (0.30, 0.45), (0.42, 0.72), (0.40, 0.95), (0.30, 1.08),
       (0.30, 1.14), (0.44, 1.26), (0.44, 1.32), (0.36, 1.32), (0.30, 1.2), (0.0, 1.2)]
FIGURE = [(0.34, 0.0), (0.31, 0.3), (0.25, 0.8), (0.22, 1.05), (0.27, 1.35), (0.24, 1.5), (0.10, 1.62), (0.08, 1.7)]


class Side:
    """One side of the court. s runs along it, y up and n away from the court; n = 0 is the axis of its columns."""

    def __init__(self, origin, along, outward, length, bays):
        self.origin, self.along, self.outward = origin, along, outward
        self.length, self.bays, self.bay = length, bays, length / bays

    def at(self, s, y, n):
        return (self.origin[0] + s * self.along[0] + n * self.outward[0], y,
                self.origin[1] + s * self.along[1] + n * self.outward[1])

    def turn(self, s, y, n):
        """Returns the direction (s, y, n) of the side in the scene's coordinates."""
        return (s * self.along[0] + n * self.outward[0], y, s * self.along[1] + n * self.outward[1])

    def wall(self, mesh, a, b, low, high):
        """Adds a part of the gallery's outer wall, facing the court."""
        mesh.quad(*(self.at(s, y, WALK) for s, y in ((a, low), (b, low), (b, high), (a, high))), self.turn(0, 0, -1))

    def box(self, mesh, lo, hi):
        a, b = self.at(*lo), self.at(*hi)
        mesh.box(tuple(map(min, a, b)), tuple(map(max, a, b)))


SIDES = [Side((-HALF_X, HALF_Z), (1, 0), (0, 1), 2 * HALF_X, LONG_BAYS),
         Side((-HALF_X, -HALF_Z), (1, 0), (0, -1), 2 * HALF_X, LONG_BAYS),
         Side((-HALF_X, -HALF_Z), (0, 1), (-1, 0), 2 * HALF_Z, SHORT_BAYS),
         Side((HALF_X, -HALF_Z), (0, 1), (1, 0), 2 * HALF_Z, SHORT_BAYS)]
STAIR_SIDE, STAIR_BAY = SIDES[3], SHORT_BAYS // 2


def materials(scene):
    made = {}

    def add(name, *args, **options):
        made[name] = scene.add_material(name, *args, **options)

    add("plaster", (0.80, 0.66, 0.46))
    add("limestone", (0.80, 0.76, 0.67))
    add("marble", (0.86, 0.84, 0.80), roughness=0.5)
    add("tile_light", (0.72, 0.66, 0.55), roughness=0.5)
    add("tile_dark", (0.28, 0.16, 0.12), roughness=0.5)
    add("terracotta", (0.62, 0.26, 0.13))
    add("wood", (0.26, 0.14, 0.07))
    add("foliage", (0.14, 0.30, 0.07))
    add("cloth_red", (0.58, 0.05, 0.05))
    add("cloth_blue", (0.06, 0.14, 0.42))
    add("cloth_gold", (0.80, 0.52, 0.10))
    add("bronze", (0.62, 0.42, 0.22), metallic=1.0, roughness=0.4)
    add("lamp", (1.0, 0.9, 0.7), emissive=(1.0, 0.72, 0.38), strength=12.0)
    add("mirror", (0.95, 0.95, 0.96), metallic=1.0, roughness=0.0)
    add("glass", (0.97, 1.0, 0.99), roughness=0.0, transmission=1.0, ior=1.5)
    return made


def arch(mats, side, bay, floor):
    """The wall over one bay: both faces, the curved underside, a keystone and a moulding along the curve."""
    stone, trim = mats["limestone"], mats["marble"]
    s0, s1 = bay * side.bay, (bay + 1) * side.bay
    middle, radius = (s0 + s1) / 2, side.bay / 2 - 0.27
    spring, top = floor + SPRING, floor + STOREY

    def curve(k, r):
        a = math.pi * k / ARCH_STEPS
        return middle - r * math.cos(a), spring + r * math.sin(a), (-math.cos(a), math.sin(a))

    for face in (-WALL, WALL):
        normal = side.turn(0, 0, math.copysign(1, face))
        for k in range(ARCH_STEPS):
            (s, y, _), (t, z, _) = curve(k, radius), curve(k + 1, radius)
            stone.quad(side.at(s, y, face), side.at(t, z, face), side.at(t, top, face), side.at(s, top, face), normal)
        for a, b in ((s0, middle - radius), (middle + radius, s1)):
            corners = (side.at(s, y, face) for s, y in ((a, spring), (b, spring), (b, top), (a, top)))
            stone.quad(*corners, normal)

    def inside(u, v):
        s, y, _ = curve(u * ARCH_STEPS, radius)
        return side.at(s, y, WALL * (2 * v - 1))

    def down(u, _):
        out = curve(u * ARCH_STEPS, radius)[2]
        return side.turn(-out[0], -out[1], 0)

    stone.grid(inside, down, ARCH_STEPS, 1)
    moulding(trim, side, curve, radius, -WALL)
    crown = spring + radius
    side.box(trim, (middle - 0.13, crown - 0.06, -WALL - 0.1), (middle + 0.13, crown + 0.36, WALL + 0.06))


def moulding(mesh, side, curve, radius, face):
    """Three strips along an arch, proud of the wall on the court's side."""
    proud, width = face - 0.06, 0.2
    for (r0, n0), (r1, n1) in (((radius, face), (radius, proud)), ((radius, proud), (radius + width, proud)),
                               ((radius + width, proud), (radius + width, face))):
        def point(u, v):
            s, y, _ = curve(u * ARCH_STEPS, r0 + (r1 - r0) * v)
            return side.at(s, y, n0 + (n1 - n0) * v)

        def normal(u, _):
            out = curve(u * ARCH_STEPS, radius)[2]
            across = 0 if r0 != r1 else (-1 if r0 == radius else 1)
            return side.turn(across * out[0], across * out[1], -1 if across == 0 else 0)

        mesh.grid(point, normal, ARCH_STEPS, 1)


def column(mats, x, floor, z):
    mats["marble"].box((x - 0.33, floor, z - 0.33), (x + 0.33, floor + 0.12, z + 0.33), skip="y")
    mats["marble"].lathe((x, floor + 0.12, z), SHAFT, 16)
    for k, size in enumerate((0.31, 0.35)):
        mats["marble"].box((x - size, floor + 2.82 + 0.04 * k, z - size), (x + size, floor + 2.86 + 0.04 * k, z + size))


def balustrade(mats, side, bay, floor):
    s0, s1 = bay * side.bay + 0.3, (bay + 1) * side.bay - 0.3
    side.box(mats["limestone"], (s0, floor, -0.12), (s1, floor + 0.1, 0.12))
    side.box(mats["limestone"], (s0, floor + 0.7, -0.13), (s1, floor + 0.84, 0.13))
    for k in range(5):
        x, y, z = side.at(s0 + (k + 0.5) * (s1 - s0) / 5, floor + 0.1, 0)
        mats["marble"].lathe((x, y, z), BALUSTER, 8)


def arcades(mats):
    for floor in FLOORS:
        for side in SIDES:
            for bay in range(side.bays):
                arch(mats, side, bay, floor)
                if bay > 0:
                    x, _, z = side.at(bay * side.bay, 0, 0)
                    column(mats, x, floor, z)
                if floor == FLOORS[1] and not (side is STAIR_SIDE and bay == STAIR_BAY):
                    balustrade(mats, side, bay, floor)
        for x in (-HALF_X, HALF_X):  # piers in the corners
            for z in (-HALF_Z, HALF_Z):
                mats["limestone"].box((x - 0.36, floor, z - 0.36), (x + 0.36, floor + STOREY, z + 0.36))
                mats["marble"].box((x - 0.42, floor + 2.78, z - 0.42), (x + 0.42, floor + 2.9, z + 0.42))
                mats["marble"].box((x - 0.42, floor, z - 0.42), (x + 0.42, floor + 0.25, z + 0.42))


def galleries(mats):
    """Floors, beams, outer walls, cornices and roofs. Long sides take the corners."""
    for side in SIDES:
        extra = WALK if side.length > 2 * HALF_Z else 0.0
        a, b = -extra, side.length + extra
        for floor in FLOORS:
            edge = -0.36 if floor == FLOORS[0] else -0.42
            start, end = (a, b) if extra else (0.36, side.length - 0.36)
            side.box(mats["limestone"], (start, floor - 0.3, edge), (end, floor, WALK))
            tiles(mats, side, a, b, floor + 0.004, 0.4, WALK, 0.75)
            side.box(mats["marble"], (-0.36, floor + STOREY, -0.4), (side.length + 0.36, floor + STOREY + 0.14, 0.3))
            side.box(mats["marble"], (-0.44, floor + STOREY + 0.14, -0.5),
                     (side.length + 0.44, floor + STOREY + 0.3, 0.3))
            for k in range(2 * side.bays + 1):
                s = k * side.bay / 2
                side.box(mats["wood"], (s - 0.09, floor + STOREY - 0.35, WALL), (s + 0.09, floor + STOREY - 0.02, WALK))
            outer_wall(mats, side, -WALK, side.length + WALK, floor)
        roof(mats, side)


def tiles(mats, side, a, b, y, n0, n1, size):
    count_s, count_n = round((b - a) / size), max(round((n1 - n0) / size), 1)
    ds, dn = (b - a) / count_s, (n1 - n0) / count_n
    for i in range(count_s):
        for j in range(count_n):
            mesh = mats["tile_light" if (i + j) % 2 else "tile_dark"]
            s, n = a + i * ds, n0 + j * dn
            mesh.quad(side.at(s, y, n), side.at(s + ds, y, n), side.at(s + ds, y, n + dn), side.at(s, y, n + dn),
                      (0, 1, 0))


def outer_wall(mats, side, a, b, floor):
    """A plaster wall with a dado, a pilaster for each column and a door in every other bay."""
    top = floor + STOREY
    if floor == FLOORS[1]:  # up to the roof
        side.wall(mats["plaster"], a, b, top, top + 1.7)
    side.wall(mats["plaster"], a, b, floor, top)
    side.box(mats["terracotta"], (a, floor, WALK - 0.05), (b, floor + 0.9, WALK + 0.05))
    side.box(mats["marble"], (a, floor + 0.9, WALK - 0.08), (b, floor + 1.0, WALK + 0.05))
    for k in range(1, side.bays):
        s = k * side.bay
        side.box(mats["limestone"], (s - 0.22, floor, WALK - 0.16), (s + 0.22, top - 0.3, WALK))
        side.box(mats["marble"], (s - 0.28, floor + 2.78, WALK - 0.22), (s + 0.28, floor + 2.9, WALK))
    for k in range(0, side.bays, 2):
        s = (k + 0.5) * side.bay
        side.box(mats["marble"], (s - 0.75, floor, WALK - 0.14), (s + 0.75, floor + 2.6, WALK))
        side.box(mats["wood"], (s - 0.58, floor, WALK - 0.2), (s + 0.58, floor + 2.4, WALK))
        for row in range(3):
            for col in (-0.5, 0.06):
                side.box(mats["bronze"], (s + col, floor + 0.2 + 0.75 * row, WALK - 0.22),
                         (s + col + 0.44, floor + 0.75 + 0.75 * row, WALK - 0.19))


def roof(mats, side):
    """A roof of pantiles that slopes down to the court, mitred at the corners."""
    eaves, ridge, low = -0.75, WALK + 0.3, FLOORS[1] + STOREY + 0.3
    waves = round(side.length / 0.4)

    def point(u, v):
        n = eaves + (ridge - eaves) * v
        s = -n + (side.length + 2 * n) * u
        return side.at(s, low + 1.5 * v + 0.06 * abs(math.sin(math.pi * waves * u)), n)

    def normal(u, v):
        wave = 0.9 * math.cos(math.pi * waves * u) * math.copysign(1, math.sin(math.pi * waves * u + 1e-9))
        return unit(side.turn(-0.5 * wave, 1, -0.36))

    mats["terracotta"].grid(point, normal, 4 * waves, 1)


def court(mats):
    """The tiled floor of the court with its border, and the steps to the galleries."""
    side = Side((-HALF_X, -HALF_Z), (1, 0), (0, 1), 2 * HALF_X, 1)
    tiles(mats, side, 0.9, 2 * HALF_X - 0.9, 0.0, 0.9, 2 * HALF_Z - 0.9, 0.6)
    x, z = HALF_X - 0.9, HALF_Z - 0.9
    for x0, x1, z0, z1 in ((-HALF_X, HALF_X, -HALF_Z, -z), (-HALF_X, HALF_X, z, HALF_Z), (-HALF_X, -x, -z, z),
                           (x, HALF_X, -z, z)):
        mats["limestone"].quad((x0, 0, z1), (x1, 0, z1), (x1, 0, z0), (x0, 0, z0), (0, 1, 0))
    for step in SIDES:
        step.box(mats["limestone"], (0.36, 0, -0.66), (step.length - 0.36, 0.15, -0.36))


def stairs(mats):
    """The stairs from the court up to the middle bay of one short side, with a rail of bronze."""
    count, run, half = 30, 0.26, 0.95
    rise, end = FLOORS[1] / count, HALF_X - 0.42
    for k in range(count):
        x = end - (count - k) * run
        mats["marble"].box((x - 0.03, k * rise + rise - 0.05, -half), (x + run, (k + 1) * rise, half))
        mats["limestone"].box((x, max(k * rise - 0.55, 0), -half + 0.06), (x + run, (k + 1) * rise - 0.05, half - 0.06))
        for z in (-half + 0.08, half - 0.08):
            mats["bronze"].lathe((x + run / 2, (k + 1) * rise, z), [(0.022, 0.0), (0.022, 0.86)], 6)
    for z in (-half + 0.08, half - 0.08):
        x0, y0, x1, y1 = end - count * run, rise + 0.8, end, FLOORS[1] + 0.86

        def point(u, v):
            a = 2 * math.pi * v
            return (x0 + (x1 - x0) * u, y0 + (y1 - y0) * u + 0.05 * math.cos(a), z + 0.05 * math.sin(a))

        mats["bronze"].grid(point, lambda u, v: (0, math.cos(2 * math.pi * v), math.sin(2 * math.pi * v)), 1, 10)
        mats["marble"].box((x0 - 0.5, 0, z - 0.2), (x0 - 0.1, 1.1, z + 0.2))
        mats["mirror"].sphere((x0 - 0.3, 1.3, z), 0.2, 24, 12)


def cloth(mesh, side, s, floor, width, length, phase):
    """A cloth that hangs from a cornice before the arcade, in folds that widen downwards."""
    def point(u, v):
        fold = (0.05 + 0.09 * v) * math.sin(7 * math.pi * u + phase) + 0.12 * v * v * math.sin(2.2 * u + phase)
        narrow = 1 - 0.08 * math.sin(math.pi * v)
        sag = 0.12 * math.cos(2 * math.pi * u + phase) * v
        return side.at(s + (u - 0.5) * width * narrow, floor - length * v + sag, -0.55 - abs(0.12 * v) + fold)

    def normal(u, v):
        h = 1e-4
        return unit(cross(sub(point(u + h, v), point(u - h, v)), sub(point(u, v + h), point(u, v - h))))

    mesh.grid(point, normal, 36, 14)


def plant(mats, x, y, z, rng):
    """An urn with a bush of separate leaves."""
    mats["terracotta"].lathe((x, y, z), URN, 24)
    for _ in range(90):
        a, b, r = rng.uniform(0, 2 * math.pi), rng.uniform(-0.2, 1.4), rng.uniform(0.35, 0.62)
        out = (math.cos(b) * math.cos(a), math.sin(b), math.cos(b) * math.sin(a))
        base = tuple(p + r * o for p, o in zip((x, y + 1.45, z), out))
        across = unit(cross(out, (rng.uniform(-1, 1), 1, rng.uniform(-1, 1))))
        tip = tuple(p + 0.26 * o + (-0.1 if k == 1 else 0) for k, (p, o) in enumerate(zip(base, out)))
        left = tuple((p + q) / 2 + 0.07 * w for p, q, w in zip(base, tip, across))
        right = tuple((p + q) / 2 - 0.07 * w for p, q, w in zip(base, tip, across))
        mats["foliage"].quad(base, right, tip, left)


def statue(mats, x, y, z, turn):
    """A draped figure on a plinth."""
    mats["limestone"].box((x - 0.42, y, z - 0.42), (x + 0.42, y + 0.15, z + 0.42))
    mats["limestone"].box((x - 0.34, y + 0.15, z - 0.34), (x + 0.34, y + 0.95, z + 0.34))
    mats["marble"].box((x - 0.4, y + 0.95, z - 0.4), (x + 0.4, y + 1.05, z + 0.4))
    base = y + 1.05

    def radius(v):
        k = min(int(v * (len(FIGURE) - 1)), len(FIGURE) - 2)
        f = v * (len(FIGURE) - 1) - k
        return tuple(p + (q - p) * f for p, q in zip(FIGURE[k], FIGURE[k + 1]))

    def point(u, v):
        a = 2 * math.pi * u
        r, h = radius(v)
        r *= 1 + 0.1 * (1 - v) * math.sin(9 * a + 5 * v) + 0.25 * v * math.cos(2 * (a - turn))
        return (x + r * math.sin(a) + 0.06 * math.sin(3 * v + turn), base + h, z + r * math.cos(a))

    def normal(u, v):
        h = 1e-4
        return unit(cross(sub(point(u + h, v), point(u - h, v)), sub(point(u, min(v + h, 1)), point(u, max(v - h, 0)))))

    mats["marble"].grid(point, normal, 36, 21)
    mats["marble"].sphere((x + 0.06 * math.sin(3 + turn), base + 1.82, z), 0.15, 16, 10)


def fountain(mats, x, z):
    """A basin of clear glass water, a bowl, and a mirror sphere on top."""
    rim = [(2.0, 0.0), (2.0, 0.12), (1.86, 0.16), (1.86, 0.5), (2.0, 0.56), (2.0, 0.66), (1.68, 0.66), (1.68, 0.12)]
    mats["marble"].lathe((x, 0, z), rim, 48)
    mats["tile_dark"].lathe((x, 0.12, z), [(0.0, 0.0), (1.68, 0.0)][::-1], 48)

    def water(u, v):
        r, a = 1.68 * v, 2 * math.pi * u
        return (x + r * math.sin(a), 0.54 + 0.018 * math.sin(16 * r) * math.exp(-0.8 * r), z + r * math.cos(a))

    def up(u, v):
        r, a = 1.68 * v, 2 * math.pi * u
        slope = 0.018 * math.exp(-0.8 * r) * (16 * math.cos(16 * r) - 0.8 * math.sin(16 * r))
        return unit((-slope * math.sin(a), 1, -slope * math.cos(a)))

    mats["glass"].grid(water, up, 36, 24)
    stem = [(0.40, 0.12), (0.34, 0.3), (0.16, 0.5), (0.13, 0.95), (0.2, 1.1), (0.6, 1.3), (0.88, 1.52), (0.92, 1.6),
            (0.84, 1.6), (0.55, 1.42), (0.12, 1.38), (0.10, 1.72)]
    mats["marble"].lathe((x, 0, z), stem, 32)
    mats["mirror"].sphere((x, 2.08, z), 0.4, 40, 20)


def lantern(mats, x, y, z):
    mats["bronze"].box((x - 0.012, y, z - 0.012), (x + 0.012, y + 1.3, z + 0.012))
    mats["bronze"].lathe((x, y - 0.42, z), [(0.02, 0.0), (0.13, 0.06), (0.13, 0.09)], 10)
    mats["bronze"].lathe((x, y - 0.1, z), [(0.19, 0.0), (0.06, 0.1), (0.02, 0.14)], 10)
    mats["lamp"].sphere((x, y - 0.22, z), 0.1, 10, 6)


def furnish(mats):
    rng = random.Random(1)
    fountain(mats, -4.2, 0)
    for x in (-8.2, -0.6):
        for z in (-4.2, 4.2):
            plant(mats, x, 0, z, rng)
    for x, z, turn in ((2.6, -4.4, 0.3), (2.6, 4.4, 2.6), (6.4, -4.4, 1.2), (6.4, 4.4, 1.9)):
        statue(mats, x, 0, z, turn)
    mats["limestone"].box((-9.0, 0, -0.45), (-8.1, 0.9, 0.45))
    mats["glass"].sphere((-8.55, 1.42, 0), 0.52, 48, 24)
    mats["bronze"].lathe((-8.55, 0.9, 0), [(0.3, 0.0), (0.2, 0.06), (0.22, 0.14)], 24)
    top = FLOORS[1] - 0.3
    for k, (side, bay) in enumerate(((0, 1.5), (0, 5.5), (1, 2.5), (1, 6.5), (2, 2.5))):
        name = ("cloth_red", "cloth_blue", "cloth_gold")[k % 3]
        cloth(mats[name], SIDES[side], bay * SIDES[side].bay, top + 0.05 + (5.2 if k % 2 else 0.0), 1.5, 3.3, 1.3 * k)
    for side in SIDES:
        for bay in range(0, side.bays, 2):
            for floor in FLOORS:
                x, y, z = side.at((bay + 0.5) * side.bay, floor + 3.4, 0.5 * WALK)
                lantern(mats, x, y, z)


def make():
    scene = Scene()
    mats = materials(scene)
    court(mats)
    galleries(mats)
    arcades(mats)
    stairs(mats)
    furnish(mats)
    scene.add_sun((0.42, -1, 0.28), (1.0, 0.94, 0.84), 5.0)  # shines through the open court
    scene.add_view((-9.2, 7.5, 5.4), (2.2, 2.6, -1.6), 65)
    scene.add_view((-9.4, 1.9, 1.9), (4.0, 3.4, -0.7), 65)
    scene.add_view((8.7, 1.8, -3.1), (-3.2, 3.0, -1.2), 72)
    scene.add_view((1.25, 7.5, -6.75), (-2.6, 4.2, 3.0), 78)
    scene.add_view((2.0, 27.0, 4.6), (-0.2, 1.0, -0.4), 46)
    return scene


if __name__ == "__main__":
    run(make, __doc__.splitlines()[0], os.path.join("build", "scenes", "atrium.glb"))
