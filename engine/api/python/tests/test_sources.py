"""Rays and points as they lie in memory: any stride, float32 and float64, broadcast. Answers are bit for bit those to
the same questions as packed float32, and nothing as large as the questions is allocated for them."""

import tracemalloc
import unittest

import ballot
import numpy as np
import reference as ref

INF, NAN = np.inf, np.nan


def layouts(array):
    """Yields the numbers of an array (n, w) as they may lie in memory."""
    n, w = array.shape
    yield "packed", array
    yield "Fortran's order", np.asfortranarray(array)
    yield "backwards", array[::-1].copy()[::-1]
    yield "numbers backwards", array[:, ::-1].copy()[:, ::-1]
    wide = np.full((2 * n, w + 3), 7, array.dtype)
    wide[::2, 1 : w + 1] = array
    yield "apart", wide[::2, 1 : w + 1]
    yield "at an odd address", ref.at_odd_address(array)
    records = np.zeros(n, [("flag", "u1"), ("at", array.dtype, w), ("ring", "u2")])
    records["at"] = array
    yield "packed with others", records["at"]
    read_only = array.copy()
    read_only.flags.writeable = False
    yield "read-only", read_only


class Rays(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = ballot.Scene(*ref.soup(200))
        six = ref.random_rays(600).astype(np.float64) * (1 + 1e-9)
        six[5, 1], six[6, 3], six[7, 0], six[8, 5] = NAN, 1e300, -INF, -1e300
        cls.low = np.random.default_rng(5).uniform(-0.5, 0.8, 600)
        cls.high = np.random.default_rng(6).uniform(0.5, 1.5, 600)
        cls.low[9:13], cls.high[13:18] = (NAN, 1e300, -INF, 2), (NAN, 1e300, -1e300, INF, -1)
        cls.eight = np.concatenate([six[:, :3], cls.low[:, None], six[:, 3:], cls.high[:, None]], axis=1)
        cls.six = six

    def full(self, first, low=0, high=INF):
        """Returns rays as packed float32 (..., 8)."""
        full = np.empty((*first.shape[:-1], 8), np.float32)
        with np.errstate(over="ignore"):
            full[..., :3], full[..., 4:7], full[..., 3], full[..., 7] = first[..., :3], first[..., 3:], low, high
        return full

    def same(self, expected, *rays, **given):
        """Compares all calls with those of packed rays."""
        scene = self.scene
        np.testing.assert_array_equal(scene.trace(*rays, **given), scene.trace(expected))
        np.testing.assert_array_equal(scene.submit(*rays, **given).wait(), scene.trace(expected))
        np.testing.assert_array_equal(scene.occluded(*rays, **given), scene.occluded(expected))
        np.testing.assert_array_equal(scene.count_crossings(*rays, **given), scene.count_crossings(expected))
        for one, other in zip(scene.crossings(*rays, **given), scene.crossings(expected)):
            np.testing.assert_array_equal(one, other)
        found, truth = scene.trace_columns(*rays, **given), scene.trace_columns(expected)
        for name, column in found.items():
            np.testing.assert_array_equal(column, truth[name], name)

    def test_layouts_of_rays(self):
        for dtype in (np.float32, np.float64):
            with np.errstate(over="ignore"):
                six, eight = self.six.astype(dtype), self.eight.astype(dtype)
            for (name, s), (_, e) in zip(layouts(six), layouts(eight)):
                with self.subTest(name, dtype=dtype):
                    self.same(self.full(six), s)
                    self.same(self.full(six, 0.25, 1.125), s, t=(0.25, 1.125))
                    self.same(self.full(np.delete(eight, [3, 7], 1), eight[:, 3], eight[:, 7]), e)

    def test_layouts_of_columns(self):
        o, d = self.six[:, :3], self.six[:, 3:]
        for dtype in (np.float32, np.float64):
            with np.errstate(over="ignore"):
                origins, directions = o.astype(dtype), d.astype(dtype)
            for (name, one), (_, other) in zip(layouts(origins), reversed(list(layouts(directions)))):
                with self.subTest(name, dtype=dtype):
                    self.same(self.full(self.six), origins=one, directions=other)
                    t = (None, self.high)
                    self.same(self.full(self.six, 0, self.high), origins=one, directions=other.astype(np.float64), t=t)

    def test_ranges(self):
        with np.errstate(over="ignore"):
            single = self.low.astype(np.float32)
        for low in (None, 0.25, self.low, single[::-1].copy()[::-1], np.float32([0.25])):
            for high in (None, 1.25, self.high, np.broadcast_to(np.float64(1.25), 600), np.full((1, 600), 1.25)):
                bounds = [0 if low is None else low, INF if high is None else high]
                with np.errstate(over="ignore"):
                    self.same(self.full(self.six, *bounds), self.six, t=(low, high))
        # A finite bound stays finite: a float64 t_min below float32's range still is a t_min.
        low, high = np.full(2, -1e300), np.full(2, 1e300)
        expected = self.full(self.six[:2], -3e38, 3e38)
        np.testing.assert_array_equal(self.scene.trace(self.six[:2], t=(low, high)), self.scene.trace(expected))
        self.assertTrue((self.scene.trace(self.six[:2], t=(low, high))["prim"] != ref.MISS).any())
        dead = self.scene.trace(self.six[:2], t=(np.float64([-INF, NAN]), None))
        self.assertEqual(dead["prim"].tolist(), [ref.MISS] * 2)
        self.same(self.full(self.six[:3], np.arange(3) / 4), self.six[:3], t=(np.arange(3) / 4, None))
        self.same(self.full(self.six[:3], [0, 0, 1], 2), self.six[:3], t=(np.int16([0, 0, 1]), np.uint8(2)))

    def test_broadcasts(self):
        o, d = self.six[:, :3].astype(np.float32), self.six[:, 3:]
        pairs = [
            (o[40], d), (o, d[40]), (o[:20, None], d[:30]), (o[:20], d[:30, None]), (o[:1], d), (o[40], d[41]),
            (o[:30].reshape(5, 1, 6, 3), d[:24].reshape(1, 4, 6, 3)), (o[:0], d[0]),
            (o.reshape(10, 60, 3)[:, ::3], d.reshape(10, 60, 3)[::-1, ::3]), (o[40].tolist(), d.tolist()),
            (np.broadcast_to(o[:5, None], (5, 7, 3)), np.broadcast_to(d[:7], (5, 7, 3))),
            (np.broadcast_to(o[:, :1], (600, 3)), d),
            (o[40:42].reshape(2, *[1] * 9, 3), d[:4].reshape(2, *[1] * 8, 2, 3)),
        ]  # fmt: skip
        for origins, directions in pairs:
            with np.errstate(over="ignore"):
                parts = np.broadcast_arrays(*(np.asarray(part, np.float32) for part in (origins, directions)))
            with self.subTest(shape=parts[0].shape):
                rays = np.concatenate(parts, axis=-1)
                self.same(self.full(rays, 0, 1.25), origins=origins, directions=directions, t=(0, 1.25))
                reach = np.random.default_rng(7).uniform(0.5, 1.5, rays.shape[:-1][-1:])
                self.same(self.full(rays, 0, reach), origins=origins, directions=directions, t=(None, reach))

    def test_rows_of_one_origin(self):
        y, x = np.meshgrid(np.linspace(-0.4, 0.4, 70), np.linspace(-0.4, 0.4, 90), indexing="ij")
        directions = np.stack([x, y, np.full_like(x, -1)], axis=-1)
        rays = np.concatenate([np.broadcast_to(np.float64([0, 0, 3]), directions.shape), directions], axis=-1)
        self.same(self.full(rays, 0, 9), origins=(0, 0, 3), directions=directions, t=(0, 9))
        self.same(self.full(rays[:, ::2], 0, 9), rays[:, ::2], t=(0, 9))

    def test_nothing_is_copied(self):
        n = 400_000
        rays = np.zeros((n, 6))
        rays[:, 2], rays[:, 5] = 3, -1
        single, out, hits = rays.astype(np.float32), np.empty(n, bool), np.empty(n, ballot.HIT)
        fortran = np.asfortranarray(single)
        ends = np.full(n, 2.5)
        points, directions = single[:, :3], rays[:, 3:]
        room = {"distances": np.empty(n, np.float32)}
        calls = [
            lambda: self.scene.occluded(single, t=(0, 2), out=out),
            lambda: self.scene.occluded(rays, t=(0, ends), out=out),
            lambda: self.scene.trace(single[::-1], t=(ends, np.inf), out=hits),
            lambda: self.scene.trace(fortran, out=hits),
            lambda: self.scene.trace(origins=(0, 0, 3), directions=directions, out=hits),
            lambda: self.scene.trace(origins=points, directions=(0, 0, -1), t=(0, 2), out=hits),
            lambda: self.scene.trace(
                origins=points[:1000, None], directions=directions[:400], out=hits.reshape(1000, 400)
            ),
            lambda: self.scene.nearest(rays[:, :3], ("distances",), out=room, limit=ends),
            lambda: self.scene.nearest(np.broadcast_to(rays[:1, :3], (n, 3)), ("distances",), out=room),
        ]
        for number, call in enumerate(calls):
            call()
            tracemalloc.start()
            try:
                call()
                peak = tracemalloc.get_traced_memory()[1]
            finally:
                tracemalloc.stop()
            self.assertLess(peak, n // 4, number)

    def refused(self, error, text, *rays, **given):
        out = np.full(4, 7, np.uint8).repeat(16).view(ballot.HIT)
        before = out.copy()
        for call in (self.scene.trace, self.scene.submit, self.scene.occluded, self.scene.count_crossings):
            more = {"out": out} if call in (self.scene.trace, self.scene.submit) else {}
            with self.assertRaisesRegex(error, text) as caught:
                call(*rays, **given, **more)
            self.assertNotIn("\n", str(caught.exception))
        np.testing.assert_array_equal(out, before)

    def test_bad_input(self):
        o, d = np.zeros((4, 3), np.float32), np.ones((4, 3))
        self.refused(TypeError, "rays: found beside origins and directions", self.six[:4], origins=o, directions=d)
        self.refused(TypeError, "rays: found beside origins and directions", self.six[:4], origins=o)
        self.refused(TypeError, "directions: found None beside origins; expected both", origins=o)
        self.refused(TypeError, "origins: found None beside directions; expected both", directions=d)
        self.refused(TypeError, "rays: found NoneType")
        self.refused(ValueError, r"shapes are \(4, 3\) and \(3, 3\); expected axes", origins=o, directions=d[:3])
        self.refused(ValueError, r"origins: shape is \(4, 2\); expected \(\.\.\., 3\)", origins=o[:, :2], directions=d)
        self.refused(ValueError, r"directions: shape is \(\)", origins=o, directions=np.float32(1))
        self.refused(TypeError, "directions: dtype is int64; expected float32", origins=o, directions=d.astype(int))
        self.refused(TypeError, "origins: dtype is float16", origins=o.astype(np.float16), directions=d)
        self.refused(TypeError, "origins: found str", origins="here", directions=d)
        self.refused(ValueError, r"t: shapes \(3,\) and \(\)", origins=o, directions=d, t=(np.zeros(3), 1))
        self.refused(ValueError, r"t: shapes \(\) and \(2, 4\)", origins=o, directions=d, t=(0, np.zeros((2, 4))))
        self.refused(ValueError, "t is ", origins=o, directions=d, t=(2, 1))

    def test_overlaps(self):
        room = np.zeros((4, 16), np.float32)
        out = room[:2].reshape(-1)[:16].reshape(4, 4)
        o, d = np.zeros((4, 3), np.float32), np.ones((4, 3), np.float32)
        text = "out: it overlaps the rays; expected memory of its own"
        for given in (
            {"origins": room[:, :3], "directions": d}, {"origins": o, "directions": room[:, 3:6]},
            {"origins": room[0, :3], "directions": d}, {"origins": o, "directions": d, "t": (room[:, 0], None)},
            {"origins": o, "directions": d, "t": (0, room[:, 0])},
        ):  # fmt: skip
            for call in (self.scene.trace, self.scene.submit):
                with self.assertRaisesRegex(ValueError, text):
                    call(**given, out=out)
        self.assertEqual(np.count_nonzero(room), 0)


class Points(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        cls.points = np.random.default_rng(3).uniform(-3, 3, (300, 3))
        cls.points[4, 1], cls.points[5, 0] = 1e300, NAN
        with np.errstate(over="ignore"):
            cls.packed = cls.points.astype(np.float32)
        cls.columns = ("distances", "points", "prims", "inside", "signed_distances")

    def same(self, points, expected, **given):
        found = self.scene.nearest(points, self.columns, **given)
        truth = self.scene.nearest(expected, self.columns, **given)
        for name in self.columns:
            np.testing.assert_array_equal(found[name], truth[name], name)

    def test_layouts(self):
        for dtype in (np.float32, np.float64):
            with np.errstate(over="ignore"):
                points = self.points.astype(dtype)
            for name, laid in layouts(points):
                with self.subTest(name, dtype=dtype):
                    self.same(laid, self.packed)
                    self.same(laid, self.packed, limit=0.5, numeric="exact")
        self.same(self.points.reshape(10, 30, 3)[:, ::2], self.packed.reshape(10, 30, 3)[:, ::2].copy())
        self.same(np.broadcast_to(self.points[0], (4, 5, 3)), np.tile(self.packed[0], (4, 5, 1)))

    def test_limits_of_each(self):
        limits = np.random.default_rng(4).uniform(0.1, 2, 300)
        limits[7:12] = (-1, NAN, INF, 1e300, 0)
        whole = self.scene.nearest(self.packed, ("distances", "prims"))
        with np.errstate(over="ignore"):
            single = limits.astype(np.float32)
        for given in (limits, single[::-1].copy()[::-1], limits.tolist()):
            got = self.scene.nearest(self.points, ("distances", "prims"), limit=given)
            near = whole["distances"] <= single
            np.testing.assert_array_equal(got["distances"], np.where(near, whole["distances"], INF))
            self.assertEqual(got["prims"][7:9].tolist(), [ref.MISS] * 2)
        grid = self.packed.reshape(10, 30, 3)
        got = self.scene.nearest(grid, ("distances",), limit=np.float32([[0.5]] * 10))["distances"]
        np.testing.assert_array_equal(got, self.scene.nearest(grid, ("distances",), limit=0.5)["distances"])

    def test_bad_limits(self):
        for error, text, limit in (
            (ValueError, r"limit: shape is \(3,\); expected a number, or an array of \(300,\)", np.ones(3)),
            (ValueError, r"limit: shape is \(2, 300\)", np.ones((2, 300))),
            (TypeError, "limit: found", np.array(["a"] * 300)),
            (TypeError, "limit: found", "a"),
        ):
            with self.assertRaisesRegex(error, text):
                self.scene.nearest(self.packed, limit=limit)
        out = np.zeros(300, np.float32)
        with self.assertRaisesRegex(ValueError, "overlaps"):
            self.scene.nearest(self.packed, ("distances",), limit=out, out={"distances": out})


if __name__ == "__main__":
    unittest.main()
