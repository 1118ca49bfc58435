"""Distances of scenes."""

import math
import unittest

import ballot
import numpy as np
import reference as ref


class Clearance(unittest.TestCase):
    def setUp(self):
        self.cube = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)

    def poses(self, *places):
        poses = np.tile(np.eye(4), (len(places), 1, 1))
        poses[:, :3, 3] = places
        return poses

    def test_cubes(self):
        size = np.ptp(ref.CUBE_VERTICES, axis=0)
        columns = ("distances", "prims", "other_prims", "points", "other_points")
        times = []
        poses = self.poses((3 * size[0], 0, 0), (size[0], 0, 0), (0.5 * size[0], 0, 0))
        got = self.cube.clearance(self.cube, columns, poses=poses, times=times)
        self.assertEqual(got["distances"].tolist(), [2 * size[0], 0, 0])
        self.assertEqual(times[0].hits, 3)
        self.assertEqual(got["points"].shape, (3, 3))
        self.assertEqual(np.linalg.norm(got["points"][0] - got["other_points"][0]), 2 * size[0])
        self.assertEqual({k: a.dtype.name for k, a in got.items()},
                         {"distances": "float64", "prims": "uint32", "other_prims": "uint32", "points": "float64",
                          "other_points": "float64"})  # fmt: skip

    def test_shapes_of_poses(self):
        poses = self.poses(*[(9, 0, 0)] * 6).reshape(2, 3, 4, 4)
        self.assertEqual(self.cube.clearance(self.cube, poses=poses)["distances"].shape, (2, 3))
        self.assertEqual(self.cube.clearance(self.cube)["distances"].shape, ())
        self.assertEqual(self.cube.clearance(self.cube)["distances"], 0)

    def test_limits(self):
        poses = self.poses((9, 0, 0), (9, 0, 0))
        got = self.cube.clearance(self.cube, ("distances", "prims"), poses=poses, limit=[1, 20])
        self.assertEqual(got["prims"][0], ballot.MISS)
        self.assertTrue(math.isinf(got["distances"][0]) and got["distances"][1] < 9)

    def test_origins_in_double(self):
        origin = np.array([5e5, 5e6, 100.0])
        here = ballot.Scene(origin + np.float64(ref.CUBE_VERTICES), ref.CUBE_TRIANGLES)
        there = ballot.Scene(origin + [1e5, 0, 0] + np.float64(ref.CUBE_VERTICES), ref.CUBE_TRIANGLES)
        size = np.ptp(ref.CUBE_VERTICES, axis=0)[0]
        got = here.clearance(there, ("distances", "points"))
        self.assertEqual(got["distances"], 1e5 - size)
        self.assertEqual(got["points"][0], origin[0] + np.max(ref.CUBE_VERTICES[:, 0]))

    def test_bad_input(self):
        for call, error, text in (
            (lambda: self.cube.clearance(3), TypeError, "other: found int; expected a ballot.Scene"),
            (lambda: self.cube.clearance(self.cube, poses=np.eye(3)), ValueError, "poses: shape is"),
            (lambda: self.cube.clearance(self.cube, limit=-1), ValueError, "limit of pose 0 is -1"),
            (lambda: self.cube.clearance(self.cube, limit=[1, 2]), ValueError, "limit: shape is"),
            (lambda: self.cube.clearance(self.cube, ("far",)), ValueError, "columns: found 'far'"),
            (lambda: self.cube.clearance(self.cube, poses=self.poses((math.nan, 0, 0))), ValueError, "expected finite"),
            (lambda: self.cube.clearance(self.cube, poses=self.poses((1e31, 0, 0))), ValueError, r"within \+-1e\+30"),
            (lambda: self.cube.clearance(ballot.Scene(ballot.spheres([[0, 0, 0]], 1))), ValueError, "has shapes"),
        ):
            with self.subTest(text=text), self.assertRaisesRegex(error, text):
                call()


if __name__ == "__main__":
    unittest.main()
