"""Prints a digest of each answer to the same questions, so that those of two installations on a driver can be compared.

Usage: answers.py SCENES. The folder has cornell.gltf and meadow.gltf.
"""

import hashlib
import sys
from pathlib import Path

import ballot
import numpy as np


def digest(*answers: object) -> str:
    """Returns a digest of arrays."""
    found = hashlib.sha256()
    for answer in answers:
        found.update(np.ascontiguousarray(answer).tobytes())
    return found.hexdigest()[:16]


def rays_for(scene: ballot.Scene, count: int) -> np.ndarray:
    """Returns rays from within the bounds."""
    lo, hi = np.asarray(scene.info.lo), np.asarray(scene.info.hi)
    random = np.random.default_rng(1)
    origins = lo + random.random((count, 3)) * (hi - lo)
    return np.concatenate([origins, random.normal(size=(count, 3))], axis=1).astype(np.float32)


def main() -> None:
    folder = Path(sys.argv[1])
    device = ballot.Device()
    print(f"{device.info.name}, {device.info.driver}")
    for name in ("cornell.gltf", "meadow.gltf"):
        scene = ballot.load_scene(folder / name, device=device)
        rays = rays_for(scene, 20000)
        for method in ballot.names()["methods"]:
            if method == "packet-wide" and scene.info.trees:
                continue  # it takes no instances
            print(f"{name} {method}: {digest(scene.trace(rays, method=method))}", flush=True)
        for numeric in ballot.names()["numeric"]:
            print(f"{name} {numeric}: {digest(scene.trace(rays, method='while-while', numeric=numeric))}", flush=True)
        print(f"{name} any: {digest(scene.occluded(rays))}")
        for kind in ballot.names()["ray_kinds"]:
            print(f"{name} {kind}: {digest(scene.make_rays(kind=kind, width=64, height=64))}", flush=True)
        print(f"{name} crossings: {digest(scene.count_crossings(rays))}")
        print(f"{name} nearest: {digest(*scene.nearest(rays[:, :3]).values())}")
        for shading in ("eyelight", "path"):
            print(f"{name} {shading}: {digest(ballot.render(scene, shading=shading, width=64, height=64))}", flush=True)


if __name__ == "__main__":
    main()
