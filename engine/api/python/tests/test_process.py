"""Signals, forks, progress functions, exits and other processes."""

import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import textwrap
import time
import unittest

import ballot
import numpy as np
import reference as ref

PRELUDE = """
import os, signal, sys, threading, time
import numpy as np
sys.path.insert(0, {folder!r})
signal.signal(signal.SIGINT, signal.default_int_handler)  # which a shell that runs tests in the background ignores
import ballot, reference as ref
"""


def start(code: str, **environment: str) -> subprocess.Popen:
    text = PRELUDE.format(folder=os.path.dirname(os.path.abspath(__file__))) + textwrap.dedent(code)
    return subprocess.Popen(
        [sys.executable, "-c", text], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        env={**os.environ, **environment},
    )  # fmt: skip


class Process(unittest.TestCase):
    def output(self, code: str, rc: int = 0, **environment: str) -> str:
        process = start(code, **environment)
        try:
            text = process.communicate(timeout=120)[0]
        except subprocess.TimeoutExpired:
            process.kill()
            self.fail("it hangs: " + process.communicate()[0])
        self.assertEqual(process.returncode, rc, text)
        return text


class Interrupts(Process):
    LONG = """
        scene = ballot.Scene(*ref.soup({triangles}))
        rays = np.tile(ref.random_rays(1 << 18), (12, 1))
        points = rays[:, :3]
        scene.trace(rays[:64])
        {setup}
        print("ready", flush=True)
        try:
            while True:
                {call}
        except KeyboardInterrupt:
            print("interrupted", flush=True)
        print(len(scene.trace(rays[:64])), "rays after it")
        """
    GRID = "x, y = np.meshgrid(np.arange(800, dtype=np.float32), np.arange(800, dtype=np.float32)); " \
        "corners = np.stack([x, y, np.sin(x) * np.cos(y)], -1).reshape(-1, 3); " \
        "first = np.arange(799 * 800).reshape(799, 800)[:, :-1].reshape(-1, 1); " \
        "grid = corners, np.concatenate([first + [0, 1, 800], first + [1, 801, 800]]).astype(np.uint32); "  # fmt: skip
    MOST_SECONDS = 0.5

    def interrupt(self, call: str, setup: str = "", triangles: int = 300) -> float:
        """Returns the seconds from Ctrl-C to KeyboardInterrupt."""
        process = start(self.LONG.format(call=call, setup=setup, triangles=triangles))
        self.addCleanup(process.kill)
        self.assertEqual(process.stdout.readline(), "ready\n")
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        begin = time.monotonic()
        first = process.stdout.readline()
        waited = time.monotonic() - begin
        self.assertEqual((first, process.stdout.read(), process.wait()), ("interrupted\n", "64 rays after it\n", 0))
        process.stdout.close()
        return waited

    def ends(self, call: str, setup: str = "", triangles: int = 300) -> None:
        """Expects that Ctrl-C ends a call soon. A machine that is busy has three tries."""
        waited = [self.interrupt(call, setup, triangles)]
        while not ref.SANITIZED and waited[-1] > self.MOST_SECONDS and len(waited) < 3:
            waited.append(self.interrupt(call, setup, triangles))
        self.assertTrue(ref.SANITIZED or waited[-1] <= self.MOST_SECONDS, waited)

    def test_traces(self):
        self.ends("scene.trace(rays, method='while-while')")
        self.ends("scene.trace_columns(rays, numeric='exact')")
        setup = "there, hits = ballot.Array('rays', 1 << 20), ballot.Array('hits', 1 << 20); " \
                "there.write(np.insert(np.insert(rays[:1 << 20], 3, 0, 1), 7, 9, 1))"  # fmt: skip
        self.ends("scene.trace(there, out=hits, method='while-while')", setup)

    def test_the_waiting_for_a_job(self):
        self.ends("job = scene.submit(rays, method='while-while'); job.wait()")

    def test_few_questions(self):
        """Which the main thread answers itself, unless they take long or wait for another thread's call."""
        self.ends("scene.trace(rays[:1]); scene.nearest(points[:1], ('distances',))")
        deep = "deep = ballot.Scene(np.tile(np.eye(3, dtype=np.float32), (200000, 1)), " \
               "np.arange(600000, dtype=np.uint32).reshape(-1, 3)); deep.trace(rays[:1]); deep.nearest(points[:1]); " \
               "down = np.tile(np.float32([[1, 1, 1, -1, -1, -1]]), (1000, 1))"  # fmt: skip
        self.ends("deep.trace(down)", deep)
        self.ends("deep.nearest(down[:64, :3])", deep)
        setup = "threading.Thread(target=lambda: [scene.trace(rays, method='while-while') for _ in range(2)], " \
                "daemon=True).start(); time.sleep(0.1)"  # fmt: skip
        self.ends("scene.trace(rays[:1])", "scene.trace(rays[:1]); " + setup)

    def test_points(self):
        self.ends("scene.nearest(points)", triangles=3000)
        self.ends("scene.nearest(points, numeric='exact')")
        self.ends("scene.nearest(points, ('signed_distances', 'inside'), assume_closed=True)", triangles=3000)

    def test_crossings(self):
        self.ends("scene.count_crossings(rays)", triangles=3000)
        self.ends("scene.crossings(rays)")

    def test_scenes(self):
        self.ends("ballot.Scene(*grid)", self.GRID)
        self.ends("ballot.Scene(*grid, builder='best')", self.GRID)
        self.ends("ref.move(other, 0, corners)", self.GRID + "other = ballot.Scene(*grid, updates='rebuild')")

    def test_files(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.npz")
            save = self.GRID + f"np.savez({path!r}, vertices=grid[0], faces=grid[1])"
            self.ends(f"ballot.load_scene({path!r}, cache=False)", save)

    def test_pictures(self):
        self.ends("ballot.render(scene, None, 1024, 1024, 4096, 'ao')")
        self.ends("scene.make_rays(None, 'ao', 4096, 4096)")
        self.ends("ballot.bench(scene, ('while-while', 'packet'), size=(1024, 1024), repeats=1000)")

    def test_work_that_does_not_stop(self):
        """A call that waits for another thread's ends too; objects may go meanwhile."""
        setup = "other = ballot.Scene(*ref.soup(5)); threading.Thread(target=lambda: [scene.trace(rays, " \
                "method='while-while') for _ in range(2)], daemon=True).start(); time.sleep(0.1)"
        self.ends("del other; ref.move(scene, 0, ref.soup(300)[0]); other = 0", setup)


class Progress(unittest.TestCase):
    def setUp(self):
        self.scene = ballot.Scene(*ref.soup(5))
        self.rays = np.zeros((3 << 20, 6), np.float32)

    def test_called_and_stopped(self):
        seen = []
        self.scene.trace(self.rays, progress=seen.append)
        self.assertEqual(seen, sorted(seen))
        self.assertEqual(seen[-1], 1)
        with self.assertRaisesRegex(ballot.Error, "interrupted after") as caught:
            self.scene.trace(self.rays, progress=lambda done: False)
        self.assertEqual(caught.exception.code, ballot.Code.INTERRUPTED)

    def test_of_other_queries(self):
        for call in (self.scene.count_crossings, self.scene.crossings, lambda r, progress: self.scene.nearest(
                r[:, :3], progress=progress)):  # fmt: skip
            seen = []
            call(self.rays[: 1 << 17], progress=seen.append)
            self.assertEqual(seen, sorted(seen))
            self.assertEqual(seen[-1], 1)
            with self.assertRaisesRegex(ballot.Error, "interrupted after"):
                call(self.rays, progress=lambda done: False)

    def test_an_exception_ends_the_call(self):
        def fail(done):
            raise KeyError("mine")

        with self.assertRaisesRegex(KeyError, "mine"):
            self.scene.trace(self.rays, progress=fail)
        with self.assertRaisesRegex(KeyError, "mine"):
            ballot.render(self.scene, samples=8, shading="ao", progress=fail)
        self.assertEqual(len(self.scene.trace(self.rays[:5])), 5)

    def test_calls_from_it_are_refused(self):
        with self.assertRaisesRegex(ballot.Error, "progress function"):
            self.scene.trace(self.rays, progress=lambda done: self.scene.info)

    def test_what_it_lets_go_of(self):
        extra = [ballot.Scene(*ref.soup(5)), self.scene.submit(self.rays), ballot.Array("rays", 5)]
        self.scene.trace(self.rays, progress=lambda done: extra.clear())
        self.assertEqual(extra, [])


class Forks(Process):
    def test_after_use(self):
        text = self.output("""
            scene = ballot.Scene(*ref.soup(20))
            device = ballot.default_device()
            rays = ref.random_rays(50)
            array = ballot.Array("rays", 5)
            job = scene.submit(np.tile(rays, (20000, 1)))
            child = os.fork()
            if child == 0:
                make = lambda: ballot.Scene(*ref.soup(3), device=device)
                calls = [lambda: scene.trace(rays), lambda: scene.info, make, job.wait,
                         lambda: scene.submit(rays), lambda: device.info, array.read,
                         lambda: ref.move(scene, 0, rays[:, :3])]
                for call in calls:
                    try:
                        call()
                        print("worked")
                    except RuntimeError as error:
                        print(error.code.name, "survive fork()" in str(error))
                sys.stdout.flush()
                del scene, array, job, device
                sys.exit(0)
            print(os.waitpid(child, 0)[1], flush=True)
            print(len(job.wait()), len(scene.trace(rays)))
            """)
        self.assertEqual(text.split("\n"), ["FORKED True"] * 8 + ["0", "1000000 50", ""])

    def test_a_child_has_a_default_device_of_its_own(self):
        text = self.output("""
            vertices, triangles = ref.soup(5000)
            rays = ref.random_rays(500)
            truth = ballot.Scene(vertices, triangles, builder="balanced").trace(rays)
            parent = ballot.default_device()
            for turn in range(3):
                child = os.fork()
                if child == 0:
                    scene = ballot.Scene(vertices, triangles, builder=("balanced", "best", "fast")[turn])
                    same = np.array_equal(scene.trace(rays)["prim"], truth["prim"])
                    scene.nearest(rays[:, :3])
                    print(same, ballot.default_device() is not parent, scene.info.triangles, flush=True)
                    sys.exit(0)
                print(os.waitpid(child, 0)[1], flush=True)
            print(ballot.default_device() is parent)
            """)
        self.assertEqual(text, "True True 5000\n0\n" * 3 + "True\n")

    def test_before_use(self):
        text = self.output("""
            child = os.fork()
            hits = ballot.Scene(*ref.soup(20)).trace(ref.random_rays(50))
            os.write(1, f"{len(hits)}\\n".encode())  # at once: print() may write the end of the line by itself
            if child:
                print(os.waitpid(child, 0)[1], flush=True)
            """)
        self.assertEqual(text, "50\n50\n0\n")

    def test_a_pool_of_processes(self):
        scene = ballot.Scene(*ref.soup(20))
        chunks = np.split(ref.random_rays(60), 3)
        with multiprocessing.get_context("spawn").Pool(2) as pool:
            parts = pool.starmap(ballot.Scene.trace, [(scene, chunk) for chunk in chunks])
        np.testing.assert_array_equal(np.concatenate(parts), scene.trace(np.concatenate(chunks)))


class SubInterpreters(Process):
    def test_are_refused(self):
        text = self.output("""
            try:
                import _interpreters as interpreters
            except ImportError:
                import _xxsubinterpreters as interpreters
            code = "import sys; sys.path[:] = " + repr(sys.path) + chr(10) + "try:" + chr(10) + "    import ballot" \\
                   + chr(10) + "except ImportError as error:" + chr(10) + "    print(error, flush=True)"
            interpreters.run_string(interpreters.create(), code)
            print(len(ballot.Scene(*ref.soup(3)).trace(ref.random_rays(4))))
            """)
        self.assertRegex(text, "^ballot cannot be imported in a sub-interpreter.*\n4\n$")


class Caches(Process):
    TRACE = """
        scene = ballot.Scene(*ref.soup(3000))
        print("hits", np.flatnonzero(scene.trace(ref.random_rays(50000))["prim"] != ballot.MISS).sum())
        """

    def test_that_are_damaged_are_told_and_made_anew(self):
        with tempfile.TemporaryDirectory() as folder:
            good = self.output(self.TRACE, XDG_CACHE_HOME=folder)
            self.assertRegex(good, r"^hits \d+\n$")
            kept = [os.path.join(at, name) for at, _, names in os.walk(os.path.join(folder, "ballot")) for name in names
                    if "mesa" not in at]  # fmt: skip
            for file in kept:
                with open(file, "wb") as old:
                    old.write(b"of another version")
            self.assertGreater(len(kept), 1)
            told = self.output(self.TRACE, XDG_CACHE_HOME=folder)
            self.assertRegex(told, f"^ballot: {folder}/.* is damaged or of another version; it is made anew\nhits")
            self.assertTrue(told.endswith(good), told)
            self.assertEqual(self.output(self.TRACE, XDG_CACHE_HOME=folder), good)

    @unittest.skipUnless(os.path.isdir("/sys/kernel"), "no folder where nobody can write")
    def test_a_home_that_cannot_be_written_is_told(self):
        told = self.output(self.TRACE, XDG_CACHE_HOME="/sys")
        self.assertRegex(told, "^ballot: no cache: /sys/ballot cannot be written: .*; name a folder of your own in "
                               "XDG_CACHE_HOME\nhits .*\n$")  # fmt: skip


class Exits(Process):
    def test_with_a_job_that_runs(self):
        text = self.output("""
            scene = ballot.Scene(*ref.soup(20))
            job = scene.submit(np.tile(ref.random_rays(1 << 20), (3, 1)))
            print("end", flush=True)
            """)
        self.assertEqual(text, "end\n")

    def test_with_everything_open(self):
        text = self.output("""
            keep = [ballot.Device(), ballot.Scene(*ref.soup(20)), ballot.Array("hits", 4), ballot.RaycastingScene()]
            keep.append(keep)
            ballot.cycle = keep
            work = lambda: [keep[1].trace(ref.random_rays(9)) for _ in range(200)]
            threading.Thread(target=work, daemon=True).start()
            """)
        self.assertEqual(text, "")

    def test_without_a_driver(self):
        code = """
            for call in (ballot.devices, lambda: ballot.Scene(*ref.soup(2))):
                try:
                    call()
                except ballot.Error as error:
                    print(error.code.name, error)
            """
        text = self.output(code, VK_DRIVER_FILES="/no/such/file", VK_ICD_FILENAMES="/no/such/file")
        self.assertEqual(text.count("DEVICE"), 2, text)
        self.assertEqual(text.count("apt install mesa-vulkan-drivers"), 2, text)


if __name__ == "__main__":
    unittest.main()
