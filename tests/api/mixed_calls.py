#!/usr/bin/env python3
"""Threads that mix calls of every kind on one device: each answer has to be the one of before the threads, bit for bit,
and memory has to stay flat.

    build/release/python/venv/bin/python tests/api/mixed_calls.py --minutes 10

Prints the memory of the process each half minute: the least and the most of it. Fails if after the first minute the
least grows by more than --growth. It starts itself anew with one arena of glibc (MALLOC_ARENA_MAX=1): several, one a
thread, fragment, and keep some 16 MiB more after ten minutes although no more is in use.
"""

import argparse
import os
import random
import sys
import threading
import time
from collections import Counter
from pathlib import Path

import ballot
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "engine/api/python/tests"))
import reference as ref

SIZES = (1, 40, 700, 6000)
LONG = 300_000  # questions of a call that is ended
COLUMNS = ("t", "prims", "mesh_ids", "uvs", "normals", "occluded", "instances")
NEAREST = ("distances", "points", "prims", "mesh_ids", "uvs", "normals")
SIGNED = ("distances", "inside", "signed_distances")


def resident() -> float:
    """Returns the memory of this process in MiB."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def placed(*steps: float) -> np.ndarray:
    """Returns the matrices of instances in a row along x, the later ones larger."""
    matrices = np.zeros((len(steps), 3, 4), np.float32)
    for i, step in enumerate(steps):
        matrices[i, :, :3] = np.eye(3) * (1 + 0.25 * i)
        matrices[i, 0, 3] = step
    return matrices


def frozen(answer) -> list:
    """Returns the bytes of an answer's arrays."""
    if isinstance(answer, dict):
        answer = [answer[name] for name in sorted(answer)]
    return [np.asarray(part).tobytes() for part in (answer if isinstance(answer, (tuple, list)) else [answer])]


def there(device, kind: str, given):
    """Returns an array on the device."""
    array = ballot.Array(kind, len(given), device)
    array.write(given)
    return array


def read(arrays: dict) -> dict:
    return {name: array.read() for name, array in arrays.items()}


KERNEL = """
readonly buffer Rays { Ray rays[]; };
buffer Hits { Hit hits[]; };
void main(uint index) { hits[index] = nearest(rays[index]); }
"""


def by_kernel(kernel, scene, rays) -> np.ndarray:
    hits = np.zeros(len(rays), ballot.HIT)
    kernel(scene, len(rays), {"rays": np.minimum(rays, np.float32(3e38)), "hits": hits})
    return hits


def of_lists(lists) -> list:
    """Returns what the arrays of lists on the device hold."""
    return [array.read() for array in lists if array is not None]


def alone(scene, hits) -> list:
    """Returns the hits of an array that are no misses, with their rays."""
    found, rays, number = scene.compact(hits)
    return [found.read(count=number), rays.read(count=number)]


def ray_calls(device, scene, rays) -> dict:
    """Returns calls that ask about rays (n, 6)."""
    kernel, records = ballot.Kernel(KERNEL, device=device), scene_rays(rays)
    at, to, wide = rays[:, :3], rays[:, 3:], rays.astype(np.float64)
    masks = np.arange(len(rays), dtype=np.uint32) % 4
    strided = np.repeat(rays, 2, axis=0)[::2]
    return {
        "trace": lambda: scene.trace(rays),
        "trace float64": lambda: scene.trace(wide),
        "trace strided": lambda: scene.trace(strided),
        "trace by columns": lambda: scene.trace(origins=at, directions=to, t=(0.5, 4)),
        "trace from one origin": lambda: scene.trace(origins=at[0], directions=to, t=(0, np.full(len(to), 3.5))),
        "trace exact": lambda: scene.trace(rays, numeric="exact"),
        "trace, told": lambda: scene.trace(rays, progress=lambda done: True),
        "columns": lambda: scene.trace_columns(rays, COLUMNS),
        "columns of out": lambda: scene.trace_columns(rays, ("t",), out={"t": np.zeros(len(rays), np.float32)}),
        "occluded": lambda: scene.occluded(rays),
        "occluded by columns": lambda: scene.occluded(origins=at, directions=to, t=(0, 2)),
        "submit": lambda: scene.submit(rays).wait(),
        "arrays": lambda: scene.trace(there(device, "rays", records)).read(),
        "arrays, columns": lambda: read(scene.trace_columns(there(device, "rays", records), COLUMNS)),
        "arrays, first by masks": lambda: scene.trace(
            there(device, "rays", records), first=2, masks=there(device, "uint32", masks)
        ).read(),
        "arrays, counts": lambda: scene.count_crossings(there(device, "rays", records)).read(),
        "arrays, lists": lambda: of_lists(scene.crossings(there(device, "rays", records))),
        "arrays, hits alone": lambda: alone(scene, scene.trace(there(device, "rays", records))),
        "poses": lambda: scene.trace(ballot.Pattern(to[:90], at[0]), poses=placed(0, 0.5, 1)),
        "kernel": lambda: by_kernel(kernel, scene, records),
        "counts": lambda: scene.count_crossings(rays),
        "counts by masks": lambda: scene.count_crossings(rays, masks=masks, cull="back"),
        "crossings": lambda: scene.crossings(rays),
        "first crossings": lambda: scene.crossings(rays, first=2, cull="front"),
        "crossings by masks": lambda: scene.crossings(wide, masks=masks, numeric="exact"),
    }


