"""Threads that make, move, trace and let go of scenes on one device.

BALLOT_SOAK_SECONDS makes it long; BALLOT_SOAK_VALIDATE=1 runs it under the validation layers, which must be silent.
"""

import gc
import os
import threading
import time
import unittest

import ballot
import numpy as np
import reference as ref

SECONDS = float(os.environ.get("BALLOT_SOAK_SECONDS", "4"))
VALIDATE = os.environ.get("BALLOT_SOAK_VALIDATE", "0") == "1"


def resident() -> int:
    """Returns the memory of this process in bytes."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


class Threads(unittest.TestCase):
    def run_threads(self, work, count=4, seconds=SECONDS):
        """Runs work(number) over and over in threads, and returns how often, and the memory at each tenth."""
        stop, failures, rounds = threading.Event(), [], [0] * count

        def loop(number):
            while not stop.is_set():
                try:
                    work(number)
                    rounds[number] += 1
                except BaseException as error:  # noqa: BLE001
                    failures.append(error)
                    return

        threads = [threading.Thread(target=loop, args=(n,)) for n in range(count)]
        for thread in threads:
            thread.start()
        memory = []
        for _ in range(10):
            time.sleep(seconds / 10)
            memory.append(resident())
        stop.set()
        for thread in threads:
            thread.join()
        if failures:
            raise failures[0]
        self.assertTrue(all(rounds), rounds)
        return sum(rounds), memory

    def test_scenes_come_and_go(self):
        device = ballot.Device(validate=VALIDATE)
        rays = ref.random_rays(256)
        meshes = [ref.soup(60, seed) for seed in range(4)]
        truth = [ballot.Scene(*mesh, device=device).trace(rays, method="while-while") for mesh in meshes]

        def work(number):
            vertices, triangles = meshes[number]
            scene = ballot.Scene(vertices + np.float32(0.5), triangles, device=device)
            ref.move(scene, 0, vertices)
            np.testing.assert_array_equal(scene.trace(rays, method="while-while"), truth[number])
            job = scene.submit(rays, method="while-while")
            array = ballot.Array("rays", 256, device=device)
            array.write(np.zeros((256, 8), np.float32))
            if number % 2:
                np.testing.assert_array_equal(job.wait(), truth[number])
            else:
                scene.close()

        self.run_threads(work, seconds=min(SECONDS, 2))
        gc.collect()
        rounds, memory = self.run_threads(work)
        growth = (memory[-1] - memory[1]) / 2**20
        print(f"{rounds} scenes, {memory[-1] / 2**20:.0f} MiB, {growth:+.1f} MiB", end=" ")
        self.assertTrue(growth < 16 or ref.SANITIZED, growth)
        self.assertEqual(device.messages, 0)

    def test_one_scene(self):
        """Threads that trace in one scene, one that moves it, and one that only computes and is not held up."""
        vertices, triangles = ref.soup(60)
        rays = ref.random_rays(4096)
        scene = ballot.Scene(vertices, triangles)
        truth = scene.trace(rays)

        def work(number):
            if number == 0:
                ref.move(scene, 0, vertices)
            elif number == 1:
                scene.info, scene.meshes, scene.triangles()  # noqa: B018
            else:
                np.testing.assert_array_equal(scene.trace(rays, progress=lambda done: None), truth)

        self.run_threads(work, seconds=2)

    def test_other_threads_run_meanwhile(self):
        scene = ballot.Scene(*ref.soup(500))
        rays = np.tile(ref.random_rays(1 << 18), (4, 1))
        scene.trace(rays[:64], method="while-while")
        thread = threading.Thread(target=scene.trace, args=(rays,), kwargs={"method": "while-while"})
        thread.start()
        turns = 0
        while thread.is_alive():
            time.sleep(0.001)
            turns += 1
        self.assertGreater(turns, 20)

    def test_a_default_device_for_all(self):
        found = []
        threads = [threading.Thread(target=lambda: found.append(ballot.default_device())) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(set(map(id, found))), 1)

    def test_a_scene_closed_in_another_thread(self):
        scene = ballot.Scene(*ref.soup(100))
        rays = np.tile(ref.random_rays(1 << 18), (4, 1))
        hits = []
        thread = threading.Thread(target=lambda: hits.append(scene.trace(rays)))
        thread.start()
        time.sleep(0.05)
        scene.close()
        thread.join()
        self.assertEqual(len(hits[0]), len(rays))

    def test_a_lazy_build(self):
        scene = ballot.RaycastingScene()
        scene.add_triangles(*ref.soup(100))
        rays = ref.random_rays(100)
        truth = scene.cast_rays(rays)["t_hit"]

        def work(number):
            if number == 0:
                scene.add_triangles(*ref.soup(1, seed=99)) if len(scene._meshes) < 2 else None
            scene.cast_rays(rays)

        self.run_threads(work, seconds=1)
        self.assertEqual(truth.shape, (100,))


if __name__ == "__main__":
    unittest.main()
