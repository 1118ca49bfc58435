"""Traces against a search without a tree, and every way in which rays and results are handed over."""

import enum
import unittest

import ballot
import numpy as np
import reference as ref
from ballot import _arrays


class Cube(unittest.TestCase):
    """A cube from -1 to 1, seen by rays that are known."""

    @classmethod
    def setUpClass(cls):
        cls.scene = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        cls.rays = np.float32([[0.25, 0.5, 3, 0, 0, -1], [0.25, 0.5, 0, 0, 0, -2], [5, 5, 5, 0, 0, 1]])
        cls.hits = cls.scene.trace(cls.rays)

    def same(self, hits, expected=None):
        np.testing.assert_array_equal(hits, self.hits if expected is None else expected)

    def test_known_hits(self):
        self.assertEqual(self.hits.dtype, ballot.HIT)
        self.assertEqual(self.hits["t"].tolist(), [2, 0.5, np.inf])
        self.assertIn(self.hits["prim"][0], (2, 3))
        self.assertIn(self.hits["prim"][1], (0, 1))
        self.assertEqual(self.hits["prim"][2], ballot.MISS)
        self.assertEqual((self.hits["u"][2], self.hits["v"][2]), (0, 0))

    def test_large_results_keep_their_memory(self):
        rays = np.tile(self.rays, (60_000, 1))
        first = self.scene.trace(rays)
        part = first["t"][5:8]
        whole = self.scene.trace_columns(rays, ("t",))["t"]
        del first
        other = [self.scene.trace(rays[::-1]) for _ in range(3)]  # may use what was let go of, and nothing else
        self.assertEqual(part.tolist(), self.hits["t"][[2, 0, 1]].tolist())
        np.testing.assert_array_equal(whole[:3], np.float32([2, 0.5, np.inf]))
        for hits in other:
            np.testing.assert_array_equal(hits[:3], self.hits[::-1])

    def same_bits(self, scene: ballot.Scene) -> None:
        rays = ref.random_rays(1 << 15)
        many, points = scene.trace(rays), scene.nearest(rays[:4096, :3])
        for first, count in ((0, 1), (1, 7), (100, 64), (200, 500), (5000, 1024)):
            few = slice(first, first + count)
            self.assertEqual(scene.trace(rays[few]).tobytes(), many[few].tobytes())
            np.testing.assert_array_equal(scene.occluded(rays[few]), many["prim"][few] != ballot.MISS)
            part = slice(first % 1024, first % 1024 + min(count, 64))
            for name, answers in scene.nearest(rays[part, :3]).items():
                self.assertEqual(answers.tobytes(), points[name][part].tobytes())

    def test_few_and_many_find_the_same_bits(self):
        vertices, triangles = ref.soup(2000)
        for builder in ("best", "device"):  # with spatial splits, by the host; where it lies
            scene = ballot.Scene(vertices, triangles, builder=builder)
            self.same_bits(scene)
            ref.move(scene, 0, vertices[::-1].copy())
            self.same_bits(scene)

    def test_shapes(self):
        grid = np.broadcast_to(self.rays[0], (4, 5, 6)).copy()
        self.assertEqual(self.scene.trace(grid).shape, (4, 5))
        self.same(self.scene.trace(grid), np.full((4, 5), self.hits[0]))
        one = self.scene.trace(self.rays[1])
        self.assertEqual(one.shape, ())
        self.assertEqual(one["t"], 0.5)
        self.assertEqual(self.scene.trace(np.empty((0, 6), np.float32)).shape, (0,))
        self.assertEqual(self.scene.occluded(np.empty((3, 0, 8), np.float32)).shape, (3, 0))

    def test_types(self):
        self.same(self.scene.trace(self.rays.astype(np.float64)))
        self.same(self.scene.trace(self.rays.astype(">f4")))
        self.same(self.scene.trace(self.rays.tolist()))
        self.same(self.scene.trace([[int(x) for x in self.rays[2]]]), self.hits[2:])
        records = np.zeros(3, ballot.RAY)
        records["origin"], records["dir"], records["t_max"] = self.rays[:, :3], self.rays[:, 3:], np.inf
        self.same(self.scene.trace(records))
        self.assertEqual(self.scene.trace(records[0])["t"], 2)

    def test_strides(self):
        wide = np.full((3, 11), 7, np.float32)
        wide[:, 2:8] = self.rays
        self.same(self.scene.trace(wide[:, 2:8]))  # rows apart: read in place
        self.same(self.scene.trace(self.rays[::-1]), self.hits[::-1])
        self.same(self.scene.trace(np.asfortranarray(self.rays)))
        self.same(self.scene.trace(np.repeat(self.rays, 2, axis=0)[::2]))
        self.same(self.scene.trace(np.broadcast_to(self.rays[0], (7, 6))), np.full(7, self.hits[0]))
        grid = np.zeros((3, 4, 6), np.float32)
        grid[:, 1] = self.rays
        self.same(self.scene.trace(grid[:, 1]))
        odd = ref.at_odd_address(self.rays)
        self.same(self.scene.trace(odd))
        self.assertTrue(_arrays.rows(odd).flags.aligned)

    def test_bounds(self):
        self.assertEqual(self.scene.trace(self.rays, t=(0, 1.5))["prim"].tolist()[::2], [ballot.MISS] * 2)
        self.assertEqual(self.scene.trace(self.rays[:1], t=(2.5, 100))["t"], 4)
        self.assertEqual(self.scene.trace(self.rays, t=(np.float32([2.5, 0, 0]), np.inf))["t"].tolist()[:2], [4, 0.5])
        full = np.insert(np.insert(self.rays, 3, 0, axis=1), 7, 1.5, axis=1)
        misses = self.scene.trace(full)
        self.assertEqual(misses["t"].tolist(), [np.inf, 0.5, np.inf])
        self.assertEqual(self.scene.occluded(full).tolist(), [False, True, False])

    def test_open_ends(self):
        for t in ((0, None), (None, None), (None, np.inf), (0, 1e300), (0, 10**400)):
            self.same(self.scene.trace(self.rays, t=t))
        self.assertEqual(self.scene.trace(self.rays[:1], t=(2.5, None))["t"], 4)
        self.assertEqual(self.scene.occluded(self.rays, t=(None, 1)).tolist(), [False, True, False])
        self.assertEqual(self.scene.count_crossings(self.rays[:1], t=(2.5, None)).tolist(), [1])
        # In arrays, which have a range for each ray, what is no range is a dead ray.
        ends = np.float32([np.nan, -1, np.inf])
        self.assertEqual(self.scene.trace(self.rays, t=(0, ends))["prim"].tolist(), [ballot.MISS] * 3)
        found = self.scene.trace(self.rays, t=(np.float32([0, 0, np.nan]), None))
        self.assertEqual(found["t"].tolist(), [2, 0.5, np.inf])

    def test_misses_have_one_t(self):
        rays = np.float32([[0, 0, 9, 0, 0, 1], [np.nan, 0, 3, 0, 0, -1], [0, 0, 3, 0, 0, 0]])
        full = np.insert(np.insert(rays, 3, 0, axis=1), 7, 1.5, axis=1)
        there, hits = ballot.Array("rays", 3), ballot.Array("hits", 3)
        there.write(full)
        self.scene.trace(there, out=hits)
        twin = ballot.RaycastingScene()
        twin.add_triangles(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        placed = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES, instances=np.eye(4, dtype=np.float32)[None])
        found = [
            self.scene.trace(full)["t"], self.scene.trace(full, any=True)["t"], self.scene.submit(full).wait()["t"],
            self.scene.trace_columns(full, ("t",))["t"], hits.read()["t"], twin.cast_rays(rays)["t_hit"],
            placed.trace(full)["t"], placed.trace_columns(full, ("t",))["t"],
            *(self.scene.trace(full, numeric=mode)["t"] for mode in ("exact", "plain", "fast")),
        ]  # fmt: skip
        for t in found:
            self.assertEqual(t.tolist(), [np.inf] * 3)

    def test_fortran_order_and_other_bytes(self):
        columns = self.rays[:, [0, 1, 2, 3, 4, 5]]
        for rays in (np.asfortranarray(self.rays), columns, columns.astype(">f4"), columns.astype(">f8")):
            self.same(self.scene.trace(rays))
        cube = ballot.Scene(np.asfortranarray(ref.CUBE_VERTICES), np.asfortranarray(ref.CUBE_TRIANGLES))
        self.assertEqual(cube.trace([[0.25, 0.5, 3, 0, 0, -1]])["t"].tolist(), [2])

    def test_dead_rays_miss(self):
        dead = np.float32([[0, 0, 3, 0, 0, 0], [np.nan, 0, 3, 0, 0, -1], [0, 0, np.inf, 0, 0, -1]])
        self.assertEqual(self.scene.trace(dead)["prim"].tolist(), [ballot.MISS] * 3)
        self.assertEqual(self.scene.trace(dead)["t"].tolist(), [np.inf] * 3)

    def test_out(self):
        out = np.zeros(3, ballot.HIT)
        self.assertIs(self.scene.trace(self.rays, out=out), out)
        self.same(out)
        numbers = np.zeros((3, 4), np.float32)
        self.same(self.scene.trace(self.rays, out=numbers), self.hits)
        self.same(numbers.view(ballot.HIT).reshape(3))
        flags = np.zeros(3, np.uint8)
        self.scene.occluded(self.rays, out=flags)
        self.assertEqual(flags.tolist(), [1, 1, 0])

    def test_columns(self):
        t = np.zeros(3, np.float32)
        got = self.scene.trace_columns(self.rays, ("t", "normals", "uvs", "prims", "mesh_ids"), out={"t": t})
        self.assertIs(got["t"], t)
        self.assertEqual(t.tolist(), [2, 0.5, np.inf])
        self.assertEqual(got["normals"].tolist(), [[0, 0, 1], [0, 0, -1], [0, 0, 0]])
        self.assertEqual(got["mesh_ids"].tolist(), [0, 0, ballot.MISS])
        np.testing.assert_array_equal(got["prims"], self.hits["prim"])
        np.testing.assert_array_equal(got["uvs"], np.stack([self.hits["u"], self.hits["v"]], axis=1))

    def test_background(self):
        job = self.scene.submit(self.rays)
        self.same(job.wait())
        self.assertTrue(job.poll())
        self.assertEqual(job.times.hits, 2)
        out = np.zeros(3, ballot.HIT)
        jobs = [self.scene.submit(self.rays, out=out) for _ in range(20)]
        del jobs  # waits
        self.same(out)
        with self.assertRaisesRegex(ValueError, "no-such"):
            self.scene.submit(self.rays, method="no-such").wait()

    def test_times(self):
        times = []
        self.scene.trace(self.rays, times=times)
        self.assertEqual(times[0].hits, 2)
        self.assertGreater(times[0].seconds, 0)
        self.assertGreater(times[0].device_ms, 0)


