"""Kernels of the user: they find what the built-in answers are, and bad input is refused."""

import pathlib
import signal
import tempfile
import threading
import time
import unittest

import ballot
import numpy as np
import reference as ref

TRACE = """
readonly buffer Rays { Ray rays[]; };
buffer Hits { Hit hits[]; };
void main(uint index) { hits[index] = nearest(rays[index]); }
"""
ADD = """
struct Cell { vec3 at; uint count; };
readonly buffer From { vec3 from[]; };
readonly buffer Steps { int steps[]; };
buffer Cells { Cell cells[]; };
buffer Sums { float sums[]; };
uniform vec2 scale;
uniform uint more;
void main(uint index) {
  sums[index] = dot(from[index].xy, scale) + float(steps[index]);
  cells[index] = Cell(2.0 * from[index], cells[index].count + more);
}
"""
CELL = np.dtype([("at", "<f4", 3), ("count", "<u4")])


class Kernels(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = ballot.Scene(*ref.soup(200))
        rays = ref.random_rays(300)
        cls.rays = np.zeros((300, 8), np.float32)
        cls.rays[:, :3], cls.rays[:, 4:7], cls.rays[:, 7] = rays[:, :3], rays[:, 3:], 100
        cls.kernel = ballot.Kernel(TRACE)

    def test_arrays_here_and_there(self):
        want = self.scene.trace(self.rays)
        hits = np.zeros(300, ballot.HIT)
        times = self.kernel(self.scene, 300, {"rays": self.rays, "hits": hits})
        self.assertGreater(times.device_ms, 0)
        self.assertEqual(hits.tobytes(), want.tobytes())
        rows = np.zeros((300, 4), np.float32)
        self.kernel(self.scene, 300, {"rays": self.rays.astype(np.float64), "hits": rows})
        self.assertEqual(rows.tobytes(), want.tobytes())
        there, found = ballot.Array("rays", 300), ballot.Array("hits", 300)
        there.write(self.rays)
        self.kernel(self.scene, 200, {"rays": there.read().view(ballot.RAY), "hits": found})
        self.kernel(self.scene, 300, {"rays": there, "hits": found})
        self.assertEqual(found.read().tobytes(), want.tobytes())

    def test_instances_that_move(self):
        places = np.zeros((3, 3, 4), np.float32)
        places[:, range(3), range(3)] = 1
        scene = ballot.Scene(*ref.soup(200), instances=places)
        hits = np.zeros(300, ballot.HIT)
        for step in range(3):
            self.kernel(scene, 300, {"rays": self.rays, "hits": hits})
            self.assertEqual(hits.tobytes(), scene.trace(self.rays).tobytes())
            places[:, 0, 3] += [0, 0.3, 0.1 * step]
            scene.set_transforms(places)
            scene.commit()

    def test_structs_and_numbers(self):
        kernel = ballot.Kernel(ADD, name="add")
        self.assertEqual(kernel.inputs[2], ballot.InputInfo("cells", "Cell", True, True, 16))
        self.assertEqual(kernel.inputs[5], ballot.InputInfo("more", "uint", False, False, 4))
        cells, sums = np.zeros(5, CELL), np.zeros((5, 1), np.float32)
        cells["count"] = 7
        points = np.arange(15.0).reshape(5, 3)
        given = {"from": points, "steps": [1, 2, 3, 4, -5], "cells": cells, "sums": sums}
        for more in (1, np.uint8(2), [3]):
            kernel(self.scene, 5, given, scale=(1, 0.5), more=more)
        np.testing.assert_array_equal(sums[:, 0], points[:, 0] + 0.5 * points[:, 1] + [1, 2, 3, 4, -5])
        np.testing.assert_array_equal(cells["at"], 2 * points)
        np.testing.assert_array_equal(cells["count"], [13] * 5)

    def test_lengths(self):
        kernel = ballot.Kernel("buffer A { uint a[]; };\nvoid main(uint i) { a[i] = uint(a.length()); }")
        for count in (1, 2, 3, 5, 70000):
            lengths = np.zeros(count, np.uint32)
            kernel(self.scene, count, {"a": lengths})
            self.assertEqual(set(lengths.tolist()), {count})

    def test_texts(self):
        with self.assertRaisesRegex(ValueError, r"(?s)kernel k does not compile:\nERROR: a/b\.glsl:12: 'nothing'"):
            ballot.Kernel("\nvoid main(uint i) { nothing(); }", name="k", file="a/b.glsl", first_line=11)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder, "own.glsl")
            path.write_text("void main(uint i) {\n int x = 1.5;\n}")
            with self.assertRaisesRegex(ValueError, r"own\.glsl:2"):
                ballot.Kernel(path)
            path.write_text(TRACE)
            self.assertEqual(len(ballot.Kernel(path).inputs), 2)
            with self.assertRaises(FileNotFoundError):
                ballot.Kernel(pathlib.Path(folder, "other.glsl"))
        for wrong in (3, None, b"void main(uint i) {}"):
            with self.assertRaises(TypeError):
                ballot.Kernel(wrong)
        with self.assertRaisesRegex(ValueError, "numeric mode"):
            ballot.Kernel(TRACE, numeric="exact")
        with self.assertRaisesRegex(ValueError, "an argument's"):
            ballot.Kernel("uniform float progress; void main(uint i) {}")

    def test_wrong_inputs(self):
        hits, rays = np.zeros(300, ballot.HIT), self.rays
        wrong = [
            (TypeError, "'hits'.*is not given", {"rays": rays}, {}),
            (TypeError, "'more'.*declares rays, hits", {"rays": rays, "hits": hits, "more": rays}, {}),
            (TypeError, "number 'speed'.*declares none", {"rays": rays, "hits": hits}, {"speed": 1}),
            (TypeError, "dtype is float64; the kernel writes Hit", {"rays": rays, "hits": np.zeros((300, 4))}, {}),
            (TypeError, "list", {"rays": rays, "hits": [[0, 0, 0, 0]]}, {}),
            (ValueError, r"shape is \(300, 6\)", {"rays": rays[:, :6], "hits": hits}, {}),
            (ValueError, "0 bytes", {"rays": rays[:0], "hits": hits}, {}),
            (ValueError, "strides", {"rays": rays, "hits": hits[::2]}, {}),
            (ValueError, "32 bytes each; found 48", {"rays": ballot.Array("hits", 3), "hits": hits}, {}),
        ]
        for error, text, buffers, numbers in wrong:
            with self.subTest(text), self.assertRaisesRegex(error, text):
                self.kernel(self.scene, 300, buffers, **numbers)
        with self.assertRaisesRegex(TypeError, "scene: found int"):
            self.kernel(1, 1, {"rays": rays, "hits": hits})
        with self.assertRaisesRegex(ValueError, "count is -1"):
            self.kernel(self.scene, -1, {"rays": rays, "hits": hits})
        self.assertTrue((hits["prim"] == 0).all())
        add = ballot.Kernel(ADD)
        given = {"from": [[1, 2, 3]], "steps": [1], "cells": np.zeros(1, CELL), "sums": np.zeros(1, np.float32)}
        for error, text, change, numbers in (
            (ValueError, "2 numbers for vec2", {}, {"scale": 1, "more": 1}),
            (ValueError, "uint32", {}, {"scale": (1, 2), "more": -1}),
            (TypeError, "more", {}, {"scale": (1, 2), "more": 0.5}),
            (ValueError, "int32", {"steps": np.array([2**31])}, {"scale": (1, 2), "more": 1}),
            (ValueError, "16 bytes each", {"cells": np.zeros(3, np.float32)}, {"scale": (1, 2), "more": 1}),
        ):
            with self.subTest(text), self.assertRaisesRegex(error, text):
                add(self.scene, 1, {**given, **change}, **numbers)

    def test_ends(self):
        slow = ballot.Kernel("""
buffer Sums { uint sums[]; };
void main(uint index) {
  uint sum = 0u;
  for (uint i = 0u; i < 60000u; ++i) sum += i ^ (sum * 3u);
  sums[index % 64u] = sum;
}""")
        sums = np.zeros(64, np.uint32)
        told = []
        with self.assertRaises(ballot.Error) as caught:
            slow(self.scene, 2**32 - 1, {"sums": sums}, progress=lambda done: told.append(done) or len(told) < 3)
        self.assertEqual(caught.exception.code, ballot.Code.INTERRUPTED)
        if threading.current_thread() is threading.main_thread():
            pressed = []

            def press(*_):
                pressed.append(time.monotonic())
                raise KeyboardInterrupt

            before = signal.signal(signal.SIGALRM, press)
            signal.setitimer(signal.ITIMER_REAL, 0.3)
            try:
                with self.assertRaises(KeyboardInterrupt):
                    slow(self.scene, 2**32 - 1, {"sums": sums})
                self.assertLess(time.monotonic() - pressed[0], 0.5 + ref.SANITIZED)
            finally:
                signal.signal(signal.SIGALRM, before)
        slow.close()
        with self.assertRaises(ballot.Error):
            slow(self.scene, 1, {"sums": sums})
        self.kernel(self.scene, 300, {"rays": self.rays, "hits": np.zeros(300, ballot.HIT)})


if __name__ == "__main__":
    unittest.main()
