"""Triangles that overlap boxes."""

import unittest
from fractions import Fraction

import ballot
import numpy as np

TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def clipped(triangle, low, high):
    """Returns whether something of a triangle is left when a box cuts it, in exact arithmetic (Sutherland and Hodgman).
    """
    polygon = [[Fraction(float(x)) for x in corner] for corner in triangle]
    for axis in range(3):
        for end, sign in ((Fraction(float(low[axis])), 1), (Fraction(float(high[axis])), -1)):
            kept = []
            for p, q in zip(polygon, polygon[1:] + polygon[:1]):
                at_p, at_q = sign * (p[axis] - end), sign * (q[axis] - end)
                if at_p >= 0:
                    kept.append(p)
                if (at_p > 0 > at_q) or (at_p < 0 < at_q):
                    share = at_p / (at_p - at_q)
                    kept.append([a + share * (b - a) for a, b in zip(p, q)])
            polygon = kept
    return bool(polygon)


class Overlapping(unittest.TestCase):
    def test_lists_are_those_of_exact_clipping(self):
        rng = np.random.default_rng(7)
        corners = np.float32(rng.integers(-4, 5, (40, 3, 3))) / np.float32(rng.choice([1, 3, 7], (40, 1, 1)))
        scene = ballot.Scene(corners.reshape(-1, 3), np.arange(120).reshape(-1, 3))
        low = rng.integers(-4, 4, (90, 3)).astype(np.float32) / 3
        high = low + rng.integers(0, 3, (90, 3)).astype(np.float32) / 3
        low[::5], high[::5] = corners[:18, 0], corners[:18, 0]  # points, on triangles
        area = [np.any(np.cross(t[1] - t[0], t[2] - t[0])) for t in corners.astype(np.float64)]
        truth = [[k for k in range(40) if area[k] and clipped(corners[k], low[i], high[i])] for i in range(90)]
        counts, hits = scene.overlapping(low, high)
        self.assertEqual(counts.tolist(), [len(t) for t in truth])
        self.assertEqual(hits["prim"].tolist(), [k for t in truth for k in t])
        self.assertGreater(sum(counts), 100)
        self.assertFalse(hits["t"].any() or hits["u"].any() or hits["v"].any())
        self.assertTrue(np.array_equal(scene.count_overlapping(low, high), counts))

    def test_corners_broadcast(self):
        scene = ballot.Scene(TRIANGLE, [[0, 1, 2]])
        low = np.zeros((2, 3, 1, 3), np.float32)
        low[1, ..., 2] = 5
        self.assertEqual(scene.count_overlapping(low, [9, 9, 9]).tolist(), [[[1]] * 3, [[0]] * 3])
        axes = np.zeros((1,) * 9 + (4, 3))
        self.assertEqual(scene.count_overlapping(axes, [1, 1, 1]).shape, (1,) * 9 + (4,))

    def test_unbounded_and_empty_boxes(self):
        scene = ballot.Scene(TRIANGLE, [[0, 1, 2]])
        inf, nan = np.inf, np.nan
        low = [[-inf, -inf, -inf], [0, 0, -1e300], [0, 0, 1], [nan, 0, 0]]
        high = [[inf, inf, inf], [1, 1, 1e300], [1, 1, 0], [1, 1, 1]]
        self.assertEqual(scene.count_overlapping(low, high).tolist(), [1, 1, 0, 0])

    def test_float64_is_rounded_outward(self):
        edge = np.nextafter(np.float32(1), np.float32(2))  # the triangle's plane
        scene = ballot.Scene([[0, 0, edge], [1, 0, edge], [0, 1, edge]], [[0, 1, 2]])
        self.assertEqual(scene.count_overlapping([[0, 0, 0]], [[1, 1, np.float64(edge) - 1e-12]]).tolist(), [1])
        self.assertEqual(scene.count_overlapping([[0, 0, 0]], [[1, 1, np.float32(1)]]).tolist(), [0])

    def test_boxes_about_an_origin(self):
        origin = np.array([5e5, 5e6, 100.0])
        scene = ballot.Scene(origin + np.array(TRIANGLE, np.float64), [[0, 1, 2]])
        low = origin + [[0, 0, -1], [0.75, 0.75, -1], [0.25, 0.25, 0]]
        high = origin + [[0.1, 0.1, 1], [1, 1, 1], [0.25, 0.25, 0]]
        self.assertEqual(scene.count_overlapping(low, high).tolist(), [1, 0, 1])

    def test_filters_leave_triangles_out(self):
        scene = ballot.Scene([*TRIANGLE, [1, 1, 0]], [[0, 1, 2], [1, 3, 2]])
        low, high = np.full((3, 3), -1.0), np.full((3, 3), 2.0)
        counts, hits = scene.overlapping(low, high, excluded=[0, 1, ballot.MISS])
        self.assertEqual(counts.tolist(), [1, 1, 2])
        self.assertEqual(hits["prim"].tolist(), [1, 0, 0, 1])

    def test_bad_corners(self):
        scene = ballot.Scene(TRIANGLE, [[0, 1, 2]])
        one = [[1, 1, 1]]
        for low, high, text in (
            ([[0, 0]], one, "low: shape is"),
            (np.zeros((2, 3)), np.zeros((3, 3)), "expected axes before the last that are as long, or 1"),
            ([["a", "b", "c"]], one, "low"),
            (None, one, "low"),
        ):
            with self.subTest(text=text), self.assertRaisesRegex((TypeError, ValueError), text):
                scene.overlapping(low, high)

    def test_shapes_have_no_triangles(self):
        scene = ballot.Scene(ballot.spheres([[0, 0, 0]], 1))
        with self.assertRaisesRegex(ValueError, "found a scene with shapes; expected triangles alone"):
            scene.overlapping([[0, 0, 0]], [[1, 1, 1]])

    def test_progress_ends_a_call(self):
        scene = ballot.Scene(TRIANGLE, [[0, 1, 2]])
        low = np.zeros((300_000, 3), np.float32)
        with self.assertRaisesRegex(ballot.Error, "interrupted"):
            scene.overlapping(low, low, progress=lambda done: False)


if __name__ == "__main__":
    unittest.main()
