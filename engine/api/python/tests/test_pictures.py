"""Rays of a view, pictures and measurements."""

import io
import os
import pickle
import struct
import tempfile
import unittest
import zlib

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

    def test_picture(self):
        linear = np.float32([[[0, 0.5, 1, 1], [np.nan, -1, np.inf, 0], [0.002, 0.04, 0.2, 1]]])
        picture = ballot.render(self.scene, CAMERA, 3, 1)
        self.assertIsInstance(picture, ballot.Picture)
        self.assertFalse(picture.lit)
        picture[...] = linear
        srgb = [[[0, 188, 255], [0, 0, 255], [7, 56, 124]]]  # IEC 61966-2-1
        self.assertEqual((picture.srgb().dtype, picture.srgb().tolist()), (np.uint8, srgb))
        self.assertEqual(picture.srgb(exposure=1)[0, 0].tolist(), [0, 255, 255])
        self.assertEqual(picture[:, 1:].srgb().tolist(), [srgb[0][1:]])
        self.assertIsInstance(picture[..., 3].max(), np.float32)
        picture[...] = 0.5
        self.assertEqual(picture.srgb("neutral")[0, 0].tolist(), [181] * 3)  # 0.5 - 0.04
        picture[...] = 4.8  # compressed: 1 - 0.24^2 / (4.76 + 0.24 - 0.76) = 0.98642, grey
        self.assertEqual(picture.srgb("neutral")[0, 0].tolist(), [253] * 3)
        for arguments, text in ((("filmic",), "tone is"), (("none", 31), "exposure is 31")):
            with self.assertRaisesRegex(ValueError, text):
                picture.srgb(*arguments)
        with self.assertRaisesRegex(ValueError, r"shape is \(1, 3\)"):
            picture[..., 0].srgb()

    def test_png(self):
        picture = ballot.render(self.scene, CAMERA, 20, 10, shading="path", sky="2,1,0.5", samples=1)
        self.assertTrue(picture.lit and pickle.loads(pickle.dumps(picture)).lit and picture[2:].lit)
        np.testing.assert_array_equal(picture.srgb(), picture.srgb("neutral"))
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.png")
            picture.to_png(path)
            with open(path, "rb") as file:
                written = file.read()
            with self.assertRaises(OSError):
                picture.to_png(os.path.join(folder, "no", "a.png"))
        self.assertEqual(written, picture._repr_png_())
        self.assertIsNone(picture[..., 0]._repr_png_())
        np.testing.assert_array_equal(decoded(written), picture.srgb())

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


def decoded(data):
    """Returns the pixels of an 8-bit PNG without filters, after a check of its chunks."""
    file = io.BytesIO(data)
    assert file.read(8) == b"\x89PNG\r\n\x1a\n"
    chunks = {}
    while head := file.read(8):
        length, name = struct.unpack(">I4s", head)
        chunks[name] = file.read(length)
        assert struct.unpack(">I", file.read(4))[0] == zlib.crc32(name + chunks[name])
    width, height, *rest = struct.unpack(">IIBBBBB", chunks[b"IHDR"])
    assert rest == [8, 2, 0, 0, 0] and list(chunks)[-1] == b"IEND"
    rows = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(height, -1)
    assert (rows[:, 0] == 0).all()
    return rows[:, 1:].reshape(height, width, 3)


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
