"""The classes in the style of Open3D and trimesh."""

import pickle
import types
import unittest

import ballot
import numpy as np
import reference as ref


class Raycasting(unittest.TestCase):
    def setUp(self):
        self.scene = ballot.RaycastingScene()
        self.assertEqual(self.scene.add_triangles(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES), 0)
        self.rays = np.float32(
            [[[0.25, 0.5, 3, 0, 0, -2], [5, 5, 5, 0, 0, 1]], [[0.25, 0.5, 5, 0, 0, 1], [3, 0, 0, -1, 0, 0]]]
        )

    def test_numeric_modes(self):
        exact = ballot.RaycastingScene(numeric="exact")
        exact.add_triangles(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        self.scene.add_triangles(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        exact = pickle.loads(pickle.dumps(exact))
        np.testing.assert_array_equal(exact.test_occlusions(self.rays), self.scene.test_occlusions(self.rays))
        np.testing.assert_array_equal(exact.cast_rays(self.rays)["t_hit"], self.scene.cast_rays(self.rays)["t_hit"])
        wrong = ballot.RaycastingScene(numeric="right")
        wrong.add_triangles(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        self.assertRaises(ValueError, wrong.cast_rays, self.rays)

    def test_values_and_types(self):
        higher = ref.CUBE_VERTICES.astype(np.float64) + np.array([0, 0, 10])
        self.assertEqual(self.scene.add_triangles(higher, ref.CUBE_TRIANGLES.astype(np.int64)), 1)
        got = self.scene.cast_rays(self.rays)
        invalid = ballot.RaycastingScene.INVALID_ID
        self.assertEqual(invalid, 4294967295)
        self.assertEqual(
            {k: (a.dtype.name, a.shape) for k, a in got.items()},
            {
                "t_hit": ("float32", (2, 2)),
                "geometry_ids": ("uint32", (2, 2)),
                "primitive_ids": ("uint32", (2, 2)),
                "primitive_uvs": ("float32", (2, 2, 2)),
                "primitive_normals": ("float32", (2, 2, 3)),
            },
        )
        self.assertEqual(got["t_hit"].tolist(), [[1, np.inf], [4, 2]])
        self.assertEqual(got["geometry_ids"].tolist(), [[0, invalid], [1, 0]])
        self.assertEqual(got["primitive_ids"][0, 1], invalid)
        self.assertEqual(got["primitive_uvs"][0, 1].tolist(), [0, 0])
        self.assertEqual(got["primitive_normals"].tolist(), [[[0, 0, 1], [0, 0, 0]], [[0, 0, -1], [1, 0, 0]]])

    def test_against_a_search(self):
        vertices, triangles = ref.soup(150)
        scene = ballot.RaycastingScene(nthreads=2)
        scene.add_triangles(vertices[:300], triangles[:100])
        scene.add_triangles(vertices[300:], triangles[100:] - 300)
        rays = ref.random_rays(500)
        truth = ref.brute(vertices[triangles], rays)
        sure = truth["margin"] > 1e-5
        got = scene.cast_rays(rays, nthreads=1)
        hit = truth["prim"] != ref.MISS
        np.testing.assert_array_equal(got["geometry_ids"][sure], np.where(hit, truth["prim"] // 100, ref.MISS)[sure])
        np.testing.assert_array_equal(got["primitive_ids"][sure], np.where(hit, truth["prim"] % 100, ref.MISS)[sure])
        np.testing.assert_allclose(got["t_hit"][sure], truth["t"][sure], rtol=1e-4)
        np.testing.assert_array_equal(scene.test_occlusions(rays)[sure], hit[sure])

    def test_occlusions(self):
        self.assertEqual(self.scene.test_occlusions(self.rays).tolist(), [[True, False], [False, True]])
        self.assertEqual(self.scene.test_occlusions(self.rays, tfar=0.5).tolist(), [[False, False], [False, False]])
        self.assertEqual(self.scene.test_occlusions(self.rays, 1.5, 2.5)[0].tolist(), [True, False])
        self.assertEqual(self.scene.test_occlusions(self.rays).dtype, np.bool_)

    def test_rebuilt_after_more_triangles(self):
        ray = self.rays[1:, :1]
        self.assertEqual(self.scene.cast_rays(ray)["geometry_ids"].item(), ballot.MISS)
        self.scene.add_triangles(ref.CUBE_VERTICES + np.float32([0, 0, 10]), ref.CUBE_TRIANGLES)
        self.assertEqual(self.scene.cast_rays(ray)["geometry_ids"].item(), 1)

    def test_meshes(self):
        mesh = types.SimpleNamespace(
            vertex=types.SimpleNamespace(positions=ref.CUBE_VERTICES),
            triangle=types.SimpleNamespace(indices=ref.CUBE_TRIANGLES),
        )
        self.assertEqual(self.scene.add_triangles(mesh), 1)
        self.assertEqual(
            self.scene.add_triangles(vertex_positions=ref.CUBE_VERTICES, triangle_indices=ref.CUBE_TRIANGLES), 2
        )

    def test_no_meshes(self):
        self.assertEqual(ballot.RaycastingScene().cast_rays(self.rays)["t_hit"].tolist(), [[np.inf] * 2] * 2)

    def test_pickle(self):
        again = pickle.loads(pickle.dumps(self.scene))
        for name, array in self.scene.cast_rays(self.rays).items():
            np.testing.assert_array_equal(again.cast_rays(self.rays)[name], array)

    def test_pinhole(self):
        # What Open3D 0.20 returns for the same arguments.
        make = ballot.RaycastingScene.create_rays_pinhole
        rays = make(fov_deg=60, center=[0, 0, 0], eye=[1, 2, 3], up=[0, 1, 0], width_px=5, height_px=3)
        self.assertEqual((rays.shape, rays.dtype), ((3, 5, 6), np.float32))
        np.testing.assert_allclose(rays[0, 0], [1, 2, 3, 0.20995283, -0.7297025, -0.8307351], rtol=1e-5)
        np.testing.assert_allclose(rays[2, 4], [1, 2, 3, -0.74447525, -0.33934247, -0.7728324], rtol=1e-5)
        extrinsic = np.eye(4)
        extrinsic[:3, 3] = [1, 2, 3]
        rays = make(np.array([[5, 0, 2.5], [0, 5, 1.5], [0, 0, 1.0]]), extrinsic, 3, 2)
        np.testing.assert_allclose(rays[0, 0], [-1, -2, -3, -0.4, -0.2, 1], rtol=1e-5)
        np.testing.assert_allclose(rays[1, 2], [-1, -2, -3, 0, 0, 1], atol=1e-6)
        for arguments in (
            (1, 2, 3),
            (60, [0] * 3, [0] * 3, [0, 1, 0], 5, 3),
            (60, [0] * 3, [0, 1, 0], [0, 1, 0], 5, 3),
        ):
            with self.assertRaises((TypeError, ValueError)):
                make(*arguments)

    def test_bad_input(self):
        for error, text, call in (
            (ValueError, r"rays: shape is \(6,\)", lambda: self.scene.cast_rays(self.rays[0, 0])),
            (
                ValueError,
                r"rays: shape is \(2, 2, 5\); expected \(\.\.\., 6\)",
                lambda: self.scene.cast_rays(self.rays[..., :5]),
            ),
            (TypeError, "rays: dtype is int64", lambda: self.scene.cast_rays(self.rays.astype(np.int64))),
            (
                ValueError,
                "finite",
                lambda: self.scene.add_triangles(ref.CUBE_VERTICES * np.float32(np.nan), ref.CUBE_TRIANGLES),
            ),
            (ValueError, "index 11", lambda: self.scene.add_triangles(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES + 4)),
            (ValueError, "no triangles", lambda: self.scene.add_triangles(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES[:0])),
            (TypeError, "found int", lambda: self.scene.add_triangles(3)),
            (TypeError, "device: found str", lambda: ballot.RaycastingScene(device="CPU:0")),
            (TypeError, "nthreads: found str", lambda: self.scene.cast_rays(self.rays, nthreads="two")),
        ):
            with self.subTest(text), self.assertRaisesRegex(error, text):
                call()
        self.assertEqual(self.scene.add_triangles(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES), 1)  # nothing was half added


class Trimesh(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.vertices, cls.faces = ref.soup(100)
        mesh = types.SimpleNamespace(vertices=cls.vertices.astype(np.float64), faces=cls.faces.astype(np.int64))
        cls.ray = ballot.trimesh_ray.RayMeshIntersector(mesh)
        rays = ref.random_rays(300)
        cls.given = rays[:, :3].astype(np.float64), rays[:, 3:].astype(np.float64)
        cls.truth = ref.brute(cls.vertices[cls.faces], rays)
        cls.sure = cls.truth["margin"] > 1e-5

    def test_first(self):
        first = self.ray.intersects_first(*self.given)
        self.assertEqual(first.dtype, np.int64)
        expected = np.where(self.truth["prim"] == ref.MISS, -1, self.truth["prim"].astype(np.int64))
        np.testing.assert_array_equal(first[self.sure], expected[self.sure])

    def test_any(self):
        hit = self.ray.intersects_any(*self.given)
        np.testing.assert_array_equal(hit[self.sure], (self.truth["prim"] != ref.MISS)[self.sure])

    def test_id_and_location(self):
        first = self.ray.intersects_first(*self.given)
        tri, ray = self.ray.intersects_id(*self.given, multiple_hits=False)
        np.testing.assert_array_equal(first[ray], tri)
        self.assertEqual(len(ray), (first >= 0).sum())
        points, ray2, tri2 = self.ray.intersects_location(*self.given, multiple_hits=False)
        np.testing.assert_array_equal((ray2, tri2), (ray, tri))
        expected = self.given[0][ray] + self.given[1][ray] * self.truth["t"][ray, None]
        sure = self.sure[ray]
        np.testing.assert_allclose(points[sure], expected[sure], atol=1e-4)

    def test_all_hits(self):
        tri, ray, points = self.ray.intersects_id(*self.given, return_locations=True)
        self.assertEqual((tri.dtype, ray.dtype, points.dtype), (np.int64, np.int64, np.float64))
        rays = np.concatenate(self.given, axis=1)
        found = np.zeros((len(rays), len(self.faces)), bool)
        found[ray, tri] = True
        self.assertEqual(found.sum(), len(ray))  # each triangle once
        all_hits, sure = ref.all_hits(self.vertices[self.faces], rays)
        np.testing.assert_array_equal(found[sure], all_hits[sure])
        along = ((points - self.given[0][ray]) * self.given[1][ray]).sum(-1)
        self.assertTrue((np.diff(along)[np.diff(ray) == 0] > -1e-4).all())
        first = self.ray.intersects_first(*self.given)
        np.testing.assert_array_equal(first[ray[np.diff(ray, prepend=-1) > 0]], tri[np.diff(ray, prepend=-1) > 0])

    def test_contains_points(self):
        mesh = types.SimpleNamespace(vertices=ref.CUBE_VERTICES, faces=ref.CUBE_TRIANGLES)
        inside = ballot.trimesh_ray.RayMeshIntersector(mesh).contains_points([[0, 0, 0], [0.5, 0.9, 0.2], [0, 0, 1.1]])
        self.assertEqual((inside.dtype, inside.tolist()), (np.bool_, [True, True, False]))
        with self.assertRaisesRegex(ValueError, "not closed"):
            self.ray.contains_points([[0, 0, 0]])

    def test_bad_input(self):
        with self.assertRaisesRegex(ValueError, "shapes are"):
            self.ray.intersects_any(self.given[0][:5], self.given[1])


if __name__ == "__main__":
    unittest.main()