def scene_rays(rays) -> np.ndarray:
    """Returns rays (n, 6) as records (n, 8)."""
    ends = np.zeros((len(rays), 1), np.float32)
    return np.hstack([rays[:, :3], ends, rays[:, 3:], ends + np.inf])


def point_calls(device, scene, points) -> dict:
    """Returns calls that ask about points (n, 3) of a closed scene."""
    normals = {"sign": "pseudonormal"}
    return {
        "nearest": lambda: scene.nearest(points, NEAREST),
        "nearest float64": lambda: scene.nearest(points.astype(np.float64), ("points",), limit=0.5),
        "nearest exact": lambda: scene.nearest(points, NEAREST, numeric="exact"),
        "nearest by masks": lambda: scene.nearest(points, NEAREST, masks=np.arange(len(points)) % 4),
        "nearest of a grid": lambda: scene.nearest(ballot.grid(*points[:12].T), NEAREST),
        "within": lambda: scene.within(points, 1.5, masks=3),
        "signed": lambda: scene.nearest(points, SIGNED),
        "signed by normals": lambda: scene.nearest(points, SIGNED, **normals),
        "inside": lambda: scene.nearest(points, ("inside",)),
        "arrays, nearest": lambda: read(scene.nearest(there(device, "points", points), ("nearest", "normals"))),
        "arrays, distances": lambda: read(scene.nearest(there(device, "points", points), SIGNED, **normals)),
        "arrays, inside": lambda: read(scene.nearest(there(device, "points", points), ("inside",))),
    }


