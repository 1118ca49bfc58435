"""Process pools and workers that load data, by fork and by spawn, beside a parent that has used its device."""

import concurrent.futures
import multiprocessing
import os
import unittest
from collections.abc import Iterator
from typing import Any

import ballot
import numpy as np
import reference as ref

METHODS = ("fork", "spawn")
BATCHES, RAYS = 12, 500


class RayData:
    """A data set as those of torch: its scene is made where it is asked first, in each process."""

    def __init__(self, triangles: int):
        self.arrays = ref.soup(triangles)
        self.process, self.scene = 0, None

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "process": 0, "scene": None}

    def __getitem__(self, number: int) -> np.ndarray:
        if self.process != os.getpid():
            self.process, self.scene = os.getpid(), ballot.Scene(*self.arrays)
        rays = np.random.default_rng(number).normal(size=(RAYS, 6)).astype(np.float32)
        return self.scene.trace(rays)


def serve(data: RayData, asked: Any, answered: Any) -> None:
    for number in iter(asked.get, None):
        answered.put((number, data[number]))


class Loader:
    """Two workers that stay for all epochs. Iterating gives the batches in order."""

    def __init__(self, data: RayData, method: str):
        context = multiprocessing.get_context(method)
        self.asked, self.answered = context.Queue(), context.Queue()
        words = (data, self.asked, self.answered)
        self.workers = [context.Process(target=serve, args=words, daemon=True) for _ in range(2)]
        for worker in self.workers:
            worker.start()

    def __iter__(self) -> Iterator[np.ndarray]:
        for number in range(BATCHES):
            self.asked.put(number)
        found = dict(self.answered.get(timeout=120) for _ in range(BATCHES))
        return iter([found[number] for number in range(BATCHES)])

    def close(self) -> list[int | None]:
        for _ in self.workers:
            self.asked.put(None)
        for worker in self.workers:
            worker.join(120)
        return [worker.exitcode for worker in self.workers]


class Pools(unittest.TestCase):
    def setUp(self) -> None:
        self.data = RayData(200)
        self.expected = [self.data[number].tobytes() for number in range(BATCHES)]

    def test_executors(self) -> None:
        for method in METHODS:
            context = multiprocessing.get_context(method)
            with self.subTest(method), concurrent.futures.ProcessPoolExecutor(2, mp_context=context) as pool:
                found = pool.map(self.data.__getitem__, range(BATCHES), timeout=120)
                self.assertEqual([hits.tobytes() for hits in found], self.expected)

    def test_loaders(self) -> None:
        for method in METHODS:
            with self.subTest(method):
                loader = Loader(self.data, method)
                for _ in range(2):
                    self.assertEqual([hits.tobytes() for hits in loader], self.expected)
                self.assertEqual(loader.close(), [0, 0])
        self.assertEqual(self.data[0].tobytes(), self.expected[0])


if __name__ == "__main__":
    unittest.main()
