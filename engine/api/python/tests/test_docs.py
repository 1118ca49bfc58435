"""The examples in docstrings and in the README run as they stand, and every public name says what it is."""

import doctest
import importlib
import inspect
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import ballot
import numpy as np
import reference as ref

EXAMPLES = [
    "ambient_occlusion", "foliage", "irradiance", "lidar", "line_of_sight", "occlusion_kernel", "path_tracer",
    "street_scan", "view_factors",
]  # fmt: skip
SMALLER = {"street_scan": ["street_scan.png", "2"]}  # stops of the car
MODULES = [
    "_answers", "_array", "_cameras", "_device", "_kernel", "_patterns", "_picture", "_raycasting", "_scene",
    "_clouds", "_sensors", "sensors", "trimesh_ray", *(f"examples.{name}" for name in EXAMPLES),
]  # fmt: skip


class Docs(unittest.TestCase):
    def test_docstrings(self):
        for name in MODULES:
            with self.subTest(name):
                module = importlib.import_module(f"ballot.{name}")
                result = doctest.testmod(module, extraglobs={"ballot": ballot, "np": np})
                self.assertGreater(result.attempted, 0)
                self.assertEqual(result.failed, 0)

    def test_readme(self):
        readme = pathlib.Path(__file__).parents[1] / "README.md"
        result = doctest.testfile(str(readme), module_relative=False)
        self.assertGreater(result.attempted, 5)
        self.assertEqual(result.failed, 0)

    def test_examples_run(self):
        for name in EXAMPLES:
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                done = subprocess.run(
                    [sys.executable, "-m", f"ballot.examples.{name}", *SMALLER.get(name, [])],
                    capture_output=True,
                    text=True,
                    timeout=120,
                    check=False,
                    cwd=folder,
                    env={key: value for key, value in os.environ.items() if key != "GALLIVM_PERF"},
                )
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertTrue(done.stdout)

    def test_examples_are_short(self):
        folder = pathlib.Path(ballot.__file__).parent / "examples"
        for name in EXAMPLES:
            self.assertLessEqual(len((folder / f"{name}.py").read_text().splitlines()), 80, name)

    def test_every_name_is_described(self):
        for name in ballot.__all__:
            value = getattr(ballot, name)
            if inspect.isclass(value) or inspect.isroutine(value):
                self.assertTrue(value.__doc__, name)
            if inspect.isclass(value):
                for member, function in vars(value).items():
                    if not member.startswith("_") and inspect.isroutine(function):
                        self.assertTrue(function.__doc__ or member in ("count", "index"), f"{name}.{member}")

    def test_installed_files(self):
        folder = pathlib.Path(ballot.__file__).parent
        for name in ("py.typed", "_ballot.pyi", "libballot.so.1"):
            self.assertTrue((folder / name).exists(), name)
        size = sum(f.stat().st_size for f in folder.rglob("*.so*"))
        self.assertTrue(size < 16 << 20 or ref.SANITIZED, size)
        self.assertEqual(ballot.__version__, ballot.version())
        names = ballot.names()
        self.assertEqual(set(names), {"methods", "numeric", "builders", "ray_kinds", "shadings"})
        self.assertIn("exact", names["numeric"])
        self.assertNotEqual(os.path.commonpath([folder, pathlib.Path(__file__).parent]), str(folder.parent))


if __name__ == "__main__":
    unittest.main()
