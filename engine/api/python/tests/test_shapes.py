"""Shapes other than triangles stand where a mesh is asked for."""

import os
import pickle
import tempfile
import unittest

import numpy as np

import ballot


class ShapesTest(unittest.TestCase):
    def test_spheres_are_hit_where_they_are(self):
        rng = np.random.default_rng(1)
        centers, radii = rng.uniform(-1, 1, (400, 3)), rng.uniform(0.01, 0.1, 400)
        scene = ballot.Scene(ballot.spheres(centers.astype(np.float32), radii))
        rays = np.concatenate([rng.uniform(-3, 3, (2000, 3)), rng.normal(size=(2000, 3))], 1)
        rays[:, 3:] = -rays[:, :3] + 0.3 * rays[:, 3:]
        rays = rays.astype(np.float32)
        o, d = rays[:, None, :3].astype(np.float64), rays[:, None, 3:].astype(np.float64)
        f = o - centers.astype(np.float32)
        a, b, c = (d * d).sum(-1), (f * d).sum(-1), (f * f).sum(-1) - radii**2
        with np.errstate(invalid="ignore"):
            t = np.where(b * b >= a * c, (-b - np.sqrt(b * b - a * c)) / a, np.inf)
        t[t < 0] = np.inf
        hits = scene.trace(rays)
        self.assertGreater((hits["prim"] != ballot.MISS).sum(), 500)
        near = np.isfinite(t.min(1))
        self.assertLess((near != (hits["prim"] != ballot.MISS)).sum(), 3)  # rims
        both = near & (hits["prim"] != ballot.MISS)
        self.assertLess(np.median(abs(hits["t"][both] - t.min(1)[both])), 1e-6)
        columns = scene.trace_columns(rays, ("normals", "prims", "t"))
        at = rays[both, :3] + columns["t"][both, None] * rays[both, 3:]
        out = (at - centers[columns["prims"][both]]) / radii[columns["prims"][both], None]
        self.assertLess(abs(columns["normals"][both] - out).max(), 1e-3)
        self.assertLess(np.median(abs(columns["normals"][both] - out)), 2e-5)

    def test_mixed_scenes_are_edited(self):
        triangle = ([[-1, -1, 5], [1, -1, 5], [0, 1, 5]], [[0, 1, 2]])
        box, disc = ballot.boxes([[-1, -1, 2]], [[1, 1, 3]]), ballot.discs([[0, 0, 1]], [[0, 0, 2]], 0.5)
        scene = ballot.Scene(meshes=[triangle, box, disc])
        ray = [[0, 0, 0, 0, 0, 1]]
        self.assertEqual(scene.trace(ray)["t"].tolist(), [1])
        self.assertEqual(scene.count_crossings(ray).tolist(), [4])
        self.assertEqual(scene.crossings(ray).hits["t"].tolist(), [1, 2, 3, 5])
        self.assertEqual(scene.count_crossings(ray, cull="back").tolist(), [1])
        scene.remove_mesh(2)
        number = scene.add_mesh(ballot.capsules([[0, 0, 0.5], [0, 0, 1]], [0.25, 0.25]))
        scene.add_instances(np.eye(4)[None], number)
        scene.commit()
        self.assertEqual(scene.trace(ray)["t"].tolist(), [0.25])
        scene.set_vertices(number, [[0, 0, 1], [0, 0, 1.5]])
        scene.commit()
        self.assertEqual(scene.trace(ray)["t"].tolist(), [0.75])
        again = pickle.loads(pickle.dumps(scene))
        self.assertEqual(again.crossings(ray).hits["t"].tolist(), [0.75, 1.75, 2, 3, 5])

    def test_ellipsoids_are_instances(self):
        matrix = np.diag([1.0, 1, 3, 1])
        scene = ballot.Scene(ballot.spheres([[0, 0, 0]], 1), instances=matrix[None])
        columns = scene.trace_columns([[0, 0, -9, 0, 0, 1], [0.6, 0, -9, 0, 0, 1]], ("t", "normals"))
        np.testing.assert_allclose(columns["t"], [6, 9 - 3 * 0.8], rtol=1e-6)
        n = np.array([0.6, 0, -0.8 / 3])
        np.testing.assert_allclose(columns["normals"], [[0, 0, -1], n / np.linalg.norm(n)], atol=1e-6)
        with self.assertRaisesRegex(ValueError, "unevenly"):
            scene.nearest([[0, 0, 5]])

    def test_points_near_shapes(self):
        scene = ballot.Scene(meshes=[ballot.spheres([[0, 0, 0]], 1), ballot.boxes([[3, -1, -1]], [[5, 1, 1]])])
        points = [[0, 0, 3], [0, 0, 0.25], [4, 0, 0.5], [4, 3, 0]]
        near = scene.nearest(points)
        np.testing.assert_allclose(near["distances"], [2, 0.75, 0.5, 2], rtol=1e-6)
        np.testing.assert_allclose(near["points"], [[0, 0, 1], [0, 0, 1], [4, 0, 1], [4, 1, 0]], atol=1e-6)
        signs = scene.nearest(points, ("inside", "signed_distances"))
        self.assertEqual(signs["inside"].tolist(), [False, True, True, False])
        np.testing.assert_allclose(signs["signed_distances"], [2, -0.75, -0.5, 2], rtol=1e-6)

    def test_files_of_shapes(self):
        rng = np.random.default_rng(1)
        centers = rng.uniform(-1, 1, (200, 3)).astype(np.float32)
        rays = np.concatenate([np.full((500, 3), [0, 0, 5]), rng.normal([0, 0, -1], 0.1, (500, 3))], 1)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "cloud.npy")
            np.save(path, centers)
            scene = ballot.load_scene(path, radius=0.125, cache=False)
            self.assertEqual([m.shapes for m in scene.meshes], ["spheres"])
            made = ballot.Scene(ballot.spheres(centers, 0.125))
            np.testing.assert_array_equal(scene.trace(rays), made.trace(rays))
            scene.set_vertices(0, centers + np.float32(0.25))
            scene.commit()
            made.set_vertices(0, centers + np.float32(0.25))
            made.commit()
            np.testing.assert_array_equal(scene.trace(rays), made.trace(rays))
            np.save(path, np.concatenate([centers, centers, centers[:, :1] * 0 + 1], 1))
            with self.assertRaisesRegex(ballot.Error, "say which"):
                ballot.load_scene(path)
            discs = ballot.load_scene(path, shapes="discs", cache=False)
            self.assertEqual(discs.meshes[0].shapes, "discs")
            with self.assertRaisesRegex(ValueError, "cubes"):
                ballot.load_scene(path, shapes="cubes")

    def test_pictures_of_shapes(self):
        scene = ballot.Scene(ballot.spheres([[0, 0, 0]], 1))
        image = np.asarray(ballot.render(scene, width=32, height=32, shading="ao"))
        self.assertGreater((image[..., 0] == 1).sum(), 100)

    def test_heights_are_triangles(self):
        rng = np.random.default_rng(4)
        raster = rng.uniform(0, 2, (30, 40)).astype(np.float32)
        raster[rng.uniform(size=raster.shape) < 0.05] = np.nan
        dx, dy, x0, y0 = 0.3, 0.7, -2, 5
        r, c = np.mgrid[:30, :40]
        vertices = np.stack([x0 + c * dx, y0 + r * dy, np.nan_to_num(raster.astype(np.float64))], -1).reshape(-1, 3)
        a = (r * 40 + c)[:-1, :-1].reshape(-1)
        triangles = np.stack([a, a + 1, a + 41, a, a + 41, a + 40], 1).reshape(-1, 3)
        holes = np.isnan(raster.reshape(-1))
        triangles[holes[triangles].any(1)] = np.flatnonzero(~holes)[0]
        scene = ballot.Scene(ballot.heights(raster, (dx, dy), (x0, y0)))
        made = ballot.Scene(vertices, triangles)
        rays = np.concatenate([rng.uniform([-3, 4, 0], [11, 28, 3], (4000, 3)), rng.normal(size=(4000, 3))], 1)
        for numeric in ("watertight", "exact", "double"):
            np.testing.assert_array_equal(scene.trace(rays, numeric=numeric), made.trace(rays, numeric=numeric))
        np.testing.assert_array_equal(scene.nearest(rays[:, :3])["distances"], made.nearest(rays[:, :3])["distances"])
        np.testing.assert_array_equal(scene.count_crossings(rays), made.count_crossings(rays))
        np.testing.assert_array_equal(scene.heights(0), raster)
        self.assertEqual((scene.meshes[0].shapes, scene.meshes[0].columns), ("heights", 40))
        self.assertEqual((scene.meshes[0].spacing, scene.meshes[0].corner), ((dx, dy), (x0, y0)))
        masked = ballot.Scene(ballot.heights(np.ma.masked_invalid(raster), (dx, dy), (x0, y0)))
        np.testing.assert_array_equal(masked.trace(rays), made.trace(rays))

    def test_heights_move_and_are_pickled(self):
        rng = np.random.default_rng(5)
        rays = np.concatenate([rng.uniform([0, 0, 3], [5, 4, 4], (500, 3)), rng.normal([0, 0, -1], 0.3, (500, 3))], 1)
        rasters = rng.uniform(0, 2, (3, 5, 6)).astype(np.float32)
        rasters[1:, 2, 2] = np.nan

        def expect(scene, raster):
            np.testing.assert_array_equal(scene.trace(rays), ballot.Scene(ballot.heights(raster)).trace(rays))
            np.testing.assert_array_equal(scene.heights(0), raster)

        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "terrain.npy")
            np.save(path, rasters[0])
            loaded = ballot.load_scene(path, shapes="heights", spacing=(1, 1), cache=False)
            for scene in (ballot.Scene(ballot.heights(rasters[0])), loaded):
                self.assertEqual(scene.meshes[0].shapes, "heights")
                expect(pickle.loads(pickle.dumps(scene)), rasters[0])
                for raster in rasters:
                    scene.set_heights(0, raster)
                    scene.commit()
                    expect(scene, raster)
                    expect(pickle.loads(pickle.dumps(scene)), raster)
            with self.assertRaisesRegex(ballot.Error, "2 heights in 1 columns"):
                np.save(path, rasters[0][:2, :1])
                ballot.load_scene(path, shapes="heights")
        scene = ballot.Scene(ballot.heights(rasters[0]))
        number = scene.add_mesh(ballot.heights(rasters[0], 0.5, (10, 0)), attributes={"h": rasters[0].reshape(-1)})
        scene.add_instances(np.eye(4)[None], number)
        scene.commit()
        ray = [[11.125, 1.25, 9, 0, 0, -1]]
        told = scene.trace_columns(ray, ("t", "h"))
        self.assertAlmostEqual(told["t"][0] + told["h"][0], 9, 5)
        again = pickle.loads(pickle.dumps(scene))
        self.assertEqual(again.trace(ray)["t"], told["t"])
        np.testing.assert_array_equal(again.heights(number), rasters[0])

    def test_bad_heights(self):
        flat = np.zeros((3, 4), np.float32)
        for bad, text in (
            (lambda: ballot.heights(flat[0]), "expected .rows, columns."),
            (lambda: ballot.heights(flat[:1]), "at least .2, 2."),
            (lambda: ballot.heights(flat, 0), "above 0"),
            (lambda: ballot.heights(flat, (1, -1)), "above 0"),
            (lambda: ballot.heights(flat, np.nan), "spacing is nan"),
            (lambda: ballot.heights(flat, (1, 2, 3)), "expected two"),
            (lambda: ballot.heights(flat, 1, (0, np.inf)), "corner is inf"),
            (lambda: ballot.Scene(ballot.heights([[0, np.inf], [0, 0]])), "row 0, column 1 is inf"),
            (lambda: ballot.Scene(ballot.heights(flat), [[0, 1, 2]]), "expected shapes alone"),
        ):
            with self.assertRaisesRegex(ValueError, text):
                bad()
        with self.assertRaisesRegex(TypeError, "dtype"):
            ballot.heights(flat.astype(complex))
        nothing = ([[0, 0, 0]] * 3, [[0, 1, 2]])
        scene = ballot.Scene(meshes=[ballot.heights(flat), ballot.heights(flat * np.nan), nothing])
        self.assertEqual(scene.count_crossings([[1.5, 1.5, 1, 0, 0, -1]]).tolist(), [1])
        for bad, text in (
            (lambda: scene.set_heights(0, flat.T), "expected 4 columns"),
            (lambda: scene.set_heights(0, flat[:2]), "made with 12"),
            (lambda: scene.set_heights(2, flat), "not of heights"),
            (lambda: scene.heights(2), "not of heights"),
            (lambda: scene.set_vertices(0, np.zeros((12, 3), np.float32)), "is of heights"),
        ):
            with self.assertRaisesRegex(ValueError, text):
                bad()

    def test_bad_shapes(self):
        for bad, text in (
            (lambda: ballot.spheres([[0, 0, 0]], -1), "radius 0 is -1"),
            (lambda: ballot.spheres([[0, 0, 0]], np.nan), "radius 0 is nan"),
            (lambda: ballot.spheres([[0, 0, 0]], [1, 2]), "expected a number"),
            (lambda: ballot.spheres(np.zeros((0, 3)), 1), "none"),
            (lambda: ballot.discs([[0, 0, 0]], [[0, 0, 1], [0, 0, 1]], 1), "one for each center"),
            (lambda: ballot.Scene(ballot.discs([[0, 0, 0]], [[0, 0, 0]], 1)), "normal of vertex 0"),
            (lambda: ballot.capsules([[0, 0, 0]], 1), "even number"),
            (lambda: ballot.Scene(ballot.capsules([[0, 0, 0]], 1, [[0, 7]])), "index 1 is 7"),
            (lambda: ballot.boxes([[0, 0, 0]], [[0, 0, 0], [1, 1, 1]]), "as that of low"),
            (lambda: ballot.Scene(ballot.spheres([[0, 0, 0]], 1), [[0, 1, 2]]), "expected shapes alone"),
            (lambda: ballot.Scene(ballot.spheres([[0, 0, np.inf]], 1)), "vertex 0"),
        ):
            with self.assertRaisesRegex(ValueError, text):
                bad()
        scene = ballot.Scene(ballot.spheres([[0, 0, 0]], 1))
        hit = scene.trace([[0, 0, 5, 0, 0, -1]], numeric="exact")
        self.assertEqual((hit["t"][0], hit["prim"][0]), (4, 0))
        with self.assertRaisesRegex(ValueError, "nearest and any hits"):
            scene.crossings([[0, 0, 5, 0, 0, -1]], numeric="exact")
        for numeric in ("double", "fast"):
            with self.assertRaisesRegex(ValueError, "shapes"):
                scene.trace([[0, 0, 5, 0, 0, -1]], numeric=numeric)
        with self.assertRaisesRegex(ValueError, "discs"):
            ballot.Scene(ballot.discs([[0, 0, 0]], [[0, 0, 1]], 1)).nearest([[0, 0, 0]], ("inside",))


if __name__ == "__main__":
    unittest.main()
