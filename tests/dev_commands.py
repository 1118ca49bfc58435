#!/usr/bin/env python3
"""Tests what tools/dev.py needs for its commands, and how a build shows its progress."""

import contextlib
import io
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tools"))

import dev_build  # noqa: E402
import dev_bundle  # noqa: E402
import dev_gallery  # noqa: E402
import dev_packages  # noqa: E402

# Prints 40 steps as Ninja does, with other lines between them, and looks at its log after the first half.
NINJA = """
import sys
for step in range(1, 41):
    print(f"[{step}/40] Building", flush=True)
    print("a warning", flush=True)
    if step == 20:
        input()
"""


class Packages(unittest.TestCase):
    def test_a_picture_needs_no_package_of_the_tests(self):
        render, test = dev_packages.needed("render"), dev_packages.needed("test")
        for package in ("libgtest-dev", "libxtst-dev", "xvfb", "clang-tidy"):
            self.assertNotIn(package, render)
            self.assertIn(package, test)
        self.assertLess(set(render), set(test))
        for package in ("libdraco-dev", "libmeshoptimizer-dev", "libwebp-dev", "zlib1g-dev", "libcli11-dev"):
            self.assertIn(package, render)


class Bundle(unittest.TestCase):
    def test_it_holds_the_notices(self):
        with tempfile.TemporaryDirectory() as folder:
            dev_bundle.copy_notices(Path(folder))
            doc = Path(folder) / "share" / "doc"
            for name in ("ballot/LICENSE", "ballot/NOTICE", "libdraco-dev/copyright", "libstb-dev/copyright"):
                self.assertTrue((doc / name).is_file(), name)


class Progress(unittest.TestCase):
    def test_without_a_terminal_every_tenth_is_a_line(self):
        with tempfile.TemporaryDirectory() as folder:
            log, out = Path(folder) / "build.log", io.StringIO()
            command = [sys.executable, "-c", NINJA.replace("        input()\n", "        pass\n")]
            with contextlib.redirect_stdout(out):
                dev_build.run_logged("building", command, log)
            lines = out.getvalue().splitlines()
            self.assertEqual(lines[0], "building ...")
            tenths = [f"building: {percent} %" for percent in range(10, 101, 10)]
            self.assertEqual([line.split(",")[0] for line in lines[1:-1]], tenths)
            self.assertRegex(lines[-1], r"building: done in \d+ s")
            self.assertEqual(len(log.read_text(encoding="utf-8").splitlines()), 80)

    def test_the_log_grows_meanwhile(self):
        with tempfile.TemporaryDirectory() as folder:
            log = Path(folder) / "build.log"
            watch = NINJA.replace("        input()\n", f"        assert 'a warning' in open({str(log)!r}).read()\n")
            watch = watch.replace("    if step == 20", "    import time; time.sleep(0.01)\n    if step == 20")
            with contextlib.redirect_stdout(io.StringIO()):
                dev_build.run_logged("building", [sys.executable, "-c", watch], log)

    def test_a_failure_shows_the_end_of_the_log(self):
        with tempfile.TemporaryDirectory() as folder:
            out, errors = io.StringIO(), io.StringIO()
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
                with self.assertRaises(dev_packages.Failed):
                    dev_build.run_logged("building", [sys.executable, "-c", "print('why'); exit(3)"],
                                         Path(folder) / "build.log")
            self.assertIn("why", errors.getvalue())


class Gallery(unittest.TestCase):
    def test_every_picture_has_a_scene_and_its_own_name(self):
        self.assertEqual(len({picture.name for picture in dev_gallery.PICTURES}), 5)
        for picture in dev_gallery.PICTURES:
            program = ROOT / "scenes" / f"make_{picture.scene}.py"
            self.assertTrue(program.is_file(), program)

    def test_given_options_replace_its_own_and_a_failure_ends_it(self):
        with tempfile.TemporaryDirectory() as folder:
            program, log = Path(folder) / "program", Path(folder) / "log"
            program.write_text(f'#!/bin/sh\necho "$@" >> {log}\nexit 5\n', encoding="utf-8")
            program.chmod(0o755)
            out, files = dev_gallery.OUT, dev_gallery.dev_scenes.scene_file
            dev_gallery.OUT, dev_gallery.dev_scenes.scene_file = Path(folder), lambda name: Path(name)
            try:
                status, reports = dev_gallery.make(program, ["--size", "9x9"], lambda name: name == "--size")
            finally:
                dev_gallery.OUT, dev_gallery.dev_scenes.scene_file = out, files
            calls = log.read_text(encoding="utf-8").splitlines()
        self.assertEqual((status, reports, len(calls)), (5, [], 1))
        self.assertEqual(calls[0].count("--size"), 1)


class Commands(unittest.TestCase):
    def test_a_missing_scene_is_failed_work(self):
        result = subprocess.run([sys.executable, ROOT / "tools/dev.py", "render", "/no/such.gltf"], capture_output=True,
                                text=True, check=False)
        self.assertEqual((result.returncode, result.stderr),
                         (1, "error: there is no scene file /no/such.gltf; check the path\n"))


if __name__ == "__main__":
    unittest.main()
