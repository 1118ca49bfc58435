#!/usr/bin/env python3
"""Counts wrong answers of Ballot, Open3D, trimesh (with embreex) and libigl on the same queries, judged exactly.

    python3 tests/speed/python_truth.py bunny.glb sphere shells --queries 1e6 --slow 1e5

A mesh is a file that ballot.load_scene() takes, or a closed one that is made here: sphere, bumps, shells (nested and
touching boxes), far (the sphere 1e5 diameters away from zero), needles (a sphere stretched 1000 times). Rays go in
random directions or at vertices and edges; points are random, on the surface, and close to it. The judge is Ballot's
mode exact, which the tests hold to exact arithmetic over all triangles. The parity of a ray's crossings must
agree with the side on which it begins; neither parity nor inside is judged on the surface. A nearest triangle is wrong
if it is farther away than the exact one by more than 1e-12 of the distance to that one's farthest vertex, so that ties
do not count. trimesh and libigl answer --slow queries, trimesh a tenth of them for nearest triangles. Needs ballot,
numpy, open3d, trimesh, embreex, rtree and libigl.
"""

from __future__ import annotations

import argparse
import json
from typing import Any

import ballot
import igl
import numpy as np
import open3d as o3d
import trimesh

Mesh = tuple[np.ndarray, np.ndarray]


def icosphere(levels: int) -> Mesh:
    mesh = trimesh.creation.icosphere(subdivisions=levels)
    return mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32)


def box(low: tuple[float, ...], high: tuple[float, ...]) -> Mesh:
    mesh = trimesh.creation.box(bounds=[low, high])
    return mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32)


def joined(meshes: list[Mesh]) -> Mesh:
    first = np.cumsum([0] + [len(v) for v, _ in meshes])
    return (
        np.concatenate([v for v, _ in meshes]),
        np.concatenate([f + np.uint32(n) for (_, f), n in zip(meshes, first)]).astype(np.uint32),
    )


def mesh_of(name: str, device: ballot.Device) -> Mesh:
    if name == "shells":
        return joined([box((0, 0, 0), (4, 4, 4)), box((1, 1, 1), (3, 3, 3)), box((4, 0, 0), (6, 4, 4))])
    if name in ("sphere", "bumps", "far", "needles"):
        v, f = icosphere(5)
        if name == "bumps":
            v *= (1 + 0.2 * np.sin(7 * v[:, :1]) * np.sin(9 * v[:, 1:2] + 5 * v[:, 2:])).astype(np.float32)
        if name == "far":
            v += np.float32([2e5, -1e5, 3e4])
        if name == "needles":
            v *= np.float32([1000, 1, 1])
        return v, f
    corners = ballot.load_scene(name, device, instances="copy").triangles()
    vertices, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    triangles = index.reshape(-1, 3).astype(np.uint32)
    flat = (triangles == np.roll(triangles, 1, axis=1)).any(axis=1)
    return vertices, triangles[~flat]


def rays_of(mesh: Mesh, count: int, rng: np.random.Generator) -> np.ndarray:
    """Half of the rays go in random directions, a quarter each at vertices and at points of edges."""
    v, f = mesh
    low, high = v.min(axis=0), v.max(axis=0)
    origins = rng.uniform(low - 0.2 * (high - low), high + 0.2 * (high - low), (count, 3)).astype(np.float32)
    directions = rng.normal(size=(count, 3)).astype(np.float32)
    quarter = count // 4
    directions[:quarter] = v[rng.integers(0, len(v), quarter)] - origins[:quarter]
    edge = f[rng.integers(0, len(f), quarter)]
    share = rng.uniform(size=(quarter, 1)).astype(np.float32)
    on_edge = v[edge[:, 0]] * (1 - share) + v[edge[:, 1]] * share
    directions[quarter : 2 * quarter] = on_edge - origins[quarter : 2 * quarter]
    order = rng.permutation(count)
    return np.concatenate([origins, directions], axis=1)[order]


