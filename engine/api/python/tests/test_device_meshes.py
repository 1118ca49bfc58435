"""Meshes of arrays on the device."""

import pickle
import unittest

import ballot
import numpy as np
import reference as ref


def array(record, numbers):
    made = ballot.Array(record, len(numbers))
    made.write(numbers)
    return made


def there(vertices, triangles):
    return array("vertices", vertices), array("uint32", triangles.reshape(-1))


class DeviceMeshes(unittest.TestCase):
    def same(self, a, b):
        rays = ref.random_rays(500)
        columns = ("t", "prims", "mesh_ids", "uvs", "normals", "instances")
        for one, other in (
            (a.trace_columns(rays, columns), b.trace_columns(rays, columns)),
            (a.nearest(rays[:, :3]), b.nearest(rays[:, :3])),
        ):
            for name, found in one.items():
                np.testing.assert_array_equal(found, other[name], name)
        np.testing.assert_array_equal(a.occluded(rays), b.occluded(rays))
        for numeric in ("watertight", "exact"):
            np.testing.assert_array_equal(a.trace(rays, numeric=numeric), b.trace(rays, numeric=numeric))
            for one, other in zip(a.crossings(rays, numeric=numeric), b.crossings(rays, numeric=numeric)):
                np.testing.assert_array_equal(one, other)
        np.testing.assert_array_equal(a.triangles(), b.triangles())
        self.assertEqual([tuple(m) for m in a.meshes], [tuple(m) for m in b.meshes])

    def test_scenes(self):
        v, t = ref.soup(300)
        on_v, on_t = there(v, t)
        cube = (ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        for options in ({}, {"builder": "device"}, {"builder": "device", "layout": "separate"}):
            with self.subTest(options=options):
                here = ballot.Scene(meshes=[(v, t), cube], ids=[4, 9], **options)
                self.same(ballot.Scene(meshes=[(on_v, on_t), there(*cube)], ids=[4, 9], **options), here)
                self.same(ballot.Scene(meshes=[(on_v, t), cube], ids=[4, 9], **options), here)
                self.same(ballot.Scene(meshes=[(v, on_t), cube], ids=[4, 9], **options), here)
        scene = ballot.Scene(on_v, on_t, builder="device")
        self.same(pickle.loads(pickle.dumps(scene)), ballot.Scene(v, t))
        self.same(ballot.Scene(on_v, soup=True, builder="device"), ballot.Scene(v, soup=True))
        cube_there = ballot.Scene(*there(*cube), builder="device")
        points = ref.random_rays(500)[:, 3:]
        inside = cube_there.nearest(points, ("inside",))["inside"]
        np.testing.assert_array_equal(inside, ballot.Scene(*cube).nearest(points, ("inside",))["inside"])

    def test_pictures(self):
        """What shades reads the triangles and normals of arrays on the device."""
        v, t = ref.soup(60)
        n = v / np.linalg.norm(v, axis=1, keepdims=True)
        on_v, on_t = there(v, t)
        for normals, given in ((None, None), (n, n), (n, array("vertices", n))):
            here = ballot.Scene(v, t, normals=normals, builder="device")
            on = ballot.Scene(on_v, on_t, normals=given, builder="device")
            for shading in ("normals", "ao"):
                options = {"width": 32, "height": 24, "shading": shading}
                np.testing.assert_array_equal(ballot.render(on, **options), ballot.render(here, **options))

    def test_edits(self):
        v, t = ref.soup(300)
        for builder in ("device", "balanced"):
            a, b = ballot.Scene(*there(v, t), builder=builder), ballot.Scene(v, t, builder=builder)
            a.set_vertices(0, array("vertices", v * np.float32(0.75)))
            b.set_vertices(0, v * np.float32(0.75))
            a.commit(), b.commit()
            self.same(a, b)
            w, u = ref.soup(50, seed=5)
            a.replace_mesh(0, *there(w, u))
            b.replace_mesh(0, w, u)
            self.assertEqual(a.add_mesh(*there(v, t)), b.add_mesh(v, t))
            places = np.eye(3, 4)[None] + np.float32([[[0, 0, 0, 0.25]] * 3])
            for scene in (a, b):
                scene.add_instances(places, 1)
                scene.commit()
            self.same(a, b)

    def test_masks(self):
        v, t = ref.soup(40)
        places = np.tile(np.eye(3, 4, dtype=np.float32), (30, 1, 1))
        places[:, 0, 3] = np.arange(30) * 0.1
        here, on = (ballot.Scene(v, t, instances=places) for _ in range(2))
        rays = ref.random_rays(500)
        ways = np.arange(500, dtype=np.uint32) % 4
        for words in (np.arange(30) % 3 + 1, np.arange(30) % 3, np.arange(30) % 2 + 1, np.full(30, 2**32 - 1)):
            words = words.astype(np.uint32)
            on.set_masks(None, array("uint32", words))
            on.commit()
            here.set_masks(np.arange(30), words)
            here.commit()
            np.testing.assert_array_equal(on.trace(rays, masks=ways), here.trace(rays, masks=ways))
            self.assertEqual([i.mask for i in on.instances], words.tolist())
        on.set_masks(None, np.full(30, 1))
        on.commit()
        self.assertEqual({i.mask for i in on.instances}, {1})
        masks, matrices = array("uint32", np.arange(30) % 2), ballot.Array("transforms", 30)
        places[:, 1, 3] = 0.5
        matrices.write(places.reshape(-1, 12))
        on.set_transforms(matrices)
        on.set_masks(None, masks)
        on.commit()
        here.set_transforms(places)
        here.set_masks(np.arange(30), np.arange(30) % 2)
        here.commit()
        np.testing.assert_array_equal(on.trace(rays, masks=ways), here.trace(rays, masks=ways))
        with self.assertRaisesRegex(TypeError, "expected None"):
            on.set_masks([1], masks)
        with self.assertRaisesRegex(ValueError, "29 records; expected 30"):
            on.set_masks(None, array("uint32", np.arange(29)))

    def test_bad_input(self):
        v, t = ref.soup(10)
        wrong = v.copy()
        wrong[17, 1] = np.nan
        outside = t.reshape(-1).copy()
        outside[8] = 30
        scene = ballot.Scene(v, t)
        on_v, on_t = there(v, t)
        for vertices, triangles, text in (
            (array("vertices", wrong), on_t, "vertex 17 is"),
            (on_v, array("uint32", outside), "index 8 is 30, but there are 30 vertices"),
            (on_v, array("uint32", outside[:7]), "7 indices; expected a multiple of 3"),
            (ballot.Array("rays", 30), on_t, "buffer of vertices holds other records"),
            (on_v, on_v, "buffer of indices holds other records"),
            (on_v, None, "pass their indices"),
        ):
            with self.subTest(text):
                for call in (
                    lambda v=vertices, t=triangles: ballot.Scene(v, t),
                    lambda v=vertices, t=triangles: scene.add_mesh(v, t),
                    lambda v=vertices, t=triangles: scene.replace_mesh(0, v, t),
                ):
                    with self.assertRaisesRegex(ValueError, text):
                        call()
        self.same(scene, ballot.Scene(v, t))
        on_v.close()
        with self.assertRaisesRegex(ballot.Error, "closed"):
            ballot.Scene(on_v, on_t)


if __name__ == "__main__":
    unittest.main()
