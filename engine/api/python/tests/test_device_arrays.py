"""Arrays on the device."""

import os
import pickle
import unittest

import ballot
import numpy as np
import reference as ref


class Arrays(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = ballot.Scene(*ref.soup(100))
        cls.rays = np.zeros((500, 8), np.float32)
        six = ref.random_rays(500)
        cls.rays[:, :3], cls.rays[:, 4:7], cls.rays[:, 7] = six[:, :3], six[:, 3:], 100
        cls.hits = cls.scene.trace(cls.rays)

    def pair(self, **arguments):
        return ballot.Array("rays", 500, **arguments), ballot.Array("hits", 500, **arguments)

    def test_trace(self):
        rays, hits = self.pair()
        rays.write(self.rays)
        times = []
        self.assertIs(self.scene.trace(rays, out=hits, times=times), hits)
        self.assertGreater(times[0].device_ms, 0)
        self.assertEqual(times[0].hits, 0)
        np.testing.assert_array_equal(self.scene.trace(rays).read(), self.hits)
        np.testing.assert_array_equal(hits.read(), self.hits)
        np.testing.assert_array_equal(rays.read(), self.rays)
        rays.write(self.rays[100:200], first=300)
        self.scene.trace(rays, count=400, out=hits, any=False, method="while-while")
        np.testing.assert_array_equal(hits.read(first=300, count=100), self.hits[100:200])
        out = np.zeros(7, ballot.HIT)
        self.assertIs(hits.read(out, first=2), out)
        np.testing.assert_array_equal(out, self.hits[2:9])
        hits.write(self.hits[:3], first=497)
        np.testing.assert_array_equal(hits.read(first=497), self.hits[:3])

    def test_transforms(self):
        v, t = ref.soup(40)
        first, then = np.zeros((2, 1200, 3, 4), np.float32)
        first[:, [0, 1, 2], [0, 1, 2]] = 1
        first[:, 0, 3] = np.arange(1200)
        then[:] = first
        then[:, 2, 3] = 7
        here, there = (ballot.Scene(v, t, instances=first) for _ in range(2))
        array = ballot.Array("transforms", 1200)
        array.write(then.reshape(-1, 12))
        np.testing.assert_array_equal(array.read().reshape(-1, 3, 4), then)
        there.set_transforms(array)
        there.commit()
        here.set_transforms(then)
        here.commit()
        rays = ref.random_rays(500)
        np.testing.assert_array_equal(here.trace(rays), there.trace(rays))
        np.testing.assert_array_equal(there.instances[9].transform, then[9])
        again = pickle.loads(pickle.dumps(there))
        np.testing.assert_array_equal(here.trace(rays), again.trace(rays))
        with self.assertRaisesRegex(TypeError, "expected None"):
            there.set_transforms(array, [1])
        there.set_transforms(array)
        with self.assertRaisesRegex(ValueError, "commit that before"):
            there.set_masks([1], [1])

    def test_columns(self):
        """Columns on the device have the bits of those on the host, and the types that others see."""
        v, t = ref.soup(60)
        meshes = [(v, t), (ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)]
        places = np.tile(np.eye(4, dtype=np.float32)[:3], (3, 1, 1))
        places[1, :, 3], places[2, 0, :2] = (1, 0.5, 0), (0.5, 0.3)
        placed = ballot.Scene(meshes=meshes, instances=places, instance_meshes=[0, 1, 1])
        scenes = [self.scene, ballot.Scene(meshes=meshes), placed]
        rays, points = ballot.Array("rays", 500), ballot.Array("points", 500)
        rays.write(self.rays)
        points.write(self.rays[:, :3])
        columns = ("t", "prims", "mesh_ids", "uvs", "normals", "occluded", "instances")
        near = ("distances", "points", "prims", "mesh_ids", "uvs", "normals")
        for number, scene in enumerate(scenes):
            with self.subTest(number=number):
                pairs = [
                    (scene.trace_columns(self.rays, columns), scene.trace_columns(rays, columns)),
                    (scene.nearest(self.rays[:, :3], near), scene.nearest(points, near)),
                    ({"occluded": scene.occluded(self.rays)}, {"occluded": scene.occluded(rays)}),
                ]
                for want, found in pairs:
                    self.assertEqual(list(want), list(found))
                    for name, array in found.items():
                        self.assertEqual((array.shape, array.device), (want[name].shape, rays.device))
                        self.assertEqual(array.read().tobytes(), want[name].tobytes(), name)
        there = scenes[0].trace_columns(rays, ("hits", *columns))
        np.testing.assert_array_equal(there["hits"].read(), self.hits)
        dtypes = [there[name].dtype for name in columns]
        self.assertEqual(dtypes, [np.float32, np.uint32, np.uint32, np.float32, np.float32, np.uint8, np.uint32])
        if rays.device.info.is_cpu:
            self.assertEqual(np.from_dlpack(there["uvs"]).shape, (500, 2))
            self.assertEqual(np.from_dlpack(there["occluded"]).dtype, np.uint8)
        words = ballot.Array("uint32", 600)
        words.write(np.full(600, 9))
        self.assertIs(scenes[0].occluded(rays, out=words, count=499), words)
        np.testing.assert_array_equal(words.read()[:499], scenes[0].occluded(self.rays)[:499])
        self.assertTrue((words.read()[499:] == 9).all())

    def test_lists(self):
        """Lists, counts and hits alone of arrays are those of arrays of the host."""
        rays, masks, one = ballot.Array("rays", 500), ballot.Array("uint32", 500), ballot.Array("uint32", 1)
        rays.write(self.rays)
        words = np.arange(500, dtype=np.uint32) % 3
        masks.write(words)
        one.write(np.uint32([2]))
        for given, here in ((None, None), (masks, words), (one, 2)):
            for options in ({}, {"first": 2, "cull": "back"}, {"numeric": "exact", "first": 20}):
                counts, hits, offsets = self.scene.crossings(rays, masks=given, **options)
                want = self.scene.crossings(self.rays, masks=here, **options)
                self.assertEqual(offsets.dtype, np.int64)
                np.testing.assert_array_equal(counts.read(), want.counts)
                np.testing.assert_array_equal(offsets.read(), want.offsets)
                np.testing.assert_array_equal(hits.read(), want.hits)
            for options in ({"first": 3}, {"cull": "back"}, {"any": True, "alpha": True}):
                there = self.scene.trace(rays, masks=given, **options)
                want = self.scene.trace(self.rays, masks=here, **options)
                np.testing.assert_array_equal(there.read(), want.reshape(-1))
                columns = self.scene.trace_columns(rays, ("t", "uvs"), masks=given, **options)
                np.testing.assert_array_equal(columns["t"].read(), want["t"].reshape(-1))
        np.testing.assert_array_equal(self.scene.count_crossings(rays).read(), self.scene.count_crossings(self.rays))
        points = ballot.Array("points", 500)
        points.write(np.c_[self.rays[:, :3] * 0.2, np.full(500, 0.3, np.float32)])
        counts, hits, offsets = self.scene.within(points)
        want = self.scene.within(self.rays[:, :3] * 0.2, 0.3)
        np.testing.assert_array_equal(counts.read(), want.counts)
        np.testing.assert_array_equal(offsets.read(), want.offsets)
        np.testing.assert_array_equal(hits.read(), want.hits)
        found = ballot.Array("hits", 500)
        found.write(self.hits)
        alone, numbers, number = self.scene.compact(found)
        met = np.flatnonzero(self.hits["prim"] != ballot.MISS)
        self.assertEqual(number, len(met))
        np.testing.assert_array_equal(numbers.read(count=number), met)
        np.testing.assert_array_equal(alone.read(count=number), self.hits[met])
        rays.write(np.zeros((500, 8), np.float32))
        self.assertIsNone(self.scene.crossings(rays).hits)
        with self.assertRaisesRegex(TypeError, "masks: found list"):
            self.scene.crossings(rays, masks=[1])
        with self.assertRaisesRegex(TypeError, "radius: found beside"):
            self.scene.within(points, 2)
        with self.assertRaisesRegex(ValueError, "masks has 10 records"):
            self.scene.crossings(rays, masks=ballot.Array("uint32", 10))

    def test_masks_of_points(self):
        points, masks = ballot.Array("points", 500), ballot.Array("uint32", 500)
        at = self.rays[:, :3] * 0.2
        points.write(at)
        words = np.arange(500, dtype=np.uint32) % 3
        masks.write(words)
        for numeric in ("watertight", "exact"):
            there = self.scene.nearest(points, ("distances", "prims"), masks=masks, numeric=numeric)
            want = self.scene.nearest(at, ("distances", "prims"), masks=words, numeric=numeric)
            for name, column in want.items():
                np.testing.assert_array_equal(there[name].read(), column)
        counts = self.scene.within(points, masks=masks).counts
        np.testing.assert_array_equal(counts.read(), np.where(words == 0, 0, 100))
        with self.assertRaisesRegex(ValueError, "found masks beside signed_distances"):
            self.scene.nearest(points, ("signed_distances",), masks=masks, assume_closed=True)

    def test_vertices(self):
        """A commit from an array on the device gives the scene that one from the host gives, also pickled."""
        for size in (100, 70000):  # trees of the host, and perhaps of the device
            v, t = ref.soup(size)
            for builder in ("device", "balanced"):
                here, there = (ballot.Scene(v, t, builder=builder) for _ in range(2))
                array = ballot.Array("vertices", len(v) + 5)
                for step in range(3):
                    moved = (v + np.float32(0.01 * step) * v[::-1]).astype(np.float32)
                    here.set_vertices(0, moved)
                    here.commit()
                    array.write(np.pad(moved, ((0, 5), (0, 0))))
                    there.set_vertices(0, array)
                    there.commit()
                    want = here.trace(self.rays)
                    self.assertEqual(there.trace(self.rays).tobytes(), want.tobytes())
                np.testing.assert_array_equal(there.triangles(), here.triangles())
                again = pickle.loads(pickle.dumps(there)) if size == 100 else there
                self.assertEqual(again.trace(self.rays, numeric="exact").tobytes(),
                                 here.trace(self.rays, numeric="exact").tobytes())  # fmt: skip
                array.write(np.full((1, 3), np.nan, np.float32), first=7)
                there.set_vertices(0, array)
                with self.assertRaisesRegex(ValueError, "mesh 0: vertex 7"):
                    there.commit()
                self.assertEqual(there.trace(self.rays).tobytes(), want.tobytes())
        with self.assertRaisesRegex(ValueError, "the buffer of vertices holds other records"):
            there.set_vertices(0, ballot.Array("distances", len(v)))
        with self.assertRaisesRegex(ValueError, "mesh 0: "):
            there.set_vertices(0, ballot.Array("vertices", len(v) - 1))

    def test_points(self):
        cube = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        points = np.random.default_rng(5).uniform(-2, 2, (400, 3)).astype(np.float32)
        given = ballot.Array("points", 400)
        given.write(points)
        self.assertTrue(np.isinf(given.read()[:, 3]).all())
        answers = {name: ballot.Array(name, 400) for name in ("nearest", "distances", "inside")}
        for sign in ("parity", "pseudonormal"):
            want = cube.nearest(points, ("points", "distances", "prims", "signed_distances", "inside"), sign=sign)
            out = {"nearest": answers["nearest"], "signed_distances": answers["distances"], "inside": answers["inside"]}
            times = []
            self.assertIs(cube.nearest(given, list(out), out=out, sign=sign, times=times)["inside"], answers["inside"])
            self.assertGreater(times[0].device_ms, 0)
            found = answers["nearest"].read()
            np.testing.assert_array_equal(found[:, :3], want["points"])
            np.testing.assert_array_equal(found[:, 3], want["distances"])
            np.testing.assert_array_equal(found.view(np.uint32)[:, 4], want["prims"])
            np.testing.assert_array_equal(answers["distances"].read(), want["signed_distances"])
            np.testing.assert_array_equal(answers["inside"].read().astype(bool), want["inside"])
        self.assertEqual((answers["inside"].shape, answers["inside"].dtype), ((400,), np.uint32))
        if ballot.default_device().info.is_cpu:
            np.testing.assert_array_equal(np.from_dlpack(answers["distances"]), want["signed_distances"])
            self.assertEqual(np.from_dlpack(answers["inside"]).dtype, np.uint32)
        limited = np.concatenate([points, np.full((400, 1), 0.25, np.float32)], 1)
        given.write(limited)
        cube.nearest(given, ("nearest",), count=300, out={"nearest": answers["nearest"]})
        np.testing.assert_array_equal(
            answers["nearest"].read(count=300)[:, 3], cube.nearest(points[:300], limit=0.25)["distances"]
        )
        open_cube = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES[1:])
        for error, text, call in (
            (ValueError, "other records", lambda: cube.nearest(answers["inside"])),
            (ValueError, "is what is asked", lambda: cube.nearest(given, ("nearest",), out={"nearest": given})),
            (ValueError, "400 records; expected 401", lambda: cube.nearest(given, count=401)),
            (ValueError, "3 of its 18 edges", lambda: open_cube.nearest(given, ("inside",))),
            (ValueError, "sign is 'side'", lambda: cube.nearest(given, ("inside",), sign="side")),
            (ValueError, "columns: found 'hits'", lambda: cube.nearest(given, ("hits",))),
            (TypeError, "limit: found beside points", lambda: cube.nearest(given, limit=1)),
            (TypeError, "count: it is for", lambda: cube.nearest(points, count=3)),
        ):
            with self.subTest(text), self.assertRaisesRegex(error, text):
                call()

    def test_memory_of_the_host(self):
        if not ballot.default_device().info.is_cpu:
            self.skipTest("the default device has memory of its own")
        rays, hits = self.pair()
        np.from_dlpack(rays)  # of older protocols it may be read-only
        rays.numpy()[:] = self.rays
        self.scene.trace(rays, out=hits)
        view = np.from_dlpack(hits)
        self.assertEqual(view.shape, (500, 4))
        hits.close()
        rays.close()
        np.testing.assert_array_equal(view[:, 0], self.hits["t"])  # the view keeps the memory
        self.assertEqual(ballot.Array("hits", 2).__dlpack_device__(), (1, 0))
        self.assertFalse(hasattr(ballot.Array("hits", 2), "__cuda_array_interface__"))

    def test_exported(self):
        if not ballot.default_device().info.exports:
            self.skipTest("the device cannot export memory")
        array = ballot.Array("rays", 100, exported=True)
        fd, size = array.fd()
        os.close(fd)
        self.assertGreaterEqual(size, 3200)
        self.assertEqual((array.shape, len(array), array.record, array.dtype), ((100, 8), 100, "rays", np.float32))
        # No CUDA on a CPU device; memory of its own on a GPU.
        with self.assertRaisesRegex((ballot.Error, ValueError), "CUDA|cuda|export"):
            ballot.Array("rays", 100, exported=False).cuda_address  # noqa: B018
        with self.assertRaisesRegex(ValueError, "exported"):
            ballot.Array("rays", 100, exported=False).fd()

    def test_bad_input(self):
        rays, hits = self.pair()
        with ballot.Device(ballot.default_device().info.name) as other:
            foreign, elsewhere = (ballot.Array(record, 500, device=other) for record in ("hits", "rays"))
        both = dict.fromkeys(("prims", "mesh_ids"), ballot.Array("uint32", 500))
        for error, text, call in (
            (ValueError, "record is 'ray'", lambda: ballot.Array("ray", 3)),
            (ValueError, "count is 0", lambda: ballot.Array("rays", 0)),
            (TypeError, "count: found float", lambda: ballot.Array("rays", 1.5)),
            (ballot.Error, "MiB", lambda: ballot.Array("rays", 2**32 - 1)),
            (TypeError, "count: it is for", lambda: self.scene.trace(self.rays, count=3)),
            (ValueError, "other records", lambda: self.scene.trace(hits)),
            (ValueError, "is what is asked", lambda: self.scene.trace(rays, out=rays)),
            (ValueError, "another device", lambda: self.scene.trace(rays, out=foreign)),
            (ValueError, "another device", lambda: self.scene.trace(elsewhere, out=hits)),
            (ValueError, "500 records; expected 501", lambda: self.scene.trace(rays, out=hits, count=501)),
            (ValueError, "count is -1", lambda: self.scene.trace(rays, count=-1)),
            (ValueError, "no-such", lambda: self.scene.trace(rays, method="no-such")),
            (ValueError, "500 records; expected 1000", lambda: self.scene.trace(rays, first=2, out=hits)),
            (TypeError, "masks: found list", lambda: self.scene.trace(rays, masks=[1])),
            (TypeError, "t: found beside rays", lambda: self.scene.occluded(rays, t=(0, 1))),
            (TypeError, r"out\['hits'\]: found ndarray", lambda: self.scene.trace(rays, out=self.hits)),
            (ValueError, "columns: found 'distances'", lambda: self.scene.trace_columns(rays, ("distances",))),
            (ValueError, "it has 'uvs', which", lambda: self.scene.trace_columns(rays, ("t",), out={"uvs": hits})),
            (ValueError, "expected float32x2", lambda: self.scene.trace_columns(rays, ("uvs",), out={"uvs": hits})),
            (ValueError, "one array is given for", lambda: self.scene.trace_columns(rays, tuple(both), out=both)),
            (ValueError, "no output", lambda: self.scene.trace_columns(rays, ())),
            (ValueError, "found -1 to 3", lambda: ballot.Array("uint8", 2).write([-1, 3])),
            (ValueError, "found 0 to 256; expected 0 to 255", lambda: ballot.Array("uint8", 2).write([0, 256])),
            (ValueError, "500 records from number 1", lambda: rays.write(self.rays, first=1)),
            (ValueError, r"expected \(\.\.\., 8\)", lambda: rays.write(self.rays[:, :6])),
            (ValueError, r"expected \(\.\.\., 4\)", lambda: hits.write(self.rays)),
            (ValueError, "count is 2", lambda: hits.read(first=499, count=2)),
            (TypeError, "dtype", lambda: hits.read(np.zeros((500, 3), np.float32))),
        ):
            with self.subTest(text), self.assertRaisesRegex(error, text):
                call()


if __name__ == "__main__":
    unittest.main()
