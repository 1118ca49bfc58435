#!/usr/bin/env python3
"""Tests what tools/dev.py needs for its commands, what it passes on, and that the deliberate faults fit the shaders."""

import subprocess
import sys
import tempfile
import unittest
import zipfile
from pathlib import Path
from unittest import mock

sys.dont_write_bytecode = True
ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tools"))

from dev import Failed, bundle, gallery, mutations, packages, run, wheel  # noqa: E402
from dev.reference import comments  # noqa: E402


class Packages(unittest.TestCase):
    def test_a_picture_needs_no_package_of_the_tests(self):
        render, test = packages.needed("build"), packages.needed("build", "tests", "test")
        for package in ("libgtest-dev", "libxtst-dev", "xvfb", "clang-tidy"):
            self.assertNotIn(package, render)
            self.assertIn(package, test)
        self.assertLess(set(render), set(test))
        for package in ("libdraco-dev", "libmeshoptimizer-dev", "libwebp-dev", "zlib1g-dev", "libcli11-dev"):
            self.assertIn(package, render)

    def test_what_is_missing_is_found(self):
        self.assertEqual(packages.missing_of({"dpkg": "is there", "no-such-package": "is not"}),
                         {"no-such-package": "is not"})


    def test_systems(self):
        release = {"ID": "ubuntu", "VERSION_ID": "22.04", "PRETTY_NAME": "Ubuntu 22.04.5 LTS"}
        with mock.patch.object(packages, "system", release.copy):
            self.assertEqual(packages.system_name(), "ubuntu-22.04")
            with self.assertRaisesRegex(Failed, "cannot be built on Ubuntu 22.04.5 LTS: its CMake 3.22"):
                packages.ensure(False, "build")
        self.assertEqual({*packages.absent("debian-13")} - {*packages.needed("fuzz")}, set())
        release.update(ID="debian", VERSION_ID="13", PRETTY_NAME="Debian GNU/Linux 13 (trixie)")
        with mock.patch.object(packages, "system", release.copy), self.assertRaisesRegex(Failed, "has no clang-16"):
            packages.ensure(False, "build", "fuzz")


class Bundle(unittest.TestCase):
    def test_it_holds_the_notices(self):
        with tempfile.TemporaryDirectory() as folder:
            doc = Path(folder)
            bundle.copy_notices(doc, bundle.COMPILED_IN)
            for name in ("ballot/LICENSE", "ballot/NOTICE", "libdraco-dev/copyright", "libstb-dev/copyright"):
                self.assertTrue((doc / name).is_file(), name)


class Wheels(unittest.TestCase):
    def wheel(self, folder: str, **files: bytes) -> Path:
        file = Path(folder) / f"ballot-1.0.0-cp312-abi3-{wheel.PLATFORM}.whl"
        with zipfile.ZipFile(file, "w") as made:
            for name in ("LICENSE", "NOTICE", "LICENSE.nanobind", "libembree-dev/copyright"):
                made.writestr(f"ballot-1.0.0.dist-info/licenses/{name}", "text")
            for name, data in files.items():
                made.writestr(f"ballot/{name}.so", data)
        return file

    def test_what_may_not_be_in_one_is_found(self):
        with tempfile.TemporaryDirectory() as folder:
            wheel.check(self.wheel(folder, good=b"GLIBC_2.34\0"))
            for data, said in ((b"GLIBC_2.99\0", "needs GLIBC_2.99"), (bytes(ROOT) + b"/shaders", "names a folder")):
                with self.assertRaisesRegex(Failed, said):
                    wheel.check(self.wheel(folder, bad=data))
            with mock.patch.object(wheel, "MOST_BYTES", 100), self.assertRaisesRegex(Failed, "at most 100"):
                wheel.check(self.wheel(folder))

    def test_the_source_package_has_its_own_project_file(self):
        text = (wheel.PACKAGE / "pyproject.toml").read_text(encoding="utf-8")
        for line in wheel.MOVED:
            self.assertEqual(text.count(line), 1, line)


class Gallery(unittest.TestCase):
    def test_every_picture_has_a_scene(self):
        self.assertEqual(len(gallery.PICTURES), 5)
        for scene, _ in gallery.PICTURES.values():
            self.assertTrue((ROOT / "scenes" / f"make_{scene}.py").is_file(), scene)

    def test_given_options_replace_its_own_and_a_failure_ends_it(self):
        with tempfile.TemporaryDirectory() as folder:
            program, log = Path(folder) / "program", Path(folder) / "log"
            program.write_text(f'#!/bin/sh\necho "$@" >> {log}\nexit 5\n', encoding="utf-8")
            program.chmod(0o755)
            with mock.patch.multiple(gallery, OUT=Path(folder), scene_file=Path):
                self.assertEqual(gallery.render_gallery(program, ["--size", "9x9"]), 5)
            calls = log.read_text(encoding="utf-8").splitlines()
        self.assertEqual(len(calls), 1)
        self.assertEqual(calls[0].count("--size"), 1)
        self.assertIn("--png", calls[0])


class Faults(unittest.TestCase):
    def test_their_texts_stand_in_the_shaders_once(self):
        with tempfile.TemporaryDirectory() as folder:
            for i, fault in enumerate(mutations.FAULTS):
                mutations.put_in(fault, Path(folder) / str(i))


class Reference(unittest.TestCase):
    def test_tables_of_comments_become_lists(self):
        rows = ["Finds.", "", "rays    (n, 8)", "        floats", "out_ray (n,)", "", "    code()", "", "t  time"]
        made = ["Finds.", "- **rays** (n, 8)", "  floats", "- **out_ray** (n,)", "::", "    code()", "- **t** time"]
        self.assertEqual([row for row in comments.as_lists(rows, "::") if row], made)
        made[4:6] = ["@code", "    code()", "@endcode"]
        self.assertEqual([row for row in comments.as_lists(rows) if row], made)

    def test_a_comment_documents_all_that_a_line_declares(self):
        made = comments.documentation("// Types.\n#pragma once\nstruct A {\n  int a, b = 0;  // two\n};  // of A\n")
        self.assertIn("/** @file\nTypes.", made)
        self.assertIn("int a, /**< two */ b = 0; /**< two */", made)


class Commands(unittest.TestCase):
    def test_a_failure_tells_what_the_program_said(self):
        with self.assertRaisesRegex(Failed, "(?s)exit code 3 of .*: .*why"):
            run(sys.executable, "-c", "print('why'); exit(3)", capture_output=True)

    def test_a_missing_scene_is_failed_work(self):
        result = subprocess.run([sys.executable, ROOT / "tools/dev.py", "render", "/no/such.gltf"], capture_output=True,
                                text=True, check=False)
        self.assertEqual((result.returncode, result.stderr),
                         (1, "error: there is no scene file /no/such.gltf; check the path\n"))

    def test_unknown_arguments_are_refused(self):
        for words in (["fmt", "x"], ["bundle", "a", "b"], ["fuzz", "--no-such"]):
            result = subprocess.run([sys.executable, ROOT / "tools/dev.py", *words], capture_output=True, check=False)
            self.assertEqual(result.returncode, 2, words)


if __name__ == "__main__":
    unittest.main()
