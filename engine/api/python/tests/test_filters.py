"""What leaves out triangles by words of rays and points, and the last hits of rays."""

import pickle
import unittest

import ballot
import numpy as np
import reference as ref

COPIES = 6


def words(array):
    on = ballot.Array("uint32", len(array))
    on.write(np.uint32(array))
    return on


class Filters(unittest.TestCase):
    def setUp(self):
        self.each = 60
        matrices = np.tile(np.eye(3, 4), (COPIES + 1, 1, 1))
        matrices[:, 2, 3] = 0.01 * np.arange(COPIES + 1)
        self.groups = np.r_[ballot.SHARED, np.arange(COPIES) % 3]
        self.scene = ballot.Scene(meshes=[ref.soup(60)], instances=matrices, groups=self.groups)
        self.rays = np.float32(ref.random_rays(300))
        self.mine = np.arange(300, dtype=np.uint32) % 4

    def lists(self, **options):
        """Returns the crossings of each ray, of its group and shared ones, by those of all."""
        counts, hits = self.scene.crossings(self.rays, **options)
        groups = self.groups[hits["prim"] // self.each]
        ray = np.repeat(np.arange(len(counts)), counts)
        kept = (groups == ballot.SHARED) | (groups == self.mine[ray])
        return [hits[kept & (ray == i)] for i in range(len(counts))]

    def test_groups(self):
        truth = self.lists()
        counts, hits = self.scene.crossings(self.rays, groups=self.mine)
        self.assertEqual(counts.tolist(), [len(t) for t in truth])
        self.assertGreater(len(hits), 100)
        np.testing.assert_array_equal(hits["prim"], np.concatenate(truth)["prim"])
        nearest = self.scene.trace(self.rays, groups=self.mine)
        prims = [t["prim"][0] if len(t) else ballot.MISS for t in truth]
        np.testing.assert_array_equal(nearest["prim"], prims)
        np.testing.assert_array_equal(
            self.scene.occluded(self.rays, groups=self.mine), [len(t) > 0 for t in truth]
        )
        there = ballot.Array("rays", 300)
        there.write(np.c_[self.rays[:, :3], np.zeros(300), self.rays[:, 3:6], np.full(300, 1e30)])
        np.testing.assert_array_equal(self.scene.trace(there, groups=words(self.mine)).read(), nearest)
        listed = self.scene.crossings(there, groups=words(self.mine))
        np.testing.assert_array_equal(listed.counts.read(), counts)
        np.testing.assert_array_equal(self.scene.count_crossings(there, groups=words(self.mine)).read(), counts)
        points = ballot.Array("points", 300)
        points.write(np.c_[self.rays[:, :3], np.full(300, 0.5)])
        within = self.scene.within(points, groups=words(self.mine), excluded=words(nearest["prim"]))
        here = self.scene.within(self.rays[:, :3], 0.5, groups=self.mine, excluded=nearest["prim"])
        np.testing.assert_array_equal(within.counts.read(), here.counts)
        sums = self.scene.sums(self.rays, by="instance", groups=self.mine)
        self.assertEqual(sums[-1], sum(p == ballot.MISS for p in prims))

    def test_the_triangle_that_a_ray_left(self):
        first = self.scene.trace(self.rays)
        second = self.scene.trace(self.rays, excluded=first["prim"])
        np.testing.assert_array_equal(second, self.scene.trace(self.rays, first=2)[:, 1])
        points = self.rays[:, :3]
        alone = ballot.Scene(*ref.soup(60))
        near = alone.nearest(points)["prims"]
        far = alone.nearest(points, ("prims", "distances"), excluded=near)
        self.assertFalse((near == far["prims"]).any())
        self.assertTrue((far["distances"] >= alone.nearest(points)["distances"]).all())
        same = self.scene.within(points, 0.5, excluded=ballot.MISS)
        np.testing.assert_array_equal(same.counts, self.scene.within(points, 0.5).counts)

    def test_last(self):
        for options in ({}, {"cull": "back"}, {"numeric": "exact"}):
            counts, hits = self.scene.crossings(self.rays, **options)
            ends = np.cumsum(counts)
            last = self.scene.trace(self.rays, last=3, **options)
            self.assertEqual(last.shape, (300, 3))
            for i, (count, end) in enumerate(zip(counts, ends)):
                mine = hits[end - count : end][::-1][:3]
                np.testing.assert_array_equal(last["t"][i, : len(mine)], mine["t"])
                self.assertTrue((last["prim"][i, len(mine) :] == ballot.MISS).all())
            columns = self.scene.trace_columns(self.rays, ("t", "normals"), last=2, **options)
            self.assertEqual(columns["normals"].shape, (300, 2, 3))
            np.testing.assert_array_equal(columns["t"], last["t"][:, :2])
        there = ballot.Array("rays", 300)
        there.write(np.c_[self.rays[:, :3], np.zeros(300), self.rays[:, 3:6], np.full(300, 1e30)])
        found = self.scene.trace(there, last=3).read()
        np.testing.assert_array_equal(found.reshape(300, 3), self.scene.trace(self.rays, last=3))

    def test_edits_and_pickles(self):
        new = self.scene.add_instances(np.eye(4)[None], groups=5)
        self.scene.set_groups([1, 2], [9, ballot.SHARED])
        self.scene.commit()
        self.groups = np.r_[self.groups, 5]
        self.groups[[1, 2]] = 9, ballot.SHARED
        self.assertEqual([i.group for i in self.scene.instances], self.groups.tolist())
        self.test_groups()
        again = pickle.loads(pickle.dumps(self.scene))
        self.assertEqual([i.group for i in again.instances], self.groups.tolist())
        np.testing.assert_array_equal(
            again.trace(self.rays, groups=self.mine), self.scene.trace(self.rays, groups=self.mine)
        )
        self.assertEqual(new.tolist(), [COPIES + 1])

    def test_bad_input(self):
        scene, rays = self.scene, self.rays
        there = ballot.Array("rays", 300)
        for error, text, call in (
            (ValueError, "last is 0; expected 1 to 16", lambda: scene.trace(rays, last=0)),
            (ValueError, "last is 1000; expected 1 to 16", lambda: scene.trace(rays, last=1000)),
            (ValueError, "last is set and first is set", lambda: scene.trace(rays, first=1, last=1)),
            (ValueError, "last is set and any is 1", lambda: scene.occluded(rays, last=1)),
            (TypeError, "last: found an argument that is no option", lambda: scene.crossings(rays, last=1)),
            (ValueError, "groups: found float32", lambda: scene.trace(rays, groups=np.zeros(300, np.float32))),
            (ValueError, "groups: found int64, -1", lambda: scene.trace(rays, groups=-1)),
            (ValueError, r"excluded: shape is \(299,\)", lambda: scene.trace(rays, excluded=np.zeros(299, int))),
            (TypeError, "excluded: found ndarray", lambda: scene.trace(there, excluded=self.mine)),
            (ValueError, "groups has 9 records", lambda: scene.trace(there, groups=ballot.Array("uint32", 9))),
            (ValueError, "told of the whole scene", lambda: scene.nearest(rays[:, :3], ("inside",), groups=1)),
            (ValueError, "told of the whole scene", lambda: scene.nearest(rays[:, :3], ("inside",), excluded=1)),
            (TypeError, "cull: found an argument", lambda: scene.nearest(rays[:, :3], cull="back")),
            (ValueError, "groups: found 2; expected 1", lambda: scene.set_groups([0], [1, 2])),
            (ValueError, "groups: number 0 is -1", lambda: scene.set_groups([0], [-1])),
            (ValueError, "instance 99", lambda: scene.set_groups([99], [1])),
            (ValueError, "groups: there are no instances", lambda: ballot.Scene(*ref.soup(2), groups=[1])),
            (ValueError, "groups: found 2; expected 1", lambda: ballot.Scene(
                *ref.soup(2), instances=np.eye(4)[None], groups=[1, 2])),
        ):  # fmt: skip
            with self.subTest(text=text), self.assertRaisesRegex(error, text):
                call()


if __name__ == "__main__":
    unittest.main()
