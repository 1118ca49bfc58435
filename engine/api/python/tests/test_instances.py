"""Scenes of instances: results, moves, pickling, and what is refused."""

import pickle
import unittest

import ballot
import numpy as np
import reference as ref

CUBE = (ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
SQUARE = (np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.uint32([[0, 1, 2], [0, 2, 3]]))


def at(x, y, z, scale=1.0):
    m = np.eye(4)
    m[:3, :3] *= scale
    m[:3, 3] = x, y, z
    return m


def down(*points):
    return np.float32([[x, y, 50, 0, 0, -1] for x, y in points])


class Instances(unittest.TestCase):
    def setUp(self):
        self.transforms = np.stack([at(0, 0, 0), at(10, 0, 0, 2), at(0, 0, 5), at(20, 0, 0) * [[-1], [1], [1], [1]]])
        self.scene = ballot.Scene(
            meshes=[CUBE, SQUARE], ids=[7, 9], instances=self.transforms, instance_meshes=[0, 0, 1, 1]
        )

    def test_columns_name_instance_and_triangle(self):
        rays = down((0.25, 0.3), (10.5, 0.7), (-0.5, -0.4), (-20.2, 0.5), (40, 40))
        out = self.scene.trace_columns(rays, ("t", "prims", "mesh_ids", "instances", "normals"))
        self.assertEqual(out["instances"].tolist(), [2, 1, 0, 3, ballot.MISS])
        self.assertEqual(out["mesh_ids"].tolist(), [9, 7, 7, 9, ballot.MISS])
        np.testing.assert_array_equal(out["t"], [45, 48, 49, 50, np.inf])
        self.assertEqual(out["normals"][:4, 2].tolist(), [1, 1, 1, -1])  # a mirror turns the vertices round
        hits = self.scene.trace(rays)
        firsts = [0, 12, 24, 26]
        for i, k in enumerate([2, 1, 0, 3]):
            self.assertEqual(hits["prim"][i], firsts[k] + out["prims"][i])
        info = self.scene.info
        self.assertEqual((info.instances, info.instance_triangles, info.triangles), (4, 28, 14))

    def test_infos(self):
        infos = self.scene.instances
        self.assertEqual([tuple(i)[:5] for i in infos][1:3], [("mesh 0", 1, 0, 12, 12), ("mesh 1", 2, 1, 24, 2)])
        for info, transform in zip(infos, self.transforms):
            np.testing.assert_array_equal(info.transform, transform[:3])
        self.assertEqual((infos[1].lo, infos[1].hi), ((8, -2, -2), (12, 2, 2)))

    def test_masks_are_of_instances(self):
        self.scene.set_masks([0, 1, 2, 3], [1, 1, 2, 2])
        self.scene.commit()
        self.assertEqual(self.scene.count_crossings(down((0.25, 0.3)), masks=[2]).tolist(), [1])
        points = np.array([[0.25, 0.3, 50]] * 4)
        distances = self.scene.nearest(points, ["distances"], masks=[1, 2, 3, 4])["distances"]
        self.assertEqual(distances[2], distances[:2].min())
        self.assertNotEqual(*distances[:2])
        self.assertEqual(distances[3], np.inf)
        counts = self.scene.within(points, 1e3, masks=[1, 2, 3, 4]).counts
        self.assertEqual(counts.tolist(), [24, 4, 28, 0])
        np.testing.assert_array_equal(
            self.scene.nearest(points, ["prims"], masks=1)["prims"],
            self.scene.nearest(points, ["prims"], masks=np.full(4, 1, np.uint8))["prims"],
        )
        for column in ("inside", "signed_distances"):
            with self.assertRaisesRegex(ValueError, "told of the whole scene"):
                self.scene.nearest(points, [column], masks=1)
        self.scene.set_masks(2, 0)
        self.scene.commit()
        self.assertEqual(self.scene.trace_columns(down((0.25, 0.3)), ["instances"])["instances"].tolist(), [0])

    def test_hits_are_those_of_moved_copies(self):
        vertices, triangles = [], []
        for m, (v, t) in zip(self.transforms, [CUBE, CUBE, SQUARE, SQUARE]):
            triangles.append(t + sum(len(x) for x in vertices))
            vertices.append((v @ m[:3, :3].T + m[:3, 3]).astype(np.float32))
        flat = ballot.Scene(np.concatenate(vertices), np.concatenate(triangles))
        random = np.random.default_rng(3)
        origins = random.uniform(-15, 15, (3000, 3))
        targets = random.uniform((-22, -2, -2), (12, 2, 5), (3000, 3))
        rays = np.concatenate([origins, targets - origins], axis=1).astype(np.float32)
        a, b = flat.trace(rays), self.scene.trace(rays)
        np.testing.assert_array_equal(a["prim"] == ballot.MISS, b["prim"] == ballot.MISS)
        hit = a["prim"] != ballot.MISS
        self.assertGreater(hit.sum(), 300)
        np.testing.assert_allclose(a["t"][hit], b["t"][hit], rtol=1e-5)

    def test_update_moves_instances(self):
        rays = down((0.25, 0.3))
        self.transforms[2, 2, 3] = 8
        ref.place(self.scene, self.transforms[:, :3].astype(np.float32))
        self.assertEqual(self.scene.trace(rays)["t"][0], 42)
        again = pickle.loads(pickle.dumps(self.scene))
        np.testing.assert_array_equal(again.trace(rays), self.scene.trace(rays))
        self.assertEqual(again.info.instances, 4)

    def test_one_mesh_and_none(self):
        scene = ballot.Scene(*SQUARE, instances=[np.eye(4).tolist()])
        self.assertEqual(scene.trace_columns(down((0.2, 0.4)), ("instances",))["instances"].tolist(), [0])
        none = ballot.Scene(*SQUARE, instances=np.zeros((0, 3, 4)))
        self.assertEqual(none.trace(down((0.2, 0.4)))["prim"][0], ballot.MISS)

    def test_scenes_without_instances(self):
        scene = ballot.Scene(*SQUARE)
        out = scene.trace_columns(down((0.2, 0.4), (9, 9)), ("instances",))
        self.assertEqual(out["instances"].tolist(), [0, ballot.MISS])
        with self.assertRaisesRegex(ValueError, "2 transforms, but the scene has 1 instances"):
            ref.place(scene, np.eye(4)[None].repeat(2, 0))

    def test_wrong_arguments(self):
        for text, instances, meshes in (
            (r"instances: shape is \(3, 4\)", np.eye(4)[:3], None),
            (r"instances: shape is \(1, 2, 4\)", np.zeros((1, 2, 4)), None),
            ("instance 0: column 0 of the transform has 0", np.zeros((1, 3, 4)), None),
            ("instance 0: column 0 of the transform has 1e", at(0, 0, 0, 1e30)[None], None),
            ("instance 0: the matrix of the transform is singular", np.ones((1, 3, 4)), None),
            (r"instance 0: entry \[0\]\[3\] of the transform is nan", at(np.nan, 0, 0)[None], None),
            ("instance 0: its mesh is number 5", np.eye(4)[None], [5]),
            ("instance_meshes: shape is", np.eye(4)[None], [0, 0]),
            ("instance_meshes: number 0 is -1", np.eye(4)[None], [-1]),
            ("there are no instances", None, [0]),
        ):
            with self.subTest(text), self.assertRaisesRegex(ValueError, text):
                ballot.Scene(meshes=[CUBE], instances=instances, instance_meshes=meshes)
        with self.assertRaisesRegex(ValueError, "packet-wide: it has no kernel for scenes with instances"):
            self.scene.trace(down((0, 0)), method="packet-wide")

    def test_shears_beyond_what_rays_from_surfaces_take(self):
        sheared = np.eye(4)[None, :3].copy()
        sheared[0, 0, 1] = 100
        scene = ballot.Scene(meshes=[CUBE], instances=sheared)
        self.assertEqual(scene.trace(down((0, 0)))["t"].tolist(), [49])
        for call in (lambda: scene.make_rays(width=8, height=8), lambda: ballot.render(scene, width=8, height=8)):
            with self.assertRaisesRegex(ValueError, "matrix of instance 0 .* multiplies rounding errors by 1.02e"):
                call()

    def test_pictures_and_updates(self):
        scene = ballot.Scene(meshes=[CUBE], instances=[at(0, 0, 0), at(2, 0, 0)])
        self.assertGreater(ballot.render(scene, width=16, height=16)[..., 3].sum(), 0)
        before = scene.trace(down((0, 0), (2, 0)))
        vertices = np.array(CUBE[0], np.float32)
        vertices[:, 2] += 1
        ref.move(scene, 0, vertices)
        again = scene.trace(down((0, 0), (2, 0)))
        np.testing.assert_array_equal(again["t"], before["t"] - 1)
        np.testing.assert_array_equal(pickle.loads(pickle.dumps(scene)).trace(down((0, 0), (2, 0))), again)


if __name__ == "__main__":
    unittest.main()
