"""Rays that poses move, the tables of cameras and scanners, and grids. Answers are bit for bit those to the same
questions as arrays."""

import tracemalloc
import unittest

import ballot
import numpy as np
import reference as ref

Camera = ballot.Camera


def random_poses(seed, *shape):
    """Returns rotations and translations, (*shape, 3, 4) float64."""
    random = np.random.default_rng(seed)
    q, _ = np.linalg.qr(random.normal(size=(*shape, 3, 3)))
    return np.concatenate([q, random.uniform(-0.5, 1.5, (*shape, 3, 1))], axis=-1)


def moved(poses, origins, directions):
    """Returns rays (..., 6) as float32 arithmetic moves them."""
    m, o, d = (np.asarray(a, np.float64).astype(np.float32) for a in (poses, origins, directions))
    rows = [[m[..., i, 0] * v[..., 0] + m[..., i, 1] * v[..., 1] + m[..., i, 2] * v[..., 2] for i in range(3)]
            for v in (o, d)]  # fmt: skip
    rows[0] = [row + m[..., i, 3] for i, row in enumerate(rows[0])]
    return np.stack(np.broadcast_arrays(*rows[0], *rows[1]), axis=-1)


class Poses(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = ballot.Scene(*ref.soup(300))
        cls.rays = ref.random_rays(600).reshape(20, 30, 6)

    def same(self, expected, *rays, **given):
        scene = self.scene
        np.testing.assert_array_equal(scene.trace(*rays, **given), scene.trace(expected))
        np.testing.assert_array_equal(scene.submit(*rays, **given).wait(), scene.trace(expected))
        np.testing.assert_array_equal(scene.occluded(*rays, **given), scene.occluded(expected))
        np.testing.assert_array_equal(scene.count_crossings(*rays, **given), scene.count_crossings(expected))
        for one, other in zip(scene.crossings(*rays, **given), scene.crossings(expected)):
            np.testing.assert_array_equal(one, other)
        np.testing.assert_array_equal(scene.trace(*rays, first=2, **given), scene.trace(expected, first=2))

    def test_broadcast(self):
        o, d = self.rays[..., :3], self.rays[..., 3:]
        for shape in ((), (30,), (20, 1), (20, 30), (4, 1, 1), (2, 1, 1, 1), (1,) * 8):
            poses = random_poses(3, *shape)
            for given in (poses, poses.astype(np.float32), self.four_by_four(poses), np.asfortranarray(poses)):
                with self.subTest(shape, dtype=given.dtype, last=given.shape[-2:]):
                    expected = moved(poses[..., :3, :], o, d)
                    self.same(expected, self.rays, poses=given)
                    self.same(expected, origins=o, directions=d, poses=given)

    @staticmethod
    def four_by_four(poses):
        full = np.tile(np.eye(4), (*poses.shape[:-2], 1, 1))
        full[..., :3, :] = poses
        return full

    def test_ranges_and_masks(self):
        poses = random_poses(4, 5, 1, 1)
        expected = np.zeros((5, 20, 30, 8), np.float32)
        expected[..., [0, 1, 2, 4, 5, 6]] = moved(poses, self.rays[..., :3], self.rays[..., 3:])
        high = np.random.default_rng(1).uniform(0.1, 2, (5, 20, 30)).astype(np.float32)
        expected[..., 3], expected[..., 7] = 0.125, high
        self.same(expected, self.rays, poses=poses, t=(0.125, high))
        np.testing.assert_array_equal(
            self.scene.trace(self.rays, poses=poses, masks=np.uint32(0))["prim"], np.uint32(ballot.MISS)
        )

    def test_dead(self):
        poses = random_poses(5, 3)
        poses[0, 1, 2], poses[2, 0, 0] = np.nan, 1e300
        hits = self.scene.trace(self.rays, poses=poses[:, None, None])
        self.assertEqual((hits["prim"] != ballot.MISS).any(axis=(1, 2)).tolist(), [False, True, False])

    def test_wrong(self):
        scene, rays, eye = self.scene, self.rays, np.eye(4)[:3]
        projective = np.tile(np.eye(4), (2, 1, 1, 1))
        projective[1, 0, 3, 0] = 1
        for poses, text in [
            (np.eye(3), r"poses: shape is \(3, 3\); expected \(..., 3, 4\) or \(..., 4, 4\)"),
            (eye[0], r"poses: shape is \(4,\)"),
            (np.tile(eye, (7, 1, 1)), r"poses: shape is \(7, 3, 4\), of rays \(20, 30\); expected axes"),
            (projective, r"poses: the last row of matrix \[1, 0\] is \[1.0, 0.0, 0.0, 1.0\]; expected \[0, 0, 0, 1\]"),
            (eye * np.nan, "poses: a number of the matrix is not finite"),
            (eye * 1e300, "poses: a number of the matrix is not finite"),
        ]:
            with self.assertRaisesRegex(ValueError, text):
                scene.trace(rays, poses=poses)
        with self.assertRaisesRegex(TypeError, "poses: dtype is int64; expected float32"):
            scene.trace(rays, poses=eye.astype(np.int64))
        with self.assertRaisesRegex(ValueError, "poses: shape"):
            scene.trace(rays, poses=3)
        with self.assertRaisesRegex(TypeError, "rays: found beside origins"):
            scene.trace(ballot.lidar([0], [0]), origins=[0, 0, 0], directions=[0, 0, 1])
        with self.assertRaisesRegex(ValueError, "out: it overlaps the rays"):
            room = np.zeros((20, 30, 4), np.float32)
            scene.trace(rays, poses=room[0, :3], out=room)

    def test_no_array_of_rays_is_made(self):
        camera, poses = Camera.pinhole(160, 120, fov=1), random_poses(6, 40)
        out = np.empty((40, 120, 160), ballot.HIT)
        self.scene.trace(camera, poses=poses[:1])
        tracemalloc.start()
        self.scene.trace(camera, poses=poses, out=out)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        self.assertLess(peak, 200_000)
        expected = self.scene.trace(moved(poses[:, None, None], (0, 0, 0), camera.directions))
        np.testing.assert_array_equal(out, expected)


class Cameras(unittest.TestCase):
    K = np.array([[500, 2, 310], [0, 480, 250], [0, 0, 1.0]])

    def project(self, camera, k=K):
        """Returns where directions meet the picture."""
        d = camera.directions.astype(np.float64)
        p = (d / d[..., 2:]) @ k.T
        return p[..., :2]

    def pixels(self, width, height):
        u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        return np.stack([u, v], axis=-1)

    def test_pinhole(self):
        camera = Camera.pinhole(640, 480, self.K)
        self.assertEqual((camera.shape, camera.directions.dtype), ((480, 640), np.float32))
        np.testing.assert_allclose(self.project(camera), self.pixels(640, 480), atol=1e-3)
        self.assertTrue((camera.directions[..., 2] == 1).all())
        unit = Camera.pinhole(640, 480, self.K, normalized=True)
        np.testing.assert_allclose(np.linalg.norm(unit.directions, axis=-1), 1, atol=1e-6)
        np.testing.assert_allclose(self.project(unit), self.pixels(640, 480), atol=1e-3)
        by_angle = Camera.pinhole(64, 48, fov=np.pi / 2).directions
        np.testing.assert_allclose(by_angle[0, 0], [-63 / 48, -47 / 48, 1], rtol=1e-6)

    def test_conventions(self):
        for make in (
            lambda c: Camera.pinhole(8, 6, fov=1, convention=c),
            lambda c: Camera.orthographic(8, 6, 3, convention=c),
            lambda c: Camera.fisheye(8, 6, fov=3, convention=c),
            lambda c: Camera.panorama(8, 6, convention=c),
        ):
            cv, gl = make("opencv"), make("opengl")
            np.testing.assert_array_equal(cv.directions * np.float32([1, -1, -1]), gl.directions)
            np.testing.assert_array_equal(cv.origins * np.float32([1, -1, -1]), gl.origins)

    def test_distortion(self):
        five, eight = [-0.25, 0.08, 1e-3, 5e-4, -0.01], [0.2, 0.1, 0, 0, 0.01, 0.3, 0.05, 0.002]
        for k in ([-0.3, 0.1, 1e-3, -2e-3], five, eight):
            d = Camera.pinhole(640, 480, self.K, distortion=k).directions.astype(np.float64)
            x, y = d[..., 0], d[..., 1]
            k1, k2, p1, p2, k3, k4, k5, k6 = k + [0] * (8 - len(k))
            r = x * x + y * y
            radial = (1 + k1 * r + k2 * r**2 + k3 * r**3) / (1 + k4 * r + k5 * r**2 + k6 * r**3)
            across = x * radial + 2 * p1 * x * y + p2 * (r + 2 * x * x)
            down = y * radial + p1 * (r + 2 * y * y) + 2 * p2 * x * y
            found = np.stack([across, down, np.ones_like(x)], axis=-1) @ self.K.T
            np.testing.assert_allclose(found[..., :2], self.pixels(640, 480), atol=1e-3)

    def test_fisheye(self):
        camera = Camera.fisheye(101, 101, fov=np.pi)
        angle = np.arccos(camera.directions[..., 2].astype(np.float64))
        u = self.pixels(101, 101) - 50.5
        np.testing.assert_allclose(angle, np.hypot(u[..., 0], u[..., 1]) * np.pi / 101, atol=1e-3)
        self.assertEqual(camera.directions[50, 50].tolist(), [0, 0, 1])
        np.testing.assert_allclose(np.linalg.norm(camera.directions, axis=-1), 1, atol=1e-6)
        k1, k2, k3, k4 = k = (0.05, -0.01, 0.002, -0.0003)
        d = Camera.fisheye(640, 480, self.K, distortion=k).directions.astype(np.float64)
        t = np.arctan2(np.hypot(d[..., 0], d[..., 1]), d[..., 2])
        bent = t * (1 + k1 * t**2 + k2 * t**4 + k3 * t**6 + k4 * t**8)
        x = d[..., :2] / np.linalg.norm(d[..., :2], axis=-1, keepdims=True) * bent[..., None]
        found = np.concatenate([x, np.ones_like(x[..., :1])], axis=-1) @ self.K.T
        np.testing.assert_allclose(found[..., :2], self.pixels(640, 480), atol=1e-3)
        around = Camera.fisheye(9, 9, fov=2 * np.pi).directions
        self.assertEqual(np.isnan(around[0, 0]).tolist(), [True] * 3)
        self.assertFalse(np.isnan(around[4]).any())

    def test_orthographic(self):
        camera = Camera.orthographic(4, 2, 3.0)
        self.assertEqual(camera.shape, (2, 4))
        self.assertEqual(camera.origins[0].tolist(), [[x, -0.75, 0] for x in (-2.25, -0.75, 0.75, 2.25)])
        scene = ballot.Scene([[-1, -1, 5], [1, -1, 5], [0, 1, 5]], [[0, 1, 2]])
        self.assertEqual(scene.trace(camera, poses=np.eye(4))["t"].tolist(), [[np.inf, 5, 5, np.inf], [np.inf] * 4])

    def test_panorama(self):
        d = Camera.panorama(360, 180).directions
        np.testing.assert_allclose(np.arcsin(-d[:, 0, 1]), np.deg2rad(np.arange(89.5, -90, -1)), atol=1e-3)
        np.testing.assert_allclose(np.arctan2(d[90, :, 0], d[90, :, 2]), np.deg2rad(np.arange(-179.5, 180)), atol=1e-5)
        low = Camera.panorama(4, 1, vertical=(-0.5, 0.1)).directions
        np.testing.assert_allclose(np.arcsin(-low[0, :, 1]), -0.2, atol=1e-6)

    def test_wrong(self):
        singular, perspective = self.K.copy(), self.K.copy()
        singular[1, 1], perspective[2, 0] = 0, 1
        for text, make in [
            ("width is 0; expected 1 to", lambda: Camera.pinhole(0, 4, fov=1)),
            ("height is 0", lambda: Camera.panorama(4, 0)),
            ("height is -1", lambda: Camera.orthographic(4, -1, 1)),
            ("K is singular: fx is 500.0 and fy 0.0", lambda: Camera.pinhole(4, 4, singular)),
            ("K is .*; expected ..fx, skew, cx.", lambda: Camera.pinhole(4, 4, perspective)),
            ("K is .*all finite", lambda: Camera.fisheye(4, 4, self.K * np.nan)),
            (r"K: shape is \(2, 3\)", lambda: Camera.pinhole(4, 4, self.K[:2])),
            ("fov is 0; expected an angle above 0 and below 3.1416", lambda: Camera.pinhole(4, 4, fov=0)),
            ("fov is 3.2", lambda: Camera.pinhole(4, 4, fov=3.2)),
            ("fov is 6.3", lambda: Camera.fisheye(4, 4, fov=6.3)),
            ("vertical is", lambda: Camera.panorama(4, 4, vertical=(1, -1))),
            ("vertical is", lambda: Camera.panorama(4, 4, vertical=(0, 2))),
            ("size is 0", lambda: Camera.orthographic(4, 4, 0)),
            ("convention is 'blender'; expected one of opencv, opengl",
             lambda: Camera.panorama(4, 4, convention="blender")),
            (r"distortion is \[1.0, 2.0\]; expected 4 or 5 or 8",
             lambda: Camera.pinhole(4, 4, fov=1, distortion=[1, 2])),
            ("distortion: it cannot be undone at .* row 0, column 0",
             lambda: Camera.pinhole(640, 480, fov=2, distortion=[-0.9, 0, 0, 0])),
            ("distortion: it cannot be undone", lambda: Camera.fisheye(64, 64, fov=6, distortion=[-0.5, 0, 0, 0])),
        ]:  # fmt: skip
            with self.subTest(text), self.assertRaisesRegex(ValueError, text):
                make()
        for make in (lambda: Camera.pinhole(4, 4), lambda: Camera.fisheye(4, 4, self.K, fov=1)):
            with self.assertRaisesRegex(TypeError, "camera: found .*; expected one of them"):
                make()


class Patterns(unittest.TestCase):
    def test_lidar(self):
        e, a = np.deg2rad([-10, 0, 20]), np.linspace(0, 2 * np.pi, 90, endpoint=False)
        d = ballot.lidar(e, a).directions
        self.assertEqual(d.shape, (3, 90, 3))
        np.testing.assert_allclose(np.arcsin(d[..., 2]), np.broadcast_to(e[:, None], (3, 90)), atol=1e-6)
        np.testing.assert_allclose(np.arctan2(d[..., 1], d[..., 0]) % (2 * np.pi), np.tile(a, (3, 1)), atol=1e-5)
        self.assertEqual(ballot.lidar(e[:, None], a + e[:, None]).shape, (3, 90))
        with self.assertRaisesRegex(ValueError, "elevations and azimuths: shapes are"):
            ballot.lidar(np.zeros((2, 3)), np.zeros(4))

    def test_lidar_that_moves(self):
        scene, poses = ballot.Scene(*ref.soup(300)), random_poses(8, 64)
        table = ballot.lidar(np.linspace(-1, 1, 8), np.linspace(0, 6, 64)).directions
        np.testing.assert_array_equal(
            scene.trace(origins=(0, 0, 0), directions=table, poses=poses), scene.trace(moved(poses, (0, 0, 0), table))
        )

    def test_hemisphere(self):
        d = ballot.hemisphere(4096).directions.astype(np.float64)
        np.testing.assert_allclose(np.linalg.norm(d, axis=-1), 1, atol=1e-6)
        self.assertTrue((d[:, 2] > 0).all())
        np.testing.assert_allclose(d.mean(axis=0), [0, 0, 2 / 3], atol=2e-3)  # of a density of cos / pi
        np.testing.assert_allclose((d * d).mean(axis=0), [0.25, 0.25, 0.5], atol=2e-3)
        self.assertFalse(np.array_equal(d, ballot.hemisphere(4096, 1).directions))
        with self.assertRaisesRegex(ValueError, "n is 0"):
            ballot.hemisphere(0)

    def test_frames(self):
        random = np.random.default_rng(9)
        normals, points = random.normal(size=(50, 3)), random.normal(size=(50, 3))
        normals[:2] = (0, 0, -1), (0, 0, 1)
        f = ballot.frames(normals, points).astype(np.float64)
        np.testing.assert_allclose(f[:, :, 2], normals / np.linalg.norm(normals, axis=-1, keepdims=True), atol=1e-6)
        turns = f[:, :, :3]
        np.testing.assert_allclose(np.swapaxes(turns, 1, 2) @ turns, np.tile(np.eye(3), (50, 1, 1)), atol=1e-6)
        np.testing.assert_allclose(np.linalg.det(turns), 1, atol=1e-5)
        np.testing.assert_allclose(f[:, :, 3], points, atol=1e-6)
        self.assertTrue(np.isnan(ballot.frames([[0, 0, 0]])[..., :3]).all())
        with self.assertRaisesRegex(ValueError, "normals and points: shapes are"):
            ballot.frames(normals, points[:7])

    def test_wrong(self):
        with self.assertRaisesRegex(ValueError, "origins and directions: shapes are"):
            ballot.Pattern(np.zeros((4, 3)), np.zeros((5, 3)))
        with self.assertRaisesRegex(ValueError, r"directions: shape is \(4,\)"):
            ballot.Pattern(np.zeros(4))


class Grids(unittest.TestCase):
    def test_answers(self):
        scene = ballot.Scene(*ref.soup(300))
        x, y, z = np.linspace(-1, 2, 13), np.linspace(0, 1, 7, dtype=np.float32), np.linspace(1, -1, 31)[::3]
        points = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1)
        grid = ballot.grid(x, y, z)
        self.assertEqual((grid.shape, repr(grid)), ((13, 7, 11), "<ballot.Grid of shape (13, 7, 11)>"))
        for given in ({}, {"limit": 0.25}, {"limit": np.linspace(0.1, 1, 11)}):
            found, expected = scene.nearest(grid, **given), scene.nearest(points, **given)
            for name, column in expected.items():
                np.testing.assert_array_equal(found[name], column, name)
        bits = np.uint32([1, 2, 3, 0, 4, 5, 6])[:, None]
        np.testing.assert_array_equal(
            scene.nearest(grid, masks=bits)["prims"], scene.nearest(points, masks=bits)["prims"]
        )
        for one, other in zip(scene.within(grid, 0.3), scene.within(points, 0.3)):
            np.testing.assert_array_equal(one, other)
        self.assertEqual(scene.nearest(ballot.grid(x, [], z))["distances"].shape, (13, 0, 11))

    def test_wrong(self):
        with self.assertRaisesRegex(ValueError, r"y: shape is \(2, 2\); expected \(n,\)"):
            ballot.grid([0], np.zeros((2, 2)), [0])
        with self.assertRaisesRegex(TypeError, "z: dtype is bool; expected numbers"):
            ballot.grid([0], [0], np.zeros(3, bool))


if __name__ == "__main__":
    unittest.main()