def points_of(mesh: Mesh, count: int, rng: np.random.Generator) -> np.ndarray:
    """Half of the points are random, a quarter lies on the surface up to rounding, a quarter close to it."""
    v, f = mesh
    low, high = v.min(axis=0), v.max(axis=0)
    points = rng.uniform(low - 0.1 * (high - low), high + 0.1 * (high - low), (count, 3))
    half = count // 2
    corners = v[f[rng.integers(0, len(f), half)]].astype(np.float64)
    weights = rng.dirichlet([1, 1, 1], half)
    surface = (corners * weights[:, :, None]).sum(axis=1)
    surface[: half // 2] += rng.normal(size=(half // 2, 3)) * 1e-4 * np.linalg.norm(high - low)
    points[:half] = surface
    return points[rng.permutation(count)].astype(np.float32)


def distances(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Returns the distance of each point from its triangle, in float64."""
    p, (a, b, c) = points.astype(np.float64), corners.astype(np.float64).transpose(1, 0, 2)
    best = np.full(len(p), np.inf)
    for u, w in ((a, b), (b, c), (c, a)):
        e = w - u
        s = np.clip(np.einsum("ij,ij->i", p - u, e) / np.einsum("ij,ij->i", e, e), 0, 1)
        best = np.minimum(best, np.linalg.norm(p - u - s[:, None] * e, axis=1))
    n = np.cross(b - a, c - a)
    over = np.ones(len(p), bool)
    for u, w in ((a, b), (b, c), (c, a)):
        over &= np.einsum("ij,ij->i", np.cross(n, w - u), p - u) >= 0
    with np.errstate(invalid="ignore", divide="ignore"):
        plane = np.abs(np.einsum("ij,ij->i", n, p - a)) / np.linalg.norm(n, axis=1)
    return np.where(over, np.minimum(best, plane), best)


class Judge:
    """The exact answers, and how many answers of others differ from them."""

    def __init__(self, mesh: Mesh, rays: np.ndarray, points: np.ndarray, device: ballot.Device):
        self.v, self.f = mesh
        scene = ballot.Scene(*mesh, device=device)
        self.counts = scene.count_crossings(rays, numeric="exact")
        starts = scene.nearest(rays[:, :3], ("distances", "inside"), numeric="exact", assume_closed=True)
        self.odd, self.apart = starts["inside"], starts["distances"] > 0
        near = scene.nearest(points, ("prims", "inside", "distances"), numeric="exact", assume_closed=True)
        self.inside, self.off, self.points = near["inside"], near["distances"] > 0, points
        corners = self.v[self.f[near["prims"]]]
        self.least = distances(points, corners)
        self.reach = np.linalg.norm(corners.astype(np.float64) - points[:, None], axis=2).max(axis=1)

    def wrong_counts(self, counts: np.ndarray) -> str:
        return self._text(counts != self.counts[: len(counts)])

    def wrong_parity(self, counts: np.ndarray) -> str:
        n = len(counts)
        return self._text((counts % 2 != self.odd[:n])[self.apart[:n]])

    def wrong_inside(self, inside: np.ndarray) -> str:
        n = len(inside)
        return self._text((np.asarray(inside, bool) != self.inside[:n])[self.off[:n]])

    def wrong_nearest(self, prims: np.ndarray) -> str:
        n = len(prims)
        far = distances(self.points[:n], self.v[self.f[prims]]) - self.least[:n]
        return self._text(far > 1e-12 * self.reach[:n])

    @staticmethod
    def _text(wrong: np.ndarray) -> str:
        return f"{int(wrong.sum())} of {len(wrong)}"


def ours(mesh: Mesh, rays: np.ndarray, points: np.ndarray, device: ballot.Device, numeric: str) -> tuple:
    scene = ballot.Scene(*mesh, device=device)
    near = scene.nearest(points, ("prims", "inside"), numeric=numeric, assume_closed=True)
    return scene.count_crossings(rays, numeric=numeric), near["prims"], near["inside"]


def open3d_answers(mesh: Mesh, rays: np.ndarray, points: np.ndarray) -> tuple:
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.core.Tensor(mesh[0]), o3d.core.Tensor(mesh[1]))
    p = o3d.core.Tensor(points)
    return (
        scene.count_intersections(o3d.core.Tensor(rays)).numpy(),
        scene.compute_closest_points(p)["primitive_ids"].numpy(),
        scene.compute_occupancy(p, nsamples=1).numpy() > 0.5,
    )


def trimesh_answers(mesh: Mesh, rays: np.ndarray, points: np.ndarray) -> tuple:
    m = trimesh.Trimesh(*mesh, process=False)
    if type(m.ray).__module__.rsplit(".", 1)[-1] != "ray_pyembree":
        raise SystemExit("trimesh does not use embreex")
    _, index = m.ray.intersects_id(rays[:, :3], rays[:, 3:], multiple_hits=True)
    nearest = trimesh.proximity.closest_point(m, points[: len(points) // 10])[2]
    return np.bincount(index, minlength=len(rays)), nearest, m.ray.contains_points(points)


def libigl_answers(mesh: Mesh, points: np.ndarray) -> tuple:
    v, f = mesh[0].astype(np.float64), mesh[1].astype(np.int64)
    p = points.astype(np.float64)
    prims = igl.point_mesh_squared_distance(p, v, f)[1]
    signs = igl.signed_distance(p, v, f, sign_type=igl.SIGNED_DISTANCE_TYPE_PSEUDONORMAL)[0]
    return prims, signs < 0


def judge_mesh(name: str, options: Any, device: ballot.Device) -> list[dict[str, str]]:
    rng = np.random.default_rng(4)
    mesh = mesh_of(name, device)
    rays, points = rays_of(mesh, int(options.queries), rng), points_of(mesh, int(options.queries), rng)
    few = int(options.slow)
    judge = Judge(mesh, rays, points, device)
    answers = {
        "Ballot, exact": lambda: ours(mesh, rays, points, device, "exact"),
        "Ballot, watertight": lambda: ours(mesh, rays, points, device, "watertight"),
        "Open3D": lambda: open3d_answers(mesh, rays, points),
        "trimesh, embreex": lambda: trimesh_answers(mesh, rays[:few], points[:few]),
        "libigl": lambda: (None, *libigl_answers(mesh, points[:few])),
    }
    records = []
    for who, ask in answers.items():
        counts, prims, inside = ask()
        records.append({
            "mesh": name,
            "who": who,
            "counts": "-" if counts is None else judge.wrong_counts(counts),
            "parity": "-" if counts is None else judge.wrong_parity(counts),
            "nearest": judge.wrong_nearest(prims),
            "inside": judge.wrong_inside(inside),
        })  # fmt: skip
        print("| " + " | ".join(records[-1].values()) + " |", flush=True)
    return records


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("meshes", nargs="+")
    parser.add_argument("--queries", type=float, default=1e6, help="rays, and points")
    parser.add_argument("--slow", type=float, default=1e5,
                        help="queries of trimesh and libigl; trimesh finds nearest triangles for a tenth")  # fmt: skip
    parser.add_argument("--device", default="")
    parser.add_argument("--json", help="also write the figures to this file")
    options = parser.parse_args()
    device = ballot.Device(options.device)
    print(f"{device.info.name}, {device.info.driver}; Open3D {o3d.__version__}, trimesh {trimesh.__version__}")
    print("| mesh | by | wrong number of crossings | wrong parity | wrong nearest triangle | wrong inside |\n"
          "| --- | --- | ---: | ---: | ---: | ---: |")
    records = [r for name in options.meshes for r in judge_mesh(name, options, device)]
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump(records, file)


if __name__ == "__main__":
    main()
