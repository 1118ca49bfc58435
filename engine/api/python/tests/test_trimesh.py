"""The class in the style of trimesh.ray."""

import pickle
import types
import unittest
import warnings

import ballot
import numpy as np
import reference as ref

try:
    import trimesh
except ImportError:
    trimesh = None


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

    def test_contains_points_of_an_open_mesh(self):
        mesh = types.SimpleNamespace(vertices=ref.CUBE_VERTICES, faces=ref.CUBE_TRIANGLES[1:])  # without half a bottom
        ray = ballot.trimesh_ray.RayMeshIntersector(mesh)
        points = np.array([[0.5, 0.5, 0.9], [3, 0, 0], [0, 0, 5]])
        self.assertEqual(ray.contains_points(points).tolist(), [True, False, False])

    def test_integers(self):
        mesh = types.SimpleNamespace(vertices=ref.CUBE_VERTICES.astype(int), faces=ref.CUBE_TRIANGLES)
        ray = ballot.trimesh_ray.RayMeshIntersector(mesh, True)  # trimesh's scale_to_box
        rays = np.array([[0, 0, 9], [9, 9, 9]]), np.array([[0, 0, -4], [0, 0, -4]])
        self.assertEqual(ray.intersects_any(*rays).tolist(), [True, False])
        self.assertEqual(ray.intersects_first(*rays).dtype, np.int64)
        self.assertEqual(ray.intersects_location(*rays, False)[0].tolist(), [[0, 0, 1]])
        self.assertEqual(ray.contains_points(np.array([[0, 0, 0], [2, 0, 0]])).tolist(), [True, False])

    def test_third_argument_and_most_hits(self):
        plates = np.concatenate([ref.CUBE_VERTICES[:4] + np.float32([0, 0, z]) for z in range(5)])
        faces = np.concatenate([[[4 * k, 4 * k + 1, 4 * k + 2], [4 * k, 4 * k + 2, 4 * k + 3]] for k in range(5)])
        ray = ballot.trimesh_ray.RayMeshIntersector(types.SimpleNamespace(vertices=plates, faces=faces))
        rays = np.array([[0.3, -0.4, 9], [0.3, -0.4, 9.0]]), np.array([[0, 0, -1], [0, 0, 1.0]])
        self.assertEqual(ray.intersects_id(*rays)[0].tolist(), [8, 6, 4, 2, 0])
        self.assertEqual([a.tolist() for a in ray.intersects_id(*rays, False)], [[8], [0]])
        for most in range(7):
            tri, index, points = ray.intersects_id(*rays, True, most, True)
            self.assertEqual(tri.tolist(), [8, 6, 4, 2, 0][:most])
            self.assertEqual(index.tolist(), [0] * min(most, 5))
            expected = [[0.3, -0.4, 3 - k] for k in range(min(most, 5))]
            np.testing.assert_allclose(points, np.reshape(expected, (-1, 3)), atol=1e-12)
        self.assertEqual(len(ray.intersects_id(*rays, multiple_hits=False, max_hits=0)[0]), 0)
        with self.assertRaises(TypeError):
            ray.intersects_id(*rays, most_hits=1)

    def moves(self, mesh, move):
        """A mesh that moves by (0, 0, 10) is hit, and holds points, at its new place alone."""
        ray = ballot.trimesh_ray.RayMeshIntersector(mesh)
        high, low = np.array([[0.1, 0.2, 10]]), np.array([[0.1, 0.2, 0]])
        self.assertEqual(ray.contains_points(np.concatenate([high, low])).tolist(), [False, True])
        made = ray._made
        self.assertTrue(ray.intersects_any(low, [[1, 0, 0]])[0])
        self.assertIs(ray._made, made)  # nothing is made again while the mesh is as it was
        move()
        self.assertEqual(ray.contains_points(np.concatenate([high, low])).tolist(), [True, False])
        self.assertEqual(ray.intersects_location(high, [[0, 0, 1]])[0].round(6).tolist(), [[0.1, 0.2, 11]])
        again = pickle.loads(pickle.dumps(ray))
        self.assertEqual(again.contains_points(high).tolist(), [True])

    def test_follows_the_mesh(self):
        mesh = types.SimpleNamespace(vertices=ref.CUBE_VERTICES.copy(), faces=ref.CUBE_TRIANGLES)
        self.moves(mesh, lambda: mesh.vertices.__iadd__(np.float32([0, 0, 10])))  # in place
        mesh = types.SimpleNamespace(vertices=ref.CUBE_VERTICES, faces=ref.CUBE_TRIANGLES)
        self.moves(mesh, lambda: setattr(mesh, "vertices", ref.CUBE_VERTICES + np.float32([0, 0, 10])))
        ray = ballot.trimesh_ray.RayMeshIntersector(mesh)
        self.assertTrue(ray.intersects_any([[0, 0, 10]], [[1, 0, 0]])[0])
        mesh.faces = mesh.faces[:2]
        self.assertFalse(ray.intersects_any([[0, 0, 10]], [[1, 0, 0]])[0])

    @unittest.skipIf(trimesh is None, "trimesh is not installed")
    def test_follows_a_mesh_of_trimesh(self):
        mesh = trimesh.Trimesh(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES, process=False)
        self.moves(mesh, lambda: mesh.apply_translation([0, 0, 10]))
        scene = trimesh.Scene(trimesh.Trimesh(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES, process=False))
        self.moves(scene, lambda: scene.apply_translation([0, 0, 10]))

    def test_far_from_the_origin(self):
        far = np.array([500000, 4000000, 1000.0])
        vertices = np.round(self.vertices.astype(np.float64) * 2**16) / 2**16
        at_origin = ballot.trimesh_ray.RayMeshIntersector((vertices, self.faces))
        there = ballot.trimesh_ray.RayMeshIntersector((vertices + far, self.faces))
        origins = np.round(self.given[0] * 2**16) / 2**16
        with warnings.catch_warnings():
            warnings.simplefilter("error", ballot.PrecisionWarning)
            first = there.intersects_first(origins + far, self.given[1])
            points = there.intersects_location(origins + far, self.given[1], False)[0]
        expected = at_origin.intersects_first(origins, self.given[1])
        np.testing.assert_array_equal(first[self.sure], expected[self.sure])
        near = at_origin.intersects_location(origins, self.given[1], False)[0]
        np.testing.assert_allclose(points - far, near, atol=1e-8)

    def test_bad_input(self):
        with self.assertRaisesRegex(ValueError, "shapes are"):
            self.ray.intersects_any(self.given[0][:5], self.given[1])
        with self.assertRaisesRegex(TypeError, "ray_origins: dtype is complex"):
            self.ray.intersects_any(self.given[0].astype(complex), self.given[1])


if __name__ == "__main__":
    unittest.main()
