"""Signals, forks, progress functions, exits and other processes."""

import multiprocessing
import os
import signal
import subprocess
import sys
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
        scene = ballot.Scene(*ref.soup(300))
        rays = np.tile(ref.random_rays(1 << 20), (24, 1))
        scene.trace(rays[:64])
        print("ready", flush=True)
        try:
            {call}
        except KeyboardInterrupt:
            print("interrupted", flush=True)
        print(len(scene.trace(rays[:64])), "rays after it")
        """

    def interrupt(self, call: str) -> tuple[str, float]:
        process = start(self.LONG.format(call=call))
        self.addCleanup(process.kill)
        self.assertEqual(process.stdout.readline(), "ready\n")
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        begin = time.monotonic()
        first = process.stdout.readline()
        waited = time.monotonic() - begin
        self.assertEqual((process.stdout.read(), process.wait()), ("64 rays after it\n", 0))
        process.stdout.close()
        return first, waited

    def test_ctrl_c_ends_a_trace(self):
        first, waited = self.interrupt("scene.trace(rays, method='while-while')")
        self.assertEqual(first, "interrupted\n")
        self.assertLess(waited, 60)

    def test_ctrl_c_ends_the_waiting_for_a_job(self):
        first, waited = self.interrupt("job = scene.submit(rays[:8 << 20], method='while-while'); job.wait()")
        self.assertEqual(first, "interrupted\n")
        self.assertLess(waited, 30)

    def test_ctrl_c_ends_a_picture(self):
        first, _ = self.interrupt("ballot.render(scene, None, 1024, 1024, 4096, 'ao')")
        self.assertEqual(first, "interrupted\n")


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
            rays = ref.random_rays(50)
            array = ballot.Array("rays", 5)
            job = scene.submit(np.tile(rays, (20000, 1)))
            child = os.fork()
            if child == 0:
                device = ballot.default_device()
                calls = [lambda: scene.trace(rays), lambda: scene.info, lambda: ballot.Scene(*ref.soup(3)), job.wait,
                         lambda: scene.submit(rays), lambda: device.info, array.read,
                         lambda: scene.update(0, rays[:, :3])]
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
