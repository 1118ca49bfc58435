#!/usr/bin/env python3
"""The Python package's speed on one device: from NumPy arrays to hits, latencies, arrays on the device. Medians.

    python3 tests/speed/python_speed.py scene.glb --device gpu --size 4096
"""

import argparse
import statistics
import time

import ballot
import numpy as np


def median_ms(work, repeats: int) -> float:
    work()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        times.append((time.perf_counter() - begin) * 1e3)
    return statistics.median(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("--device", default="")
    parser.add_argument("--size", type=int, default=1024, help="pixels of a side of the primary rays")
    parser.add_argument("--repeats", type=int, default=7)
    options = parser.parse_args()
    device = ballot.Device(options.device)
    print(f"{device.info.name}, {device.info.driver}; medians of {options.repeats}")
    scene = ballot.load_scene(options.scene, device)
    rays = scene.make_rays(None, "primary", options.size, options.size)
    for count in (1, 1000, 1_000_000, len(rays)):
        some = np.ascontiguousarray(rays[:count])
        out = np.zeros(len(some), ballot.HIT)
        ms = median_ms(lambda: scene.trace(some, out=out), options.repeats)  # noqa: B023
        print(f"{'trace, NumPy arrays':34}{len(some):10} rays {ms:9.3f} ms {len(some) / ms / 1e3:9.1f} Mrays/s")
    for count in (1, 1000, 1_000_000):
        source, hits = ballot.Array("rays", count, device=device), ballot.Array("hits", count, device=device)
        source.write(np.ascontiguousarray(rays[:count]))
        ms = median_ms(lambda: scene.trace(source, out=hits), 4 * options.repeats)  # noqa: B023
        print(f"{'trace, arrays on the device':34}{count:10} rays {ms:9.3f} ms {count / ms / 1e3:9.1f} Mrays/s")


if __name__ == "__main__":
    main()