class Shared:
    """Scenes that all threads ask, and one that each changes for itself."""

    def __init__(self, device: ballot.Device):
        self.device = device
        self.open = ballot.Scene(*ref.soup(2000), device=device)
        self.closed = self.make_changing()
        self.rays, self.long = ref.random_rays(max(SIZES)), ref.random_rays(LONG)
        self.points = np.random.default_rng(4).uniform(-2, 5, (max(SIZES), 3)).astype(np.float32)
        self.calls = []
        for size in SIZES:
            named = {f"open, {k}": v for k, v in ray_calls(device, self.open, self.rays[:size]).items()}
            of_rays = ray_calls(device, self.closed, self.rays[:size])
            of_points = point_calls(device, self.closed, self.points[:size])
            named |= {f"closed, {k}": v for k, v in {**of_rays, **of_points}.items()}
            self.calls += [(f"{name}, {size}", call, frozen(call())) for name, call in named.items()]
        scene = self.make_changing()
        self.states = [self.asked(scene)]
        for change in CHANGES:
            change(scene)
            self.states.append(self.asked(scene))

    def make_changing(self) -> ballot.Scene:
        cube = (ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        return ballot.Scene(
            meshes=[cube, cube], instances=placed(0, 3, 3), instance_meshes=[0, 1, 0], masks=[1, 2, 3],
            device=self.device,
        )  # fmt: skip

    def asked(self, scene: ballot.Scene) -> list:
        """Returns what a scene answers in the state that it is in."""
        rays, points = self.rays[:700], self.points[:40]
        return frozen(
            [*scene.trace_columns(rays, COLUMNS[:5]).values(), *scene.nearest(points, SIGNED).values(),
             *scene.crossings(rays[:40])]
        )  # fmt: skip


def grown(scene, factor: float) -> None:
    scene.set_vertices(0, ref.CUBE_VERTICES * np.float32(factor))
    scene.commit()


def with_another(scene) -> None:
    (number,) = scene.add_instances(placed(-3), meshes=1, masks=[1])
    scene.set_masks([number], [2])
    scene.commit()
    scene.remove_instances(scene.instances[0].instance)
    scene.commit()


def moved(scene) -> None:
    scene.set_transforms(placed(0.5), [scene.instances[0].instance])
    scene.commit()


def with_another_mesh(scene) -> None:
    number = scene.add_mesh(ref.CUBE_VERTICES * np.float32(0.5), ref.CUBE_TRIANGLES, id=9)
    scene.add_instances(placed(1), meshes=number)
    scene.commit()
    scene.remove_mesh(0)
    scene.commit()


def dropped(scene) -> None:
    scene.set_vertices(1, ref.CUBE_VERTICES * np.float32(7))
    scene.discard()


CHANGES = (lambda s: grown(s, 1.25), with_another, moved, lambda s: grown(s, 1), dropped, with_another_mesh)


def refused(call, kind) -> None:
    """Makes a call that has to raise."""
    try:
        call()
    except kind:
        return
    raise AssertionError(f"{call} raised nothing")


def wrong(shared: Shared) -> None:
    """Makes calls with wrong arguments."""
    scene, rays = shared.closed, shared.rays[:8]
    refused(lambda: scene.trace(rays[:, :5]), ValueError)
    refused(lambda: scene.trace(rays, out=np.zeros(7, ballot.HIT)), ValueError)
    refused(lambda: scene.trace(rays, method="no such"), ValueError)
    refused(lambda: scene.trace_columns(rays, ("no such",)), ValueError)
    refused(lambda: scene.occluded(origins=rays[:3, :3], directions=rays[:5, 3:]), ValueError)
    refused(lambda: scene.nearest("points"), (TypeError, ValueError))
    refused(lambda: scene.nearest(rays[:, :3], sign="no such"), ValueError)
    refused(lambda: scene.crossings(rays, first=-1), ValueError)
    refused(lambda: scene.set_vertices(99, rays[:, :3]), ValueError)
    refused(lambda: ballot.Scene([[0, 0, 0]], [[0, 1, 2]], device=shared.device), ValueError)
    refused(lambda: ballot.Array("no such", 1, shared.device), ValueError)


def ended(shared: Shared) -> None:
    """Makes calls that their progress functions end."""
    scene, rays = shared.open, shared.long
    for call in (scene.trace, scene.count_crossings, scene.crossings, lambda r, **k: scene.nearest(r[:, :3], **k)):
        refused(lambda call=call: call(rays, progress=lambda done: False), ballot.Error)


def come_and_gone(shared: Shared, dice: random.Random) -> None:
    """Makes scenes, asks them in each state that they are changed to, and drops them."""
    scene = shared.make_changing()
    for change, state in zip((lambda s: None, *CHANGES), shared.states):
        change(scene)
        if shared.asked(scene) != state:
            raise AssertionError(f"{change}: another answer")
    job = scene.submit(shared.rays)
    if dice.random() < 0.5:
        scene.close()
    del job


def work(shared: Shared, seed: int, until: float, made: Counter, failures: list) -> None:
    dice = random.Random(seed)
    try:
        while time.monotonic() < until and not failures:
            chance = dice.random()
            if chance < 0.01:
                wrong(shared)
                made["wrong arguments"] += 1
            elif chance < 0.02:
                ended(shared)
                made["ended by progress"] += 1
            elif chance < 0.04:
                come_and_gone(shared, dice)
                made["scenes"] += 1
            else:
                name, call, truth = dice.choice(shared.calls)
                if frozen(call()) != truth:
                    raise AssertionError(f"{name}: another answer")
                made["answers"] += 1
    except BaseException as error:  # noqa: BLE001
        failures.append(error)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=10)
    parser.add_argument("--threads", type=int, default=4)
    parser.add_argument("--growth", type=float, default=8, help="MiB by which the memory may grow")
    parser.add_argument("--device", default="")
    options = parser.parse_args()
    if "MALLOC_ARENA_MAX" not in os.environ:
        os.environ["MALLOC_ARENA_MAX"] = "1"
        os.execv(sys.executable, [sys.executable, *sys.argv])
    shared = Shared(ballot.Device(options.device))
    print(f"{shared.device.info.name}: {len(shared.calls)} calls, {options.threads} threads", flush=True)
    begin, failures, made, least = time.monotonic(), [], Counter(), []
    until = begin + 60 * options.minutes
    threads = [
        threading.Thread(target=work, args=(shared, n, until, made, failures)) for n in range(options.threads)
    ]
    for thread in threads:
        thread.start()
    while time.monotonic() < until and not failures:
        samples = []
        while len(samples) < 300 and time.monotonic() < until and not failures:
            samples.append(resident())
            time.sleep(0.1)
        least.append(min(samples))
        calls = ", ".join(f"{count} {what}" for what, count in sorted(made.items()))
        minutes = (time.monotonic() - begin) / 60
        print(f"{minutes:5.1f} min {least[-1]:8.1f} to {max(samples):8.1f} MiB, {calls}", flush=True)
    for thread in threads:
        thread.join()
    if failures:
        raise failures[0]
    settled = least[2:]
    growth = settled[-1] - settled[0] if settled else 0
    print(f"the memory grew by {growth:+.1f} MiB after the first minute; {shared.device.messages} messages")
    if growth > options.growth or shared.device.messages:
        sys.exit(f"mixed_calls: at most {options.growth} MiB and no messages are allowed")


if __name__ == "__main__":
    main()
