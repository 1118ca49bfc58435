"""Rays of a view, pictures and measurements."""

import unittest

import ballot
import numpy as np
import reference as ref

CAMERA = {"eye": (0, 0, 5), "target": (0, 0, 0), "yfov": 0.8}


class Pictures(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)

    def test_rays(self):
        rays = self.scene.make_rays(CAMERA, "primary", 24, 16)
        self.assertEqual((rays.shape, rays.dtype), ((24 * 16, 8), np.float32))
        np.testing.assert_array_equal(rays[:, :3], np.broadcast_to(np.float32([0, 0, 5]), (384, 3)))
        self.assertEqual(len({tuple(r) for r in rays[:, 4:7].tolist()}), 384)
        self.assertGreater(len(self.scene.make_rays(CAMERA, "ao", 16, 16)), 0)
        self.assertGreater(len(self.scene.make_rays()), 0)

    def test_render(self):
        image = ballot.render(self.scene, CAMERA, 33, 20)
        self.assertEqual((image.shape, image.dtype), ((20, 33, 4), np.float32))
        self.assertEqual((image[10, 16, 3], image[0, 0, 3]), (1, 0))
        self.assertTrue(np.isfinite(image).all())
        np.testing.assert_array_equal(ballot.render(self.scene, CAMERA, 33, 20, method="packet"), image)
        up = ballot.render(self.scene, {**CAMERA, "up": (1, 0, 0)}, 20, 20)
        self.assertEqual(up.shape, (20, 20, 4))
        flat = ballot.render(self.scene, {**CAMERA, "ymag": 2.0}, 20, 20)
        self.assertEqual(flat[..., 3].sum(), 100)  # half of the height, half of the width
        self.assertEqual(ballot.render(self.scene, width=8, height=8).shape, (8, 8, 4))

    def test_arguments(self):
        seen = []
        image = ballot.render(self.scene, CAMERA, 16, 16, samples=2, shading="path", sky="1,0,0", bounces=2, seed=3,
                              progress=seen.append)  # fmt: skip
        self.assertGreater(image[0, 0, 0], 0)
        self.assertEqual(image[0, 0, 1], 0)
        self.assertTrue(seen)
        scene = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES, normals=ref.CUBE_VERTICES / np.float32(3**0.5))
        smooth = ballot.render(scene, CAMERA, 16, 16, shading="normals")
        self.assertFalse(np.array_equal(smooth, ballot.render(self.scene, CAMERA, 16, 16, shading="normals")))


class Bench(unittest.TestCase):
    def test_records(self):
        scene = ballot.Scene(*ref.soup(50))
        records = ballot.bench(
            scene, ["packet", "while-while"], ["primary", "shadow"], ["plain", "watertight"], (32, 32), 2
        )
        self.assertEqual(len(records), 8)
        for record in records:
            self.assertEqual(record["repeats"], 2)
            self.assertGreater(record["device_ms"], 0)
            self.assertGreater(record["mrays"], 0)
            self.assertGreaterEqual(record["spread"], 0)
            self.assertEqual(record["any"], record["kind"] == "shadow")
        self.assertEqual({(r["method"], r["numeric"]) for r in records if r["kind"] == "primary"},
                         {(m, n) for m in ("packet", "while-while") for n in ("plain", "watertight")})  # fmt: skip
        for bad in ({"methods": ["no-such"]}, {"kinds": ["no-such"]}, {"numeric": "no-such"}, {"repeats": 0}):
            with self.subTest(bad), self.assertRaisesRegex(ValueError, "no-such|repeats"):
                ballot.bench(scene, **{"size": (8, 8), **bad})


if __name__ == "__main__":
    unittest.main()
