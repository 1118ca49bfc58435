#!/usr/bin/env python3
"""Compares ballot.RaycastingScene with Open3D's class and with embreex through trimesh, all in one run.

Needs Ballot's package, `pip install ./engine/api/python`. The others are left out if they are missing:
`pip install open3d embreex trimesh`. The mesh is a bumpy sphere. One million rays come from a camera, and as many are
random. The set-up of each library is timed first. For each kind of ray, one call warms each library up; then they take
turns. Prints medians and, for Ballot, the time that the device itself took. For a comparison on equal terms, give all
the same cores:

    taskset -c 0,1 env LP_NUM_THREADS=2 python3 tests/speed/python_compare.py
"""

import argparse
import os
import statistics
import sys
import time

import numpy as np


def bumpy_sphere(triangles: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns a closed mesh of about this many triangles: a sphere with bumps, vertices (n, 3) and triangles (m, 3)."""
    rings = max(4, int(np.sqrt(triangles / 4)))
    around = 2 * rings
    theta = np.linspace(0, np.pi, rings + 1)[:, None]
    phi = np.linspace(0, 2 * np.pi, around, endpoint=False)[None, :]
    radius = 1 + 0.08 * np.sin(9 * theta) * np.cos(11 * phi)
    points = np.stack(
        [radius * np.sin(theta) * np.cos(phi), radius * np.cos(theta) + 0 * phi, radius * np.sin(theta) * np.sin(phi)],
        axis=-1,
    )
    index = np.arange((rings + 1) * around).reshape(rings + 1, around)
    a, b = index[:-1], np.roll(index[:-1], -1, axis=1)
    c, d = index[1:], np.roll(index[1:], -1, axis=1)
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([b, d, c], -1).reshape(-1, 3)])
    return points.reshape(-1, 3).astype(np.float32), faces.astype(np.uint32)


def camera_rays(count: int) -> np.ndarray:
    side = int(np.sqrt(count))
    x, y = np.meshgrid((np.arange(side) + 0.5) / side * 2 - 1, (np.arange(side) + 0.5) / side * 2 - 1)
    rays = np.empty((side, side, 6), np.float32)
    rays[..., :3] = 0, 0, 3
    rays[..., 3], rays[..., 4], rays[..., 5] = 0.45 * x, -0.45 * y, -1
    return rays.reshape(-1, 6)


def random_rays(count: int) -> np.ndarray:
    """Returns rays in no order, from points of a sphere around the mesh to points of a cube about its centre."""
    random = np.random.default_rng(7)
    origins = random.normal(size=(count, 3))
    origins *= 2 / np.linalg.norm(origins, axis=1, keepdims=True)
    targets = random.uniform(-0.8, 0.8, size=(count, 3))
    return np.concatenate([origins, targets - origins], axis=1).astype(np.float32)


class Ballot:
    name = "ballot.RaycastingScene.cast_rays"

    def __init__(self, vertices, faces):
        import ballot

        self.scene = ballot.RaycastingScene(device=ballot.default_device())
        self.scene.add_triangles(vertices, faces)
        self.scene._built()
        self.device_ms = []

    def cast(self, rays):
        answer = self.scene.cast_rays(rays)
        self.device_ms.append(self.scene.times.device_ms)
        return answer["t_hit"], answer["primitive_ids"]


class Open3D:
    name = "open3d RaycastingScene.cast_rays"

    def __init__(self, vertices, faces):
        import open3d

        self.tensor = open3d.core.Tensor.from_numpy
        self.scene = open3d.t.geometry.RaycastingScene()
        self.scene.add_triangles(self.tensor(vertices), self.tensor(faces))
        self.scene.test_occlusions(self.tensor(np.zeros((1, 6), np.float32)))  # it builds at the first call

    def cast(self, rays):
        answer = self.scene.cast_rays(self.tensor(rays))
        return answer["t_hit"].numpy(), answer["primitive_ids"].numpy()


class Embreex:
    name = "trimesh with embreex, intersects_first"

    def __init__(self, vertices, faces):
        import trimesh
        from trimesh.ray.ray_pyembree import RayMeshIntersector

        self.ray = RayMeshIntersector(trimesh.Trimesh(vertices, faces, process=False))
        self.ray.intersects_first(np.zeros((1, 3)), np.ones((1, 3)))

    def cast(self, rays):
        first = self.ray.intersects_first(np.float64(rays[:, :3]), np.float64(rays[:, 3:]))
        return None, np.where(first < 0, np.uint32(0xFFFFFFFF), first.astype(np.uint32))


def judge(scene, rays, prims, others):
    """Returns the number of rays for which prims and others differ. Of these rays, it also returns for how many the
    exact answer is that of prims, and for how many that of others."""
    differ = np.flatnonzero(prims != others)
    exact = scene.trace(rays[differ], numeric="exact")["prim"]
    return len(differ), np.count_nonzero(exact == prims[differ]), np.count_nonzero(exact == others[differ])


def set_up(kinds, mesh, repeats):
    """Returns an instance of each library that is installed, and the medians of its set-up seconds."""
    made = []
    for kind in kinds:
        try:
            kind(*mesh)
        except ImportError as error:
            print(f"left out: {kind.name}: {error}")
            continue
        seconds = []
        for _ in range(repeats):
            begin = time.perf_counter()
            instance = kind(*mesh)
            seconds.append(time.perf_counter() - begin)
        made.append((instance, statistics.median(seconds)))
    return made


def measure(libraries, rays, repeats):
    """Returns each library's median seconds for the rays, and its answers. The libraries take turns."""
    seconds = [[] for _ in libraries]
    answers = [library.cast(rays) for library in libraries]
    for library in libraries:
        library.device_ms = []
    for _ in range(repeats):
        for library, taken in zip(libraries, seconds):
            begin = time.perf_counter()
            library.cast(rays)
            taken.append(time.perf_counter() - begin)
    return [statistics.median(s) for s in seconds], answers


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--triangles", type=int, default=100_000)
    parser.add_argument("--rays", type=int, default=1_000_000)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    mesh = bumpy_sphere(options.triangles)
    import ballot

    device = ballot.default_device().info
    print(
        f"{device.name}, {device.driver}; {len(os.sched_getaffinity(0))} cores, LP_NUM_THREADS="
        f"{os.environ.get('LP_NUM_THREADS', 'unset')}; {len(mesh[1])} triangles, Python {sys.version.split()[0]}"
    )
    made = set_up([Ballot, Open3D, Embreex], mesh, options.repeats)
    libraries = [library for library, _ in made]
    print(f"\n{'set-up':44}{'seconds':>10}")
    for library, seconds in made:
        print(f"{library.name:44}{seconds:10.3f}")
    for what, rays in (("camera rays", camera_rays(options.rays)), ("random rays", random_rays(options.rays))):
        seconds, answers = measure(libraries, rays, options.repeats)
        print(f"\n{what:44}{'seconds':>10}{'Mrays/s':>10}{'same prim':>11}")
        for library, taken, (_, prims) in zip(libraries, seconds, answers):
            same = np.mean(prims == answers[0][1])
            print(f"{library.name:44}{taken:10.3f}{len(rays) / taken / 1e6:10.2f}{same:11.6f}")
            if library is not libraries[0]:
                count, ours, theirs = judge(libraries[0].scene._built(), rays, answers[0][1], prims)
                print(f"  {count} differ; the exact answer is Ballot's for {ours}, the other's for {theirs}")
            if getattr(library, "device_ms", None):
                ms = statistics.median(library.device_ms)
                print(
                    f"{'  of it on the device':44}{ms / 1e3:10.3f}{len(rays) / ms / 1e3:10.2f}"
                    f"   whole / device = {taken * 1e3 / ms:.2f}"
                )


if __name__ == "__main__":
    main()
