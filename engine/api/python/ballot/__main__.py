"""`python -m ballot`: what is installed, the devices, and a short self test with a picture. Part of every bug report.

The exit code is 0 if the answers are right, 1 if not, 3 without a usable device.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import tempfile
import time

import numpy as np

import ballot

from . import _ballot, _cpu_driver

_SHADES = " .:-=+*#%@"
_VARIABLES = ("BALLOT_VULKAN_LOADER", "VK_DRIVER_FILES", "VK_ICD_FILENAMES", "BALLOT_SHADERS", "LP_NATIVE_VECTOR_WIDTH",
              "XDG_CACHE_HOME")  # fmt: skip


def _sphere(steps: int) -> np.ndarray:
    """Returns the corners of a sphere's triangles, (n, 3, 3), of radius 1."""
    turn, rise = np.meshgrid(np.linspace(0, 2 * np.pi, 2 * steps + 1), np.linspace(0, np.pi, steps + 1))
    ring = np.sin(rise)
    at = np.stack([ring * np.cos(turn), np.cos(rise), ring * np.sin(turn)], -1).astype(np.float32)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    return np.concatenate([np.stack([a, b, c], 2).reshape(-1, 3, 3), np.stack([a, c, d], 2).reshape(-1, 3, 3)])


def _box() -> tuple[np.ndarray, np.ndarray]:
    """Returns the cube from -1 to 1 along each axis."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float32)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))], np.uint32)


def _cache() -> str:
    """Returns the folder of caches with its size, and whether it can be written."""
    given = os.environ.get("XDG_CACHE_HOME", "")
    top = given if os.path.isabs(given) else os.path.join(os.path.expanduser("~"), ".cache")
    folder = os.path.join(top, "ballot")
    files = [os.path.join(at, name) for at, _, names in os.walk(folder) for name in names]
    size = sum(os.path.getsize(file) for file in files if os.path.isfile(file))
    try:
        os.makedirs(folder, mode=0o700, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            state = f"{size / 2**20:.1f} MiB"
    except OSError:
        state = "it cannot be written, so kernels are compiled in each process"
    return f"{folder}; {state}"


def _print_system() -> None:
    print(f"ballot    {ballot.version()}, commit {ballot.commit()}")
    print(f"python    {platform.python_version()}, NumPy {np.__version__}, {platform.platform()}")
    print(f"library   {_ballot.library()}")
    print(f"caches    {_cache()}")
    for name in _VARIABLES:
        if name in os.environ:
            print(f"variable  {name}={os.environ[name]}")


def _print_devices() -> None:
    for i, device in enumerate(ballot.devices()):
        print(f"device {i}  {device.name}, {device.driver}, subgroups of {device.subgroup_size} lanes")
        if not device.usable:
            print(f"          refused: {device.refusal}")
    if folder := _cpu_driver.used():
        print(f"          the driver of ballot[cpu], {folder}: no other was found")


def _check(device: ballot.Device) -> bool:
    """Asks a cube for hits and distances that are known. Returns whether all are right."""
    box = ballot.Scene(*_box(), device=device)
    random = np.random.default_rng(1)
    directions = random.normal(size=(10_000, 3)).astype(np.float32)
    hits, times = np.empty(0, ballot.HIT), []
    for _ in range(5):
        start = time.perf_counter()
        hits = box.trace(origins=np.zeros(3, np.float32), directions=directions)
        times.append(time.perf_counter() - start)
    far = np.abs(hits["t"] * np.abs(directions).max(axis=1) - 1)
    points = random.uniform(-0.9, 0.9, (1000, 3)).astype(np.float32)
    off = np.abs(box.nearest(points)["distances"] - (1 - np.abs(points).max(axis=1)))
    wrong = int((~(far < 1e-5)).sum()), int((~(off < 1e-5)).sum())
    print(f"self test {len(directions)} rays, {wrong[0]} wrong; {len(points)} closest points, {wrong[1]} wrong")
    print(f"          the first call took {times[0]:.3f} s, the next ones {1e3 * min(times[1:]):.2f} ms")
    return wrong == (0, 0)


def _picture(device: ballot.Device, path: str | None) -> None:
    scene = ballot.Scene(_sphere(24), device=device)
    view = {"eye": (0.0, 1.0, 3.0), "target": (0.0, 0.0, 0.0), "yfov": 0.8}
    if path:
        ballot.render(scene, view, 512, 512, samples=4).to_png(path)
        print(f"picture   {path}")
        return
    image = ballot.render(scene, view, 40, 40)
    light = image[::2, :, :3].mean(axis=-1) * (image[::2, :, 3] > 0)
    shades = np.clip(light * len(_SHADES), 0, len(_SHADES) - 1).astype(int)
    print("\n".join("          " + "".join(_SHADES[k] for k in row).rstrip() for row in shades))


def main(words: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser("python -m ballot", description=__doc__)
    parser.add_argument("--device", default="", help='an index, part of a name, "gpu" or "cpu"')
    parser.add_argument("--png", metavar="FILE", help="write the picture to this file")
    options = parser.parse_args(words)
    _print_system()
    try:
        _print_devices()
        with ballot.Device(options.device) as device:
            print(f"          {device.info.name} is used")
            right = _check(device)
            _picture(device, options.png)
    except (ballot.Error, ValueError, OSError) as error:
        print(f"error     {error}", file=sys.stderr)
        code = getattr(error, "code", None)
        return 3 if code == ballot.Code.DEVICE else 2 if isinstance(error, ValueError) else 1
    return 0 if right else 1


if __name__ == "__main__":
    sys.exit(main())
