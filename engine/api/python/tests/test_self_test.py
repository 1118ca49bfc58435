"""`python -m ballot`, the driver of ballot[cpu], and libraries of other versions."""

import os
import shutil
import subprocess
import sys
import tempfile
import textwrap
import unittest

NO_DRIVER = {"VK_DRIVER_FILES": "/no/such/file", "VK_ICD_FILENAMES": "/no/such/file"}


def run(*words: str, **environment: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, *words], capture_output=True, text=True, check=False, env={**os.environ, **environment}
    )


def has_driver() -> bool:
    """Returns whether the system has a loader and a driver, without those of ballot_lavapipe."""
    code = "from ballot import _ballot; print(len(_ballot.devices()))"
    return run("-c", code).stdout.strip() not in ("", "0")


class SelfTest(unittest.TestCase):
    def test_it_finds_known_answers_and_draws(self):
        done = run("-m", "ballot")
        self.assertEqual(done.returncode, 0, done.stderr)
        for part in ("ballot ", "python ", "library ", "caches ", "device 0 ", "is used", "10000 rays, 0 wrong",
                     "1000 closest points, 0 wrong", "the first call took", "@@"):  # fmt: skip
            self.assertIn(part, done.stdout)
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "ball.png")
            done = run("-m", "ballot", "--png", file, XDG_CACHE_HOME="/proc/ballot")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("/proc/ballot", done.stdout)
            self.assertIn("it cannot be written", done.stdout)
            self.assertGreater(os.path.getsize(file), 1000)

    @unittest.skipUnless(has_driver(), "the system has no driver")
    def test_without_a_driver_it_names_the_remedy(self):
        done = run("-m", "ballot", **NO_DRIVER)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        for part in ("VK_DRIVER_FILES is /no/such/file", "apt install", "dnf install", "pacman -S", "ballot[cpu]"):
            self.assertIn(part, done.stderr)
        self.assertEqual(run("-m", "ballot", "--device", "Voodoo").returncode, 2)


class CpuDriver(unittest.TestCase):
    CODE = """
        import os, sys
        import ballot
        from ballot import _ballot, _cpu_driver
        if {without}:
            _cpu_driver._without_driver = lambda: True
        try:
            print(len(ballot.devices()) > 0)
        except ballot.Error as error:
            print("no driver")
        print(_cpu_driver.used(), os.environ.get("VK_DRIVER_FILES"))
        """

    def lines(self, without: bool, **environment: str) -> list[str]:
        with tempfile.TemporaryDirectory() as folder:
            package = os.path.join(folder, "ballot_lavapipe")
            os.mkdir(package)
            with open(os.path.join(package, "__init__.py"), "w", encoding="utf-8") as file:
                file.write('ICD, LOADER = "/no/such/icd.json", "/no/such/libvulkan.so.1"\n')
            done = run("-c", textwrap.dedent(self.CODE.format(without=without)), PYTHONPATH=folder, **environment)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout.splitlines()

    @unittest.skipUnless(has_driver(), "the system has no driver")
    @unittest.skipIf({*NO_DRIVER} & {*os.environ}, "a driver is named, which has precedence")
    def test_it_serves_only_without_another(self):
        self.assertEqual(self.lines(True)[1:], ["/no/such /no/such/icd.json"])
        self.assertEqual(self.lines(False), ["True", "None None"])

    @unittest.skipUnless(has_driver(), "the system has no driver")
    def test_a_named_driver_has_precedence(self):
        self.assertEqual(self.lines(True, **NO_DRIVER), ["no driver", "None /no/such/file"])


class OtherVersions(unittest.TestCase):
    @unittest.skipUnless(shutil.which("cc"), "needs a C compiler")
    def test_a_library_of_another_version_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            source, library = os.path.join(folder, "other.c"), os.path.join(folder, "libother.so")
            with open(source, "w", encoding="utf-8") as file:
                file.write('const char* ballot_version(void) { return "0.9.0"; }\n')
            subprocess.run(["cc", "-shared", "-fPIC", source, "-o", library], check=True)
            preloaded = ":".join(filter(None, [library, os.environ.get("LD_PRELOAD")]))
            done = run("-c", "import ballot", LD_PRELOAD=preloaded)
        self.assertIn("ImportError: two versions of Ballot in one process: the package is of version 1.0", done.stderr)
        self.assertIn("libother.so is loaded already, of version 0.9.0", done.stderr)


if __name__ == "__main__":
    unittest.main()
