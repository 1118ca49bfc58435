"""Values where rays hit: positions, sides, attributes, colors; names of meshes."""

import os
import pickle
import unittest

import numpy as np

import ballot
import reference as ref


def between(values: np.ndarray, triangles: np.ndarray, found: dict) -> np.ndarray:
    """Returns values of vertices where rays hit, interpolated in float64."""
    a, b, c = (values[triangles[found["prims"], k]] for k in range(3))
    u, v = (found["uvs"][:, k].astype(np.float64).reshape(-1, *[1] * (values.ndim - 1)) for k in range(2))
    return a + u * (b - a) + v * (c - a)


class ValuesTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rng = np.random.default_rng(4)
        cls.vertices, cls.triangles = ref.soup(60)
        cls.rays = ref.random_rays(2000)
        n, m = len(cls.vertices), len(cls.triangles)
        cls.heat, cls.paint = rng.normal(size=n), rng.random((n, 4)).astype(np.float32)
        cls.kind = rng.integers(0, 9, (m, 2)).astype(np.float32)
        cls.given = {
            "heat": cls.heat, "paint": cls.paint, "kind": ballot.Attribute(cls.kind, "prims"),
            "corner": ballot.Attribute(np.arange(n, dtype=np.float32), nearest=True),
            "mass": ballot.Attribute(2.5, "mesh"),
        }  # fmt: skip
        cls.names = ("prims", "uvs", "t", "positions", "front", "normals", *cls.given)

    def check(self, found, kind=None):
        hit = found["prims"] != ballot.MISS
        self.assertGreater(hit.sum(), 500)
        self.assertTrue(np.isnan(found["heat"][~hit]).all() and np.isnan(found["kind"][~hit]).all())
        met = {name: column[hit] for name, column in found.items()}
        np.testing.assert_allclose(met["heat"], between(self.heat.astype(np.float32), self.triangles, met), atol=2e-6)
        np.testing.assert_allclose(met["paint"], between(self.paint, self.triangles, met), atol=1e-6)
        np.testing.assert_array_equal(met["kind"], (self.kind if kind is None else kind)[met["prims"]])
        self.assertEqual(set(met["mass"].tolist()), {2.5})
        u, v = met["uvs"].T
        weights = np.stack([np.float32(1) - u - v, u, v], 1)
        np.testing.assert_array_equal(met["corner"], self.triangles[met["prims"], weights.argmax(1)])

    def test_columns_of_attributes(self):
        scene = ballot.Scene(self.vertices, self.triangles, attributes=self.given)
        self.assertEqual(scene.attributes, {"heat": 1, "paint": 4, "kind": 2, "corner": 1, "mass": 1})
        found = scene.trace_columns(self.rays, self.names)
        self.assertEqual({name: found[name].shape[1:] for name in self.given},
                         {"heat": (), "paint": (4,), "kind": (2,), "corner": (), "mass": ()})  # fmt: skip
        self.assertEqual({found[name].dtype for name in self.given}, {np.dtype(np.float32)})
        self.check(found)
        hit = found["prims"] != ballot.MISS
        at = self.rays[:, :3] + found["t"][:, None] * self.rays[:, 3:]
        np.testing.assert_allclose(found["positions"][hit], at[hit], atol=3e-6)
        side = (found["normals"] * self.rays[:, 3:]).sum(1)
        clear = hit & (abs(side) > 1e-5)
        np.testing.assert_array_equal(found["front"][clear], side[clear] < 0)
        self.assertEqual(found["front"].dtype, np.bool_)
        for cull, front in (("back", True), ("front", False)):
            left = scene.trace_columns(self.rays, ("front", "prims"), cull=cull)
            self.assertEqual(set(left["front"][left["prims"] != ballot.MISS].tolist()), {front})
        out = np.empty((2000, 4), np.float32)
        self.assertIs(scene.trace_columns(self.rays, ("paint",), out={"paint": out})["paint"], out)
        np.testing.assert_array_equal(out, found["paint"])
        first = scene.trace_columns(self.rays, ("heat", "positions", "prims"), first=2)
        self.assertEqual((first["heat"].shape, first["positions"].shape), ((2000, 2), (2000, 2, 3)))
        np.testing.assert_array_equal(first["heat"][:, 0], found["heat"])
        picture = scene.trace_columns(self.rays.reshape(40, 50, 6), ("paint",))["paint"]
        np.testing.assert_array_equal(picture.reshape(-1, 4), found["paint"])

    def test_arrays_on_the_device(self):
        scene = ballot.Scene(self.vertices, self.triangles, attributes=self.given)
        found = scene.trace_columns(self.rays, self.names)
        asked = ballot.Array("rays", len(self.rays))
        asked.write(np.concatenate([self.rays[:, :3], np.zeros((2000, 1)), self.rays[:, 3:], np.full((2000, 1), 99)], 1,
                                   dtype=np.float32))  # fmt: skip
        there = scene.trace_columns(asked, (*self.names, "colors", "materials", "shading_normals"))
        self.assertEqual((there["paint"].record, there["colors"].record), ("float32x4", "float32x4"))
        for name in self.names:
            np.testing.assert_array_equal(there[name].read().view(found[name].dtype), found[name], name)
        values = ballot.Array("float32x4", len(self.paint))
        values.write(self.paint[::-1].copy())
        scene.set_attribute(0, "paint", values)
        scene.commit()
        np.testing.assert_array_equal(scene.attribute(0, "paint"), self.paint[::-1])
        near = scene.nearest(self.rays[:, :3], ("prims", "uvs", "heat", "colors", "shading_normals", "normals"))
        np.testing.assert_allclose(near["heat"], between(self.heat, self.triangles, near), atol=2e-6)
        np.testing.assert_array_equal(near["shading_normals"], near["normals"])
        np.testing.assert_array_equal(near["colors"], np.ones((2000, 4)))

    def test_edits_and_pickles(self):
        mesh = (self.vertices, self.triangles)
        scene = ballot.Scene(meshes=[mesh, mesh], attributes=[self.given, None], names=["left", None],
                             instances=np.eye(4)[None].repeat(2, 0), instance_meshes=[0, 1])  # fmt: skip
        away = np.eye(4)
        away[0, 3] = 100
        scene.set_transforms(np.array([np.eye(4), away]))
        scene.commit()
        self.check(scene.trace_columns(self.rays, self.names))
        self.assertEqual((scene.find_meshes("left"), scene.find_meshes("mesh 1")), ([0], [1]))
        kind = self.kind + 1
        scene.set_attribute(0, "kind", ballot.Attribute(kind, "prims"))
        scene.set_attribute(1, "other", ballot.Attribute([1, 2, 3], "mesh"))
        number = scene.add_mesh(*mesh, attributes={"heat": self.heat}, name="third")
        scene.commit()
        for one in (scene, pickle.loads(pickle.dumps(scene))):
            self.check(one.trace_columns(self.rays, self.names), kind)
            self.assertEqual(one.attribute(1, "other").tolist(), [[1, 2, 3]])
            self.assertEqual(one.find_meshes("third"), [number])
            self.assertEqual(one.attributes["other"], 3)
        scene.replace_mesh(0, *mesh, attributes={"heat": self.heat})
        scene.commit()
        self.assertEqual(set(scene.attributes), {"heat", "other"})
        self.assertEqual(scene.meshes[0].name, "left")

    def test_shapes_and_files(self):
        balls = ballot.spheres([[0, 0, 0], [3, 0, 0]], 1)
        scene = ballot.Scene(balls, attributes={"size": ballot.Attribute([4, 5], "prims")})
        rays = [[0, 0, 9, 0, 0, -1], [3, 0, 9, 0, 0, -1], [0, 0, 0, 0, 0, -1], [9, 9, 9, 0, 0, 1]]
        found = scene.trace_columns(rays, ("size", "positions", "front"))
        np.testing.assert_array_equal(found["size"], [4, 5, 4, np.nan])
        np.testing.assert_allclose(found["positions"], [[0, 0, 1], [3, 0, 1], [0, 0, -1], [0, 0, 0]], atol=1e-6)
        self.assertEqual(found["front"].tolist(), [True, True, False, False])
        cornell = os.path.join(os.path.dirname(__file__), "../../../../scenes/cornell.gltf")
        if not os.path.exists(cornell):
            self.skipTest("there is no checkout around the tests")
        scene = ballot.load_scene(cornell)
        corners = scene.triangles()
        scene.set_attribute(0, "height", corners[: scene.meshes[0].triangles, :, 1].reshape(-1))
        scene.commit()
        names = ("positions", "height", "colors", "materials", "mesh_ids")
        rays = scene.make_rays(width=32, height=32)
        for one in (scene, pickle.loads(pickle.dumps(scene))):
            found = one.trace_columns(rays, names)
            has = ~np.isnan(found["height"])
            self.assertTrue(has.any())
            np.testing.assert_allclose(found["height"][has], found["positions"][has, 1], atol=1e-5)
            met = found["materials"] != ballot.MISS
            self.assertGreater(len(set(found["materials"][met].tolist())), 3)
            for material in set(found["materials"][met].tolist()):
                self.assertEqual(len(np.unique(found["colors"][found["materials"] == material], axis=0)), 1)

    def test_bad_input(self):
        scene = ballot.Scene(self.vertices, self.triangles, attributes={"heat": self.heat})
        make = lambda given: ballot.Scene(self.vertices, self.triangles, attributes=given)  # noqa: E731
        for given, error, text in (
            ({"heat": self.heat[1:]}, ValueError, r"mesh 0, attribute 'heat': 179 values, of 180 vertices"),
            ({"heat": ballot.Attribute(self.heat, "prims")}, ValueError, "180 values, of 60 triangles"),
            ({"heat": self.heat.astype(np.int32)}, TypeError, "'heat': dtype is int32; expected float32"),
            ({"heat": np.zeros((180, 5))}, ValueError, r"shape is \(180, 5\); expected \(n,\) or \(n, 1\) to \(n, 4\)"),
            ({"heat": np.zeros((2, 2, 2))}, ValueError, r"shape is \(2, 2, 2\)"),
            ({"heat": "hot"}, TypeError, "found str"),
            ({"heat": ballot.Attribute(1.0, "faces")}, ValueError, "of is 'faces'; expected one of vertices, prims"),
            ({"heat": ballot.Attribute(self.kind, "prims", True)}, ValueError, "nearest is 1"),
            ({"t": self.heat}, ValueError, "called 't', as a column of answers"),
            ({"": self.heat}, ValueError, "has 0 bytes"),
            ({5: self.heat}, TypeError, "name of an attribute: found int"),
            ([self.heat], TypeError, "attributes: found list; expected a dict"),
        ):  # fmt: skip
            with self.assertRaisesRegex(error, text) as caught:
                make(given)
            self.assertNotIn("\n", str(caught.exception))
        with self.assertRaisesRegex(ValueError, "found 2; expected 1, one for each mesh"):
            ballot.Scene(meshes=[(self.vertices, self.triangles)], attributes=[None, None])
        with self.assertRaisesRegex(TypeError, "names: found int"):
            ballot.Scene(self.vertices, self.triangles, names=3)
        with self.assertRaisesRegex(ValueError, "columns: found 'cold'; expected some of t, .*heat"):
            scene.trace_columns(self.rays, ("cold",))
        with self.assertRaisesRegex(ValueError, "mesh 0 has no attribute 'cold'"):
            scene.attribute(0, "cold")
        with self.assertRaisesRegex(ValueError, "it has 3 components, but 1 in mesh 0"):
            scene.add_mesh(self.vertices, self.triangles, attributes={"heat": ballot.Attribute([1, 2, 3], "mesh")})
        nan = ballot.Scene(self.vertices, self.triangles, attributes={"heat": np.full(180, np.nan)})
        self.assertTrue(np.isnan(nan.trace_columns(self.rays, ("heat",))["heat"]).all())
        self.assertTrue((scene.trace_columns(np.empty((0, 6)), ("heat", "colors"))["colors"]).shape == (0, 4))

    def test_strongest(self):
        heat = np.where(np.arange(len(self.heat)) % 7, self.heat, np.nan)
        plain = ballot.Attribute(np.floor(3 * self.kind[:, 0]), "prims")
        scene = ballot.Scene(self.vertices, self.triangles, attributes={"heat": heat, "plain": plain, **{
            "pair": self.kind[:, [0, 0]].repeat(3, 0)}})  # fmt: skip
        counts, hits = scene.crossings(self.rays)
        most = int(counts.max())
        for name in ("heat", "plain"):
            every = scene.trace_columns(self.rays, ("t", name), first=most)
            all_hits = scene.trace(self.rays, first=most)
            key = np.nan_to_num(every[name], nan=-np.inf)
            order = np.argsort(-np.where(np.isfinite(every["t"]), key, -np.inf), axis=1, kind="stable")
            for k in (1, 3, 16):
                best = np.take_along_axis(all_hits, order, axis=1)[:, :k]
                found = scene.trace(self.rays, strongest=k, value=name)
                self.assertEqual(found.shape, (2000, k))
                np.testing.assert_array_equal(found[:, : best.shape[1]], best)
                self.assertTrue((found["prim"][:, best.shape[1] :] == ballot.MISS).all())
        columns = scene.trace_columns(self.rays, ("heat", "t"), strongest=2, value="heat", cull="back")
        first = scene.trace_columns(self.rays, ("heat",), cull="back")["heat"]
        self.assertTrue((columns["heat"][:, 0] >= first)[~np.isnan(first)].all())
        exact = scene.trace(self.rays, strongest=2, value="heat", numeric="exact")
        self.assertGreater((exact["prim"] == scene.trace(self.rays, strongest=2, value="heat")["prim"]).mean(), 0.99)
        self.assertEqual(scene.trace(self.rays[:0], strongest=2, value="heat").shape, (0, 2))
        self.assertTrue((scene.trace([[9, 9, 9, 0, 0, 1]], strongest=2, value="heat")["prim"] == ballot.MISS).all())
        full = np.concatenate([self.rays[:, :3], np.zeros((2000, 1)), self.rays[:, 3:], np.full((2000, 1), 1e30)], 1)
        there = ballot.Array("rays", 2000)
        there.write(full)
        for k in (1, 3):
            found = scene.trace(there, strongest=k, value="heat").read()
            np.testing.assert_array_equal(
                found.reshape(2000, k), scene.trace(full, strongest=k, value="heat").reshape(2000, k)
            )
        for options in ({"strongest": 3, "value": "heat"}, {"last": 3}):
            told = scene.trace_columns(there, ("positions", "heat", "t"), **options)
            here = scene.trace_columns(full, ("positions", "heat", "t"), **options)
            for name in told:
                np.testing.assert_array_equal(told[name].read().reshape(here[name].shape), here[name])
        for options, text in (
            ({"strongest": 0, "value": "heat"}, "strongest is 0; expected 1 to 16"),
            ({"strongest": 1000, "value": "heat"}, "strongest is 1000; expected 1 to 16"),
            ({"strongest": 2}, "strongest is set without value"),
            ({"value": "heat"}, "value is set without strongest"),
            ({"strongest": 2, "value": "cold"}, "value: no mesh has an attribute 'cold'; there are: heat"),
            ({"strongest": 2, "value": "pair"}, "value: attribute 'pair' has 2 numbers; expected one"),
            ({"strongest": 2, "value": "heat", "first": 2}, "strongest is set and first is set"),
            ({"strongest": 2, "value": "heat", "last": 2}, "strongest is set and last is set"),
            ({"strongest": 2, "value": "heat", "any": True}, "strongest is set and any is 1"),
            ({"strongest": 2, "value": "heat", "method": "packet"}, "method is 'packet'"),
        ):
            with self.subTest(options), self.assertRaisesRegex(ValueError, text):
                scene.trace(self.rays, **options)
        with self.assertRaisesRegex(ValueError, "strongest is set without value"):
            scene.trace(there, strongest=2)


if __name__ == "__main__":
    unittest.main()
