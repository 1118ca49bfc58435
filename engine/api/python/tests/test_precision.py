"""float64 that float32 cannot hold: it is counted from an origin, and where none helps a warning tells the figure."""

import os
import pickle
import tempfile
import types
import unittest
import warnings

import ballot
import numpy as np
import reference as ref

FAR = 2.0**22  # float32 is 0.5 apart there
PLACE = np.array([FAR, 0, 0])
INEXACT = ref.CUBE_VERTICES.astype(np.float64) + PLACE
INEXACT[5, 0] += 0.125  # the vertex that is moved: by 0.125 of 2.125


class Precision(unittest.TestCase):
    def test_every_door_warns(self):
        cube, faces = ref.CUBE_VERTICES, ref.CUBE_TRIANGLES
        moved = ballot.Scene(cube, faces)
        place = np.eye(4)
        place[0, 3] = FAR + 0.125
        placed = ballot.Scene(cube, faces, instances=np.eye(4)[None])
        text = "vertices: float32 moves a vertex by 0.125, which is 6.2e-02 of the mesh's size of 2 .*from .0, 0, 0."

        def move():
            moved.set_vertices(0, INEXACT)
            moved.commit()

        for name, expected, call in (
            ("meshes", "^mesh 1: " + text, lambda: ballot.Scene(meshes=[(cube, faces), (INEXACT, faces)])),
            ("vertices", "^mesh 0: " + text, move),
            (
                "instances",
                "instances: float32 moves instance 1 by 0.125.*of its size of 2 ",
                lambda: ballot.Scene(cube, faces, instances=np.stack([np.eye(4), place])),
            ),
            ("transforms", "moves instance 0 by 0.125", lambda: placed.set_transforms(place[None])),
        ):
            with self.subTest(name), self.assertWarnsRegex(ballot.PrecisionWarning, expected) as caught:
                call()
            self.assertEqual(caught.filename, __file__)  # the line of the caller

    def test_rays_of_views_are_of_the_world(self):
        near, far = (ballot.Scene(v, ref.CUBE_TRIANGLES) for v in (ref.CUBE_VERTICES, ref.CUBE_VERTICES + PLACE))
        for kind in ("primary", "ao"):
            rays = far.make_rays({"eye": PLACE + (0.5, 0.25, 5), "target": PLACE}, kind, 16, 16)
            at_zero = near.make_rays({"eye": (0.5, 0.25, 5), "target": (0, 0, 0)}, kind, 16, 16)
            self.assertEqual((rays.dtype, at_zero.dtype), (np.float64, np.float32))
            self.assertEqual(far.trace(rays)["prim"].tolist(), near.trace(at_zero)["prim"].tolist())
            self.assertLess(abs(rays[:, :3] - PLACE - at_zero[:, :3]).max(), 1e-6)

    def test_every_door_counts_from_an_origin(self):
        cube, faces = ref.CUBE_VERTICES, ref.CUBE_TRIANGLES
        mesh = types.SimpleNamespace(vertices=INEXACT, faces=faces)
        place = np.eye(4)
        place[0, 3] = FAR + 0.125
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            for scene in (
                ballot.Scene(INEXACT, faces), ballot.Scene(INEXACT.tolist(), faces.tolist()), ballot.Scene(mesh),
                ballot.Scene(INEXACT[faces]), ballot.Scene(meshes=[(INEXACT, faces)]),
            ):  # fmt: skip
                self.assertEqual((scene.info.origin[1:], scene.meshes[0].rounding), ((0, 0), 0))
                self.assertLess(abs(scene.info.origin[0] - FAR), 1)
            placed = ballot.Scene(cube, faces, instances=place[None])
            placed.set_transforms(place[None])
            placed.commit()
            other = ballot.RaycastingScene()
            other.add_triangles(INEXACT, faces)
            origins, directions = np.array([[FAR + 5, 0.25, 0.5]]), np.array([[-1.0, 0, 0]])
            for scene, x in ((placed, 1.125), (ballot.Scene(INEXACT, faces), 1.0)):
                found = scene.trace_columns(
                    origins=origins, directions=directions, columns=("t", "t_double", "positions", "positions_double")
                )
                self.assertAlmostEqual(found["t_double"][0], found["t"][0], 5)
                self.assertAlmostEqual(found["positions_double"][0, 0] + found["t_double"][0], FAR + 5, 8)
                self.assertLess(abs(found["positions_double"][0, 0] - FAR - x), 0.13)
                near = scene.nearest(origins, ("distances", "distances_double", "points_double"))
                self.assertLess(near["distances_double"][0], found["t_double"][0] + 1e-9)
                self.assertAlmostEqual(near["distances_double"][0], float(near["distances"][0]), 5)
                apart = np.linalg.norm(near["points_double"] - origins)
                self.assertAlmostEqual(near["distances_double"][0], apart, 8)
            answer = other.cast_rays(np.concatenate([origins, directions], axis=1))
            self.assertAlmostEqual(float(answer["t_hit"][0]), found["t_double"][0], 5)

    def test_pickles(self):
        vertices = INEXACT + 0.1
        rays = np.concatenate([np.array([[FAR + 5, 0.25, 0.5], [FAR, 0.3, 9]]), [[-1.0, 0, 0], [0, 0, -1]]], axis=1)
        turn = np.eye(4)[None] * [[[0.5], [0.5], [0.5], [1]]]
        turn[0, :3, 3] = FAR / 2, 3, 4
        for scene in (
            ballot.Scene(vertices, ref.CUBE_TRIANGLES),
            ballot.Scene(vertices, ref.CUBE_TRIANGLES, instances=turn),
            ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES, instances=turn, origin=(FAR / 2, 0, 0)),
        ):
            copy = pickle.loads(pickle.dumps(scene))
            self.assertEqual(copy.info[: ballot.SceneInfo._fields.index("build_seconds")][-3:], scene.info[7:10])
            self.assertEqual(copy.info.origin, scene.info.origin)
            self.assertEqual(copy.meshes[0].origin, scene.meshes[0].origin)
            np.testing.assert_array_equal(copy.trace(rays), scene.trace(rays))
            np.testing.assert_array_equal(copy.triangles(), scene.triangles())

    def test_origins(self):
        scene = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES, origin=(2, 3, 4))
        self.assertEqual(scene.info.origin, (2, 3, 4))
        self.assertEqual(scene.info.lo, (-3, -4, -5))
        self.assertEqual(scene.trace([[0.25, 0.5, 3, 0, 0, -1]])["t"].tolist(), [2])
        for wrong in ((1, 2), (1, 2, np.nan), "abc", 5):
            with self.assertRaises((TypeError, ValueError)):
                ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES, origin=wrong)

    def test_rays_from_afar(self):
        scene = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        directions = np.random.default_rng(2).normal(size=(1000, 3))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        found = scene.trace_columns(origins=-6e7 * directions, directions=directions, columns=("prims", "t_double"))
        self.assertTrue((found["prims"] != ballot.MISS).all())
        self.assertTrue((np.abs(found["t_double"] - 6e7) < 1.8).all())

    def test_what_float32_holds_is_no_news(self):
        faces = ref.CUBE_TRIANGLES
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            ballot.Scene(ref.CUBE_VERTICES.astype(np.float64) + PLACE, faces)
            ballot.Scene(INEXACT.astype(np.float32), faces)
            ballot.Scene(ref.CUBE_VERTICES / 3.0 + 5, faces)  # rounded by less than 2^-20 of its size
            ballot.Scene(ref.CUBE_VERTICES * 1e-9 / 3, faces)
            ballot.Scene(*ref.soup(9), instances=np.linalg.inv(np.diag([3.0, 7, 9, 1]) + 0.1)[None])
            ballot.trimesh_ray.RayMeshIntersector((INEXACT, faces)).contains_points(PLACE[None])

    def test_files(self):
        """Files of text far from zero keep their digits about an origin."""
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "far.obj")
            for finer in (0.4, 0):  # float32 is 0.5 apart there
                with open(path, "w", encoding="ascii") as file:
                    file.write(f"v 500000 {4649776 + finer} 0\nv 500001 4649776 0\nv 500000 4649777 0\nf 1 2 3\n")
                with warnings.catch_warnings():
                    warnings.simplefilter("error")
                    ballot.load_scene(path, cache=False)

    def test_files_in_float32(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "far.stl")
            for finer, told in ((0.4, True), (0, False)):  # float32 is 0.5 apart there
                corners = ((500000, 4649776 + finer, 0), (500001, 4649776, 0), (500000, 4649777, 0))
                loop = "\n".join(f"vertex {x} {y} {z}" for x, y, z in corners)
                with open(path, "w", encoding="ascii") as file:
                    file.write(f"solid a\nfacet normal 0 0 1\nouter loop\n{loop}\nendloop\nendfacet\nendsolid a\n")
                with warnings.catch_warnings(record=True) as caught:
                    warnings.simplefilter("always")
                    ballot.load_scene(path, cache=False)
                self.assertEqual([w.category for w in caught], [ballot.PrecisionWarning] * told)
                self.assertTrue(not told or "by up to 0.25, which is 2.5e-01" in str(caught[0].message))

    def test_the_bound(self):
        """A triangle of size 1 beside a point where float32 is 2^-19 or 2^-18 apart: 2^-20 is the most that is not
        told."""
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            ballot.Scene(np.array([[[16, 0, 0], [17, 0, 0], [16 + 2.0**-20, 1, 0]]]))
        far = (np.float64([[0, 0, 0], [20, 0, 0], [0, 20, 0]]), [[0, 1, 2]])
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            ballot.Scene(meshes=[far, (np.array([[16, 0, 0], [17, 0, 0], [16 + 2.0**-20, 1, 0]]), [[0, 1, 2]])])
        far = (np.float64([[0, 0, 0], [40, 0, 0], [0, 40, 0]]), [[0, 1, 2]])
        near = (np.array([[32, 0, 0], [33, 0, 0], [32 + 1.5 * 2.0**-20, 1, 0]]), [[0, 1, 2]])
        with self.assertWarnsRegex(ballot.PrecisionWarning, "mesh 1: vertices: float32 moves a vertex by 1.43e-06"):
            ballot.Scene(meshes=[far, near])

    def test_not_finite(self):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            for number in (np.nan, np.inf, 1e300):
                bad = INEXACT.copy()
                bad[3, 1] = number
                with self.assertRaisesRegex(ValueError, "vertex 3"):
                    ballot.Scene(bad, ref.CUBE_TRIANGLES)


if __name__ == "__main__":
    unittest.main()
