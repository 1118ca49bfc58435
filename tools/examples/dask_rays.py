#!/usr/bin/env python3
"""Traces rays on several machines: a dask array of rays in chunks, mapped over workers.

A scene is pickled with its meshes, so each worker makes its own from them once; rays travel to the workers and hits
back. Runs on a local cluster of two workers; on a real one give the address of its scheduler.

  python3 tools/examples/dask_rays.py                        # needs: pip install dask distributed
  python3 tools/examples/dask_rays.py tcp://scheduler:8786
"""
# mypy: allow-untyped-calls
# pyright: reportArgumentType=false
# dask's own types are not complete.

import sys

import ballot
import dask.array
import numpy as np
from dask.distributed import Client, LocalCluster

RAYS, CHUNK = 200_000, 25_000


def wave(n: int) -> tuple[np.ndarray, np.ndarray]:
    """A wavy grid of 2 n^2 triangles over [0, 1]^2."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1, dtype=np.float32), np.linspace(0, 1, n + 1, dtype=np.float32))
    vertices = np.stack([x, y, 0.1 * np.sin(9 * x) * np.cos(7 * y)], -1).reshape(-1, 3)
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    quads = np.stack([a, a + 1, a + n + 1, a + n + 1, a + 1, a + n + 2], -1)
    return vertices.astype(np.float32), quads.reshape(-1, 3).astype(np.uint32)


def trace(rays: np.ndarray, scene: ballot.Scene) -> np.ndarray:
    return scene.trace(rays)


def main() -> None:
    scene = ballot.Scene(*wave(100))
    rng = np.random.default_rng(1)
    rays = np.zeros((RAYS, 6), np.float32)
    rays[:, :2] = rng.random((RAYS, 2))
    rays[:, 2], rays[:, 5] = 1, -1
    with (Client(sys.argv[1]) if len(sys.argv) > 1 else
          Client(LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None))) as client:
        shared = client.scatter(scene, broadcast=True)
        chunks = dask.array.from_array(rays, chunks=(CHUNK, 6))
        hits = dask.array.map_blocks(trace, chunks, shared, dtype=ballot.HIT, drop_axis=1).compute()
        workers = len(client.scheduler_info()["workers"])
    here = scene.trace(rays)
    number = np.count_nonzero(hits["prim"] != ballot.MISS)
    print(f"{RAYS} rays in {RAYS // CHUNK} chunks over {workers} workers: {number} hits, "
          f"{np.count_nonzero(hits != here)} differ from one process")
    sys.exit(0 if np.array_equal(hits, here) else 1)


if __name__ == "__main__":
    main()
