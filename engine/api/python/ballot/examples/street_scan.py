"""A street scanned by lidar from a car that drives along it, as a picture whose colours are those of returns: blue to
white first ones by height, orange second ones, red the others, of leaves that a beam meets on its way.

>>> cloud = scan(street(trees=4, leaves=500), stops=2, columns=200)
>>> len(cloud) > 10000, int(cloud["return_number"].max()) > 1
(True, True)
>>> picture(cloud, 64, 36).shape
(36, 64, 4)
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

import ballot
from ballot import sensors


def street(trees: int = 14, leaves: int = 2500, seed: int = 4) -> ballot.Scene:
    """Returns a street along x: houses and cars are boxes, trunks capsules, leaves discs."""
    random = np.random.default_rng(seed)
    boxes: Any = [[(-80, -20, -0.5), (80, 20, 0)], [(-80, 5, 0), (80, 20, 0.15)], [(-80, -20, 0), (80, -5, 0.15)]]
    for side in (-1, 1):
        x = -60.0
        while x < 60:
            wide, high, front = random.uniform(7, 14), random.uniform(6, 15), random.uniform(9, 11)
            boxes.append([(x, side * front, 0), (x + wide, side * 20, high)])
            x += wide + random.choice([0, 0, 2.5])
        for at in random.uniform(-50, 50, 6):
            boxes.append([(at, side * 3.1, 0.3), (at + 4.3, side * 4.7, 0.9)])
            boxes.append([(at + 1, side * 3.2, 0.9), (at + 3.4, side * 4.6, 1.5)])
    place = np.stack([np.linspace(-50, 50, trees), np.where(np.arange(trees) % 2, 6.8, -6.8), np.zeros(trees)], -1)
    top = place + (0, 0, 4.5)
    crown = random.normal(size=(trees, leaves, 3)) * (1.1, 1.1, 0.9) + top[:, None] + (0, 0, 1.2)
    facing = random.normal(size=(trees * leaves, 3))
    corners = np.sort(np.array(boxes, np.float32), axis=1)
    trunks = ballot.capsules(np.stack([place, top], 1).reshape(-1, 3), np.tile([0.2, 0.1], trees))
    leaf = ballot.discs(crown.reshape(-1, 3), facing, 0.09)
    return ballot.Scene(meshes=[ballot.boxes(corners[:, 0], corners[:, 1]), trunks, leaf])


def scan(scene: ballot.Scene, stops: int = 24, columns: int = 1800) -> np.ndarray:
    """Returns the returns of a lidar of 64 channels on the roof of a car, at stops along the street."""
    poses = np.tile(np.eye(3, 4), (stops, 1, 1))
    poses[:, 0, 3], poses[:, 1, 3], poses[:, 2, 3] = np.linspace(-30, 30, stops), -1.5, 2.0
    lidar = sensors.spinning(np.deg2rad(np.linspace(-25, 35, 64)), columns, near=1, far=60, divergence=3e-3, rays=7)
    return lidar.scan(scene, poses, returns=3, resolution=0.8, fields=("xyz", "intensity", "return_number"))


def picture(cloud: np.ndarray, width: int = 1280, height: int = 720) -> ballot.Picture:
    """Draws points as seen from above the street's beginning, the nearest of each pixel in front."""
    at = np.stack([cloud[axis] for axis in "xyz"], -1) - np.array([-44, -3, 13], np.float32)
    ahead = np.array([0.938, 0.06, -0.341], np.float32)
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right)
    depth, u, v = at @ ahead, at @ right, at @ np.cross(ahead, right)
    x, y = (np.nan_to_num(0.9 * width * a / np.maximum(depth, 0.1)) for a in (u, v))
    up = np.clip(cloud["z"] / 14, 0, 1)[:, None]
    shade = (1 - up) * [0.03, 0.10, 0.25] + up * [0.85, 0.9, 0.95]
    number = cloud["return_number"][:, None]
    shade = np.where(number == 2, [1.0, 0.35, 0.02], np.where(number > 2, [0.9, 0.02, 0.05], shade))
    shade = shade * (0.35 + 0.65 * np.sqrt(cloud["intensity"][:, None]))
    image = np.full((height, width, 4), (0.004, 0.005, 0.008, 1), np.float32)
    order = np.argsort(-depth)
    column, row = (x + width / 2).astype(int), (y + height / 2).astype(int)
    for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):  # near points cover four pixels
        c, r, near = column[order] + i, row[order] + j, depth[order] < (60 if i + j else np.inf)
        seen = near & (depth[order] > 1) & (c >= 0) & (c < width) & (r >= 0) & (r < height)
        image[r[seen], c[seen], :3] = shade[order][seen]
    return image.view(ballot.Picture)


if __name__ == "__main__":
    path, stops = (*sys.argv[1:], *("street_scan.png", "24")[len(sys.argv) - 1 :])
    points = scan(street(), int(stops))
    picture(points).to_png(path)
    print(f"{path}: {len(points)} returns, of which {np.mean(points['return_number'] > 1):.1%} are not the first")
