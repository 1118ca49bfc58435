"""Measures triangles that overlap boxes, and distances of scenes, from Python.

    python3 tests/speed/python_boxes.py SCENE [--cells N] [--other SCENE] [--poses N] [--size S] [--device NAME]

Boxes are cubic cells of the scene's bounds, N along the longest side. The other scene is turned at random, scaled to S
times the scene's size, and placed at random in its bounds. Medians of 5 calls behind a first one; rates of whole calls,
and of the device.
"""

import argparse
import time

import ballot
import numpy as np


def cells_of(scene, count):
    lo, hi = np.array(scene.info.lo), np.array(scene.info.hi)
    side = (hi - lo).max() / count
    axes = np.indices(np.maximum(1, np.ceil((hi - lo) / side)).astype(int))
    low = np.float32(lo + axes.transpose(1, 2, 3, 0) * side).reshape(-1, 3)
    return low, low + np.float32(side)


def poses_of(scene, other, count, size):
    rng = np.random.default_rng(3)
    lo, hi = np.array(scene.info.lo), np.array(scene.info.hi)
    middle = (np.array(other.info.lo) + other.info.hi) / 2
    scale = size * (hi - lo).max() / (np.array(other.info.hi) - other.info.lo).max()
    turned, _ = np.linalg.qr(rng.normal(size=(count, 3, 3)))
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = turned * scale
    poses[:, :3, 3] = lo + rng.uniform(size=(count, 3)) * (hi - lo) - poses[:, :3, :3] @ middle
    return poses


def measured(call):
    spent = []
    for _ in range(6):
        times, begin = [], time.perf_counter()
        found = call(times)
        spent.append((time.perf_counter() - begin, times[0].device_ms / 1e3))
    return found, *np.median(spent[1:], axis=0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("--cells", type=int, default=128)
    parser.add_argument("--other")
    parser.add_argument("--poses", type=int, default=300)
    parser.add_argument("--size", type=float, default=0.05)
    parser.add_argument("--device")
    options = parser.parse_args()
    device = ballot.Device(options.device) if options.device else ballot.Device()
    scene = ballot.load_scene(options.scene, device=device)
    print(f"{device.info.name}, {options.scene}: {scene.info.triangles} triangles")
    low, high = cells_of(scene, options.cells)
    counts, seconds, there = measured(lambda times: scene.count_overlapping(low, high, times=times))
    print(
        f"{len(low)} boxes, {np.count_nonzero(counts)} with triangles, {counts.sum()} pairs: "
        f"{len(low) / seconds / 1e6:.1f} M/s, device {len(low) / there / 1e6:.1f} M/s"
    )
    if not options.other:
        return
    other = ballot.load_scene(options.other, device=device)
    poses = poses_of(scene, other, options.poses, options.size)
    found, seconds, _ = measured(lambda times: scene.clearance(other, poses=poses, times=times))
    print(
        f"{options.poses} poses of {options.other} ({other.info.triangles} triangles), "
        f"{np.count_nonzero(found['distances'] == 0)} touch: {1e3 * seconds / options.poses:.2f} ms each"
    )


if __name__ == "__main__":
    main()
