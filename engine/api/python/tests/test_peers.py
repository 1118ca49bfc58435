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

    def test_results_have_the_methods_of_tensors(self):
        got = self.scene.cast_rays(self.rays)
        first = got["t_hit"][0, 0]
        self.assertEqual((first.item(), float(first.cpu()), first.numpy().shape), (1, 1, ()))
        self.assertIs(type(got["t_hit"].numpy()), np.ndarray)
        self.assertIs(got["t_hit"].cpu(), got["t_hit"])
        np.testing.assert_array_equal(got["t_hit"].cpu().numpy(), [[1, np.inf], [np.inf, 2]])
        self.assertEqual({0: "cube"}[got["geometry_ids"][0, 0]], "cube")
        points = np.zeros((1, 3), np.float32)
        for answer in (
            self.scene.test_occlusions(self.rays),
            self.scene.count_intersections(self.rays),
            self.scene.compute_distance(points),
            self.scene.compute_signed_distance(points),
            self.scene.compute_occupancy(points),
            *self.scene.list_intersections(self.rays).values(),
            *self.scene.compute_closest_points(points).values(),
            ballot.RaycastingScene.create_rays_pinhole(60, [0, 0, 0], [1, 2, 3], [0, 1, 0], 5, 3),
        ):
            self.assertIs(type(answer.cpu().numpy()), np.ndarray)

    def test_devices(self):
        class Device:  # as Open3D's
            def get_type(self):
                return "CPU"

            def __str__(self):
                return "CPU:0"

        for device in (None, "CPU:0", Device(), ballot.default_device()):
            scene = ballot.RaycastingScene(device=device)
            scene.add_triangles(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
            self.assertEqual(scene.count_intersections(self.rays[0]).tolist(), [2, 0])

    def test_signs_of_an_open_mesh(self):
        scene = ballot.RaycastingScene()
        scene.add_triangles(
            np.float32([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]), np.uint32([[0, 1, 2], [0, 2, 3]])
        )
        points = np.float32([[0, 0.1, -0.5], [0.9, 0.8, -0.5], [0, 0.1, 0.5]])  # rays along (1, 1, 1) meet it or do not
        self.assertEqual(scene.compute_occupancy(points).tolist(), [1, 0, 0])
        self.assertEqual(scene.compute_signed_distance(points, nsamples=3).tolist(), [-0.5, 0.5, 0.5])
        with self.assertRaisesRegex(ValueError, "not closed"):
            scene.compute_occupancy(points, assume_closed=False)
        for nsamples in (0, 2):
            with self.assertRaisesRegex(ValueError, "nsamples"):
                scene.compute_signed_distance(points, nsamples=nsamples)

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
            (ValueError, "device is CUDA:0; expected", lambda: ballot.RaycastingScene(device="CUDA:0")),
            (TypeError, "device: found int", lambda: ballot.RaycastingScene(device=3)),
            (TypeError, "nthreads: found str", lambda: self.scene.cast_rays(self.rays, nthreads="two")),
        ):
            with self.subTest(text), self.assertRaisesRegex(error, text):
                call()
        self.assertEqual(self.scene.add_triangles(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES), 1)  # nothing was half added


if __name__ == "__main__":
    unittest.main()