class Library:
    """An array of another library, which offers DLPack alone."""

    def __init__(self, array, device=(1, 0)):
        self.array, self.device = array, device

    def __dlpack__(self, **arguments):
        return self.array.__dlpack__(**arguments)

    def __dlpack_device__(self):
        return self.device


class DlPack(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = ballot.Scene(Library(ref.CUBE_VERTICES), Library(ref.CUBE_TRIANGLES))
        cls.rays = ref.random_rays(50)
        cls.hits = cls.scene.trace(cls.rays)

    def test_read_and_written(self):
        out = np.zeros((50, 4), np.float32)
        got = self.scene.trace(Library(self.rays), out=Library(out))
        self.assertTrue(np.shares_memory(got, out))
        np.testing.assert_array_equal(out.view(ballot.HIT)[:, 0], self.hits)

    def test_rays_are_not_copied(self):
        from ballot import _sources

        for given in (self.rays, Library(self.rays), self.rays[::2], self.rays.reshape(5, 10, 6)):
            self.assertTrue(np.shares_memory(_sources.rays(given).first, self.rays), type(given))

    def test_device_named_by_an_enumeration(self):
        class Kind(enum.Enum):
            CPU = 1
            CUDA = 2

        np.testing.assert_array_equal(self.scene.trace(Library(self.rays, (Kind.CPU, 0))), self.hits)
        with self.assertRaisesRegex(TypeError, "CUDA.*ballot.Array"):
            self.scene.trace(Library(self.rays, (Kind.CUDA, 0)))

    def test_on_a_gpu(self):
        with self.assertRaisesRegex(TypeError, "CUDA.*ballot.Array"):
            self.scene.trace(Library(self.rays, (2, 0)))
        with self.assertRaisesRegex(TypeError, "CUDA.*ballot.Array"):
            self.scene.trace(self.rays, out=Library(np.zeros((50, 4), np.float32), (2, 0)))


class Soup(unittest.TestCase):
    """Every method, mode and vote against the search without a tree."""

    @classmethod
    def setUpClass(cls):
        cls.scene = ballot.Scene(*ref.soup(200))
        cls.rays = ref.random_rays(700)
        cls.truth = ref.brute(cls.scene.triangles(), cls.rays)
        cls.sure = cls.truth["margin"] > 1e-5

    def check(self, hits):
        self.assertGreater(self.sure.mean(), 0.95)
        hit = self.sure & (self.truth["prim"] != ref.MISS)
        np.testing.assert_array_equal(hits["prim"][self.sure], self.truth["prim"][self.sure])
        np.testing.assert_allclose(hits["t"][hit], self.truth["t"][hit], rtol=1e-4)
        np.testing.assert_allclose(hits["u"][hit], self.truth["u"][hit], atol=1e-3)
        np.testing.assert_allclose(hits["v"][hit], self.truth["v"][hit], atol=1e-3)

    def test_methods(self):
        for method in ("auto", "packet", "if-if", "while-while", "bvh4", "cut"):
            with self.subTest(method):
                self.check(self.scene.trace(self.rays, method=method))

    def test_modes(self):
        for numeric in ("exact", "plain", "fast"):
            with self.subTest(numeric):
                self.check(self.scene.trace(self.rays, method="while-while", numeric=numeric))

    def test_knobs(self):
        for knobs in ({"vote": "count"}, {"cooperative": True}, {"workgroup": 64}):
            with self.subTest(knobs):
                self.check(self.scene.trace(self.rays, method="packet", knobs=knobs, ray_class="mine"))

    def test_any(self):
        blocked = self.scene.occluded(self.rays, method="while-while")
        self.assertEqual(blocked.dtype, np.bool_)
        np.testing.assert_array_equal(blocked[self.sure], self.truth["prim"][self.sure] != ref.MISS)
        some = self.scene.trace(self.rays, any=True, method="while-while")
        np.testing.assert_array_equal(some["prim"] != ref.MISS, blocked)


if __name__ == "__main__":
    unittest.main()
