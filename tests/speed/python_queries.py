#!/usr/bin/env python3
"""Measures point queries and queries for all crossings beside Open3D, in one run on the same arrays.

    python3 tests/speed/python_queries.py bunny.obj --points 1e6 --rays 5e5 --repeat 5

Points are those of a grid over the bounds, in rows of x, and random ones in and about the bounds. Rays start at random
points and go in random directions, or come from a camera, pixel by pixel. Each figure is the median over repeats, taken
in turn. Needs ballot, numpy and open3d.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Callable
from typing import Any

import ballot
import numpy as np
import open3d as o3d


def points_of(low: np.ndarray, high: np.ndarray, count: int) -> dict[str, np.ndarray]:
    side = max(2, round(count ** (1 / 3)))
    room = 0.1 * (high - low)
    axes = [np.linspace(low[k] - room[k], high[k] + room[k], side, dtype=np.float32) for k in range(3)]
    z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    grid = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    random = np.random.default_rng(1).uniform(low - room, high + room, (len(grid), 3)).astype(np.float32)
    return {"grid": np.ascontiguousarray(grid), "random": random}


def rays_of(low: np.ndarray, high: np.ndarray, count: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(2)
    origins = rng.uniform(low, high, (count, 3))
    random = np.concatenate([origins, rng.normal(size=(count, 3))], axis=1).astype(np.float32)
    side = int(count**0.5)
    middle, size = 0.5 * (low + high), float(np.linalg.norm(high - low))
    eye = middle + size * np.array([0.3, 0.2, 0.9])
    camera = ballot.RaycastingScene.create_rays_pinhole(50.0, middle, eye, [0, 1, 0], side, side)
    return {"camera": np.ascontiguousarray(camera.reshape(-1, 6)), "random": random}


Pairs = dict[str, tuple[int, Callable[[], Any], Callable[[], Any]]]


def measure(pairs: Pairs, repeat: int, clock: Callable[[], float]) -> list[dict[str, Any]]:
    def seconds(call: Callable[[], Any]) -> float:
        begin = clock()
        call()
        return clock() - begin

    for _, ours, theirs in pairs.values():
        ours(), theirs()
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in pairs}
    for _ in range(repeat):
        for name, (_, ours, theirs) in pairs.items():
            times[name].append((seconds(ours), seconds(theirs)))
    records = []
    for name, (count, _, _) in pairs.items():
        ours, theirs = np.median(np.array(times[name]), axis=0)
        records.append(
            {"query": name, "count": count, "ballot": count / ours * 1e-6, "open3d": count / theirs * 1e-6,
             "ratio": theirs / ours}
        )  # fmt: skip
    return records


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh", help="a file that ballot.load_scene() takes")
    parser.add_argument("--points", type=float, default=1e6)
    parser.add_argument("--rays", type=float, default=5e5)
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--device", default="")
    parser.add_argument("--threads", type=int, default=0, help="of Open3D; 0: all cores")
    parser.add_argument("--cpu-time", action="store_true",
                        help="seconds of all threads of this process, for a machine with other work")  # fmt: skip
    parser.add_argument("--json", help="also write the figures to this file")
    options = parser.parse_args()
    device = ballot.Device(options.device)
    corners = ballot.load_scene(options.mesh, device, instances="copy").triangles()
    vertices, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    triangles = index.reshape(-1, 3).astype(np.uint32)
    ours = ballot.RaycastingScene(device=device)
    theirs = o3d.t.geometry.RaycastingScene(nthreads=options.threads)
    ours.add_triangles(vertices, triangles)
    theirs.add_triangles(o3d.core.Tensor(vertices), o3d.core.Tensor(triangles))
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    pairs: Pairs = {}
    for kind, p in points_of(low, high, int(options.points)).items():
        t = o3d.core.Tensor(p)
        pairs[f"closest point, {kind}"] = (
            len(p), lambda p=p: ours.compute_closest_points(p), lambda t=t: theirs.compute_closest_points(t))
        pairs[f"distance, {kind}"] = (
            len(p), lambda p=p: ours.compute_distance(p), lambda t=t: theirs.compute_distance(t))
        pairs[f"signed distance, {kind}"] = (
            len(p), lambda p=p: ours.compute_signed_distance(p, assume_closed=True),
            lambda t=t: theirs.compute_signed_distance(t, nsamples=1))  # fmt: skip
        pairs[f"occupancy, {kind}"] = (
            len(p), lambda p=p: ours.compute_occupancy(p, assume_closed=True),
            lambda t=t: theirs.compute_occupancy(t, nsamples=1))  # fmt: skip
    for kind, r in rays_of(low, high, int(options.rays)).items():
        t = o3d.core.Tensor(r)
        pairs[f"count, {kind} rays"] = (
            len(r), lambda r=r: ours.count_intersections(r), lambda t=t: theirs.count_intersections(t))
        pairs[f"list, {kind} rays"] = (
            len(r), lambda r=r: ours.list_intersections(r), lambda t=t: theirs.list_intersections(t))  # fmt: skip
    records = measure(pairs, options.repeat, time.process_time if options.cpu_time else time.perf_counter)
    info = device.info
    print(f"{options.mesh}: {len(triangles)} triangles; {info.name}, {info.driver}; {os.cpu_count()} cores; "
          f"Open3D {o3d.__version__}; million queries a second"
          + (" of CPU time" if options.cpu_time else ""))  # fmt: skip
    for r in records:
        print(f"  {r['query']:28} {r['count']:9} {r['ballot']:9.2f} {r['open3d']:9.2f}   x {r['ratio']:.2f}")
    if options.json:
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump({"mesh": options.mesh, "device": info.name, "driver": info.driver, "records": records}, file)


if __name__ == "__main__":
    main()
