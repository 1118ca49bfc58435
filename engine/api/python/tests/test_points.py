"""Queries of points, and of all crossings of rays."""

import unittest

import ballot
import numpy as np
import reference as ref


class Nearest(unittest.TestCase):
    def setUp(self):
        self.scene = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES, ids=5)

    def test_values_and_types(self):
        points = np.float64([[[0, 0, 3], [0, 0.5, 0]], [[np.nan, 0, 0], [3, 3, 1]]])
        names = ("distances", "points", "prims", "mesh_ids", "uvs", "normals", "inside", "signed_distances")
        times = []
        got = self.scene.nearest(points, names, times=times)
        self.assertEqual(
            {k: (a.dtype.name, a.shape) for k, a in got.items()},
            {
                "distances": ("float32", (2, 2)),
                "points": ("float32", (2, 2, 3)),
                "prims": ("uint32", (2, 2)),
                "mesh_ids": ("uint32", (2, 2)),
                "uvs": ("float32", (2, 2, 2)),
                "normals": ("float32", (2, 2, 3)),
                "inside": ("bool", (2, 2)),
                "signed_distances": ("float32", (2, 2)),
            },
        )
        self.assertEqual(got["distances"][0].tolist(), [2, 0.5])
        self.assertEqual(got["signed_distances"][0].tolist(), [2, -0.5])
        self.assertEqual(got["inside"].tolist(), [[False, True], [False, False]])
        self.assertEqual(got["points"][0].tolist(), [[0, 0, 1], [0, 1, 0]])
        self.assertEqual(got["normals"][0, 1].tolist(), [0, 1, 0])
        self.assertEqual(got["distances"][1, 0], np.inf)
        self.assertEqual((got["prims"][1, 0], got["mesh_ids"][1, 1]), (ballot.MISS, 5))
        self.assertAlmostEqual(got["distances"][1, 1], np.sqrt(8), 5)
        self.assertEqual(times[0].hits, 3)

    def test_points_belong_to_their_weights(self):
        vertices, triangles = ref.soup(200)
        scene = ballot.Scene(vertices, triangles)
        points = np.random.default_rng(3).uniform(-2, 2, (5000, 3)).astype(np.float32)
        got = scene.nearest(points)
        u, v = got["uvs"].T.astype(np.float64)
        corners = vertices[triangles[got["prims"]]].astype(np.float64)
        at = corners[:, 0] * (1 - u - v)[:, None] + corners[:, 1] * u[:, None] + corners[:, 2] * v[:, None]
        np.testing.assert_allclose(at, got["points"], atol=1e-4)
        np.testing.assert_allclose(np.linalg.norm(at - points, axis=1), got["distances"], atol=1e-5)
        order = np.random.default_rng(4).permutation(len(points))
        np.testing.assert_array_equal(scene.nearest(points[order])["prims"], got["prims"][order])

    def test_limits_and_out(self):
        out = np.empty(2, np.float32)
        points = np.float32([[0, 0, 3], [0, 0, 2]])
        got = self.scene.nearest(points, ("distances",), limit=1.5, out={"distances": out})
        self.assertIs(got["distances"], out)
        self.assertEqual(out.tolist(), [np.inf, 1])

    def test_signs_by_pseudonormals(self):
        open_cube = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES[1:])
        points = [[0, 0, 0.5], [0, 0, 4], [3, 3, 3]]
        for numeric in ("watertight", "exact"):
            got = open_cube.nearest(points, ("signed_distances", "inside"), sign="pseudonormal", numeric=numeric)
            self.assertEqual(got["inside"].tolist(), [True, False, False])
            self.assertEqual(np.signbit(got["signed_distances"]).tolist(), [True, False, False])
        scene = ballot.RaycastingScene()
        scene.add_triangles(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES[1:])
        got = scene.compute_signed_distance(np.float32(points), sign="pseudonormal")
        self.assertEqual(np.signbit(got).tolist(), [True, False, False])
        self.assertEqual(scene.compute_occupancy(np.float32(points), sign="pseudonormal").tolist(), [1, 0, 0])
        with self.assertRaisesRegex(ValueError, "sign is 'normal'; expected parity, pseudonormal or winding"):
            open_cube.nearest(points, ("inside",), sign="normal")

    def test_bad_input(self):
        points = np.zeros((2, 3), np.float32)
        open_cube = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES[1:])
        for error, text, call in (
            (ValueError, r"points: shape is \(2, 2\)", lambda: self.scene.nearest(points[:, :2])),
            (TypeError, "points: dtype is int64", lambda: self.scene.nearest(points.astype(np.int64))),
            (ValueError, "columns: found 'where'", lambda: self.scene.nearest(points, ("where",))),
            (ValueError, "limit is -1", lambda: self.scene.nearest(points, limit=-1)),
            (ValueError, "limit is nan", lambda: self.scene.nearest(points, limit=np.nan)),
            (ValueError, "3 of its 18 edges.*assume_closed", lambda: open_cube.nearest(points, ("inside",))),
            (ValueError, "first is -1", lambda: self.scene.crossings(np.zeros((1, 6), np.float32), first=-1)),
        ):
            with self.subTest(text), self.assertRaisesRegex(error, text):
                call()
        self.assertEqual(open_cube.nearest(points, ("inside",), assume_closed=True)["inside"].shape, (2,))
        self.assertEqual(self.scene.nearest(points[:0])["distances"].shape, (0,))


class Within(unittest.TestCase):
    def test_lists(self):
        vertices, triangles = ref.soup(300)
        scene, points = ballot.Scene(vertices, triangles), ref.random_rays(50)[:, :3]
        near = scene.nearest(points, ("distances", "prims"))
        lists = scene.within(points, near["distances"] * np.float32(1.5))
        first = lists.hits[lists.offsets[:-1]]
        self.assertTrue((lists.counts >= 1).all())
        np.testing.assert_array_equal(first["t"], near["distances"])
        np.testing.assert_array_equal(first["prim"], near["prims"])
        for begin, end, limit in zip(lists.offsets, lists.offsets[1:], near["distances"] * np.float32(1.5)):
            some = lists.hits[begin:end]
            self.assertTrue((np.diff(some["t"]) >= 0).all() and (some["t"] <= limit).all())
            self.assertEqual(len(set(some["prim"].tolist())), len(some))
        everything = scene.within(points[:2], np.inf)
        self.assertEqual(everything.counts.tolist(), [300, 300])
        self.assertEqual(scene.within(points, [-1.0] * 50).counts.sum(), 0)

    def test_wrong_arguments(self):
        scene = ballot.Scene(*ref.soup(3))
        for radius, error in ((-1, ValueError), (float("nan"), ValueError), (None, TypeError), ("a", TypeError)):
            with self.assertRaisesRegex(error, "limit"):
                scene.within([[0, 0, 0]], radius)
        with self.assertRaisesRegex(ValueError, r"limit: shape is \(2,\)"):
            scene.within([[0, 0, 0]] * 3, [1, 2])


class Crossings(unittest.TestCase):
    def setUp(self):
        self.scene = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        # Through the diagonals of two sides, up to the middle, beside, through two corners, along an edge.
        self.rays = np.float32([
            [-9, 0, 0, 0, 1, 0, 0, 99], [-9, 0.5, 0, 0, 1, 0, 0, 9], [-9, 5, 0, 0, 1, 0, 0, 99],
            [-9, -9, -9, 0, 1, 1, 1, 99], [-9, 1, 1, 0, 1, 0, 0, 99],
        ])  # fmt: skip

    def test_counts_and_lists(self):
        counts = self.scene.count_crossings(self.rays)
        self.assertEqual((counts.dtype, counts[:4].tolist()), (np.int64, [2, 1, 0, 2]))
        self.assertEqual(counts[4] % 2, 0)
        again, hits = self.scene.crossings(self.rays)
        np.testing.assert_array_equal(again, counts)
        self.assertEqual((hits.dtype, hits["t"][:3].tolist()), (ballot.HIT, [8, 10, 8]))
        first, hits = self.scene.crossings(self.rays, first=1)
        self.assertEqual((first[:4].tolist(), len(hits)), ([1, 1, 0, 1], first.sum()))
        with self.assertRaisesRegex(ValueError, "first is 0; expected 1 to 4294967294"):
            self.scene.crossings(self.rays, first=0)
        self.assertEqual(self.scene.count_crossings(np.zeros((0, 6), np.float32)).shape, (0,))

    def test_long_lists(self):
        """A list that lies in memory of its own is that of its pieces."""
        scene, rays = ballot.Scene(*ref.soup(300)), ref.random_rays(30000)
        counts, hits = scene.crossings(rays)
        self.assertGreater(hits.nbytes, 1 << 20)
        self.assertEqual(counts.sum(), len(hits))
        pieces = [scene.crossings(rays[first : first + 1000])[1] for first in range(0, len(rays), 1000)]
        np.testing.assert_array_equal(hits, np.concatenate(pieces))

    def test_against_a_search(self):
        vertices, triangles = ref.soup(120)
        rays = ref.random_rays(400)
        scene = ballot.Scene(vertices, triangles, builder="best", split_budget=4)
        counts, hits = scene.crossings(rays)
        truth, sure = ref.all_hits(vertices[triangles], rays)
        np.testing.assert_array_equal(counts[sure], truth.sum(axis=1)[sure])
        found = np.zeros_like(truth)
        found[np.repeat(np.arange(len(rays)), counts), hits["prim"]] = True
        np.testing.assert_array_equal(found[sure], truth[sure])


class Filters(unittest.TestCase):
    def setUp(self):
        moved = ref.CUBE_VERTICES + np.float32([4, 0, 0])
        self.scene = ballot.Scene(meshes=[(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES), (moved, ref.CUBE_TRIANGLES)])
        self.scene.set_masks([0, 1], [1, 2])
        self.scene.commit()
        self.rays = np.float32([[-9, 0, 0, 1, 0, 0], [-9, 0.25, 0.5, 1, 0, 0]])

    def test_filters(self):
        for numeric in ("watertight", "exact"):
            count = lambda **how: self.scene.count_crossings(self.rays, numeric=numeric, **how).tolist()
            self.assertEqual(count(), [4, 4])
            self.assertEqual(count(cull="back"), [2, 2])
            self.assertEqual(count(masks=[2, 3]), [2, 4])
            counts, hits = self.scene.crossings(
                self.rays, first=1, numeric=numeric, cull="front", masks=[2, 3]
            )
            self.assertEqual((counts.tolist(), hits["t"].tolist()), ([1, 1], [14, 10]))
            inside = self.scene.nearest([[0, 0, 0], [2, 0, 0]], ("inside", "distances"), numeric=numeric)
            self.assertEqual((inside["inside"].tolist(), inside["distances"].tolist()), ([True, False], [1, 1]))

    def test_alpha_of_arrays(self):
        self.assertEqual(self.scene.count_crossings(self.rays, alpha=True).tolist(), [4, 4])
        self.assertEqual(len(self.scene.crossings(self.rays, alpha=True)[1]), 8)

    def test_hits(self):
        """Nearest, any and first hits with filters are the first crossings with them."""
        far = [[-9, 9, 0, 1, 0, 0]]
        rays = np.concatenate([self.rays, far]).astype(np.float32)
        for how in ({"cull": "back"}, {"cull": "front", "masks": 2}, {"masks": [2, 3, 0]}, {"alpha": True}):
            for numeric in ("watertight", "exact")[: 1 if "alpha" in how else 2]:
                lists = self.scene.crossings(rays, numeric=numeric, **how)
                begin = lists.offsets
                self.assertEqual((begin[0], begin[-1]), (0, len(lists.hits)))
                for first in (1, 3, 20):
                    hits = self.scene.trace(rays, first=first, numeric=numeric, **how)
                    self.assertEqual(hits.shape, (3, first))
                    for i, row in enumerate(hits):
                        some = lists.hits[begin[i] : begin[i + 1]][:first]
                        self.assertEqual(row[: len(some)].tobytes(), some.tobytes())
                        self.assertTrue((row["prim"][len(some) :] == ballot.MISS).all())
                        self.assertTrue((row["t"][len(some) :] == np.inf).all())
                nearest = self.scene.trace(rays, numeric=numeric, **how)
                self.assertEqual(nearest.tobytes(), self.scene.trace(rays, first=1, numeric=numeric, **how).tobytes())
                blocked = self.scene.occluded(rays, numeric=numeric, **how)
                self.assertEqual(blocked.tolist(), (lists.counts > 0).tolist())
                columns = self.scene.trace_columns(rays, ("t", "mesh_ids", "uvs"), first=2, numeric=numeric, **how)
                self.assertEqual(columns["uvs"].shape, (3, 2, 2))
                np.testing.assert_array_equal(columns["t"][:, 0], nearest["t"])
                job = self.scene.submit(rays, first=2, numeric=numeric, **how)
                np.testing.assert_array_equal(job.wait()["t"], columns["t"])
        one, each = self.scene.count_crossings(rays, masks=2), self.scene.count_crossings(rays, masks=[2, 2, 2])
        self.assertEqual(one.tolist(), each.tolist())

    def test_options_belong_to_kinds(self):
        for call, text in (
            (lambda: self.scene.trace(self.rays, sign="parity"), "sign: found an argument that is no option of hits"),
            (lambda: self.scene.crossings(self.rays, method="cut"), "method: found"),
            (lambda: self.scene.nearest([[0, 0, 0]], cull="back"), "cull: found"),
        ):
            with self.assertRaisesRegex(TypeError, text):
                call()
        many = np.tile(self.rays[:1], (3000, 1))
        for call, text in (
            (lambda: self.scene.trace(self.rays, cull="back", method="packet"), "method is 'packet', beside"),
            (lambda: self.scene.trace(self.rays, cull="back", numeric="plain"), "numeric is 'plain'; expected"),
            (lambda: self.scene.trace(self.rays, first=2, any=True), "any is 1 and first is set"),
            (lambda: self.scene.trace(many, first=2**32 - 2), "no memory holds|too little|out of memory|allocate"),
            (lambda: ballot.render(self.scene, None, 8, 8, cull="back"), "cull is no option of pictures"),
        ):
            with self.assertRaisesRegex((ValueError, MemoryError), text):
                call()

    def test_wrong_filters(self):
        for how, what in (
            ({"numeric": "plain"}, "numeric is 'plain'"),
            ({"cull": "both"}, "cull is 'both'"),
            ({"masks": [1, 2, 3]}, r"masks: shape is \(3,\)"),
            ({"masks": [1, -1]}, "masks: found int64"),
            ({"masks": [1.5, 2]}, "masks: found float64"),
            ({"numeric": "exact", "alpha": True}, "alpha is 1 and numeric is 'exact'"),
        ):
            with self.assertRaisesRegex(ValueError, what):
                self.scene.count_crossings(self.rays, **how)
        with self.assertRaisesRegex(ValueError, "numeric is 'fast'"):
            self.scene.nearest([[0, 0, 0]], numeric="fast")


class Open3D(unittest.TestCase):
    """Shapes, dtypes and conventions are those of Open3D 0.20."""

    def setUp(self):
        self.scene = ballot.RaycastingScene()
        self.scene.add_triangles(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        self.scene.add_triangles(ref.CUBE_VERTICES + np.float32([4, 0, 0]), ref.CUBE_TRIANGLES)

    def test_points(self):
        points = np.float32([[[0, 0, 3], [4.5, 0, 0]]])
        got = self.scene.compute_closest_points(points)
        self.assertEqual(
            {k: (a.dtype.name, a.shape) for k, a in got.items()},
            {
                "points": ("float32", (1, 2, 3)),
                "geometry_ids": ("uint32", (1, 2)),
                "primitive_ids": ("uint32", (1, 2)),
                "primitive_uvs": ("float32", (1, 2, 2)),
                "primitive_normals": ("float32", (1, 2, 3)),
            },
        )
        self.assertEqual(got["geometry_ids"].tolist(), [[0, 1]])
        self.assertEqual(got["points"].tolist(), [[[0, 0, 1], [5, 0, 0]]])
        for call, dtype, values in (
            (self.scene.compute_distance, np.float32, [[2, 0.5]]),
            (self.scene.compute_signed_distance, np.float32, [[2, -0.5]]),
            (self.scene.compute_occupancy, np.float32, [[0, 1]]),
        ):
            answer = call(points)
            self.assertEqual((answer.dtype, answer.tolist()), (dtype, values))
        self.assertEqual(self.scene.compute_signed_distance(points, nsamples=3).tolist(), [[2, -0.5]])
        with self.assertRaisesRegex(ValueError, "odd number"):
            self.scene.compute_occupancy(points, nsamples=2)
        with self.assertRaisesRegex(ValueError, "query_points: shape"):
            self.scene.compute_distance(points[0, 0])

    def test_intersections(self):
        rays = np.float32([[[-9, 0.25, 0, 1, 0, 0], [0, 9, 0, 1, 0, 0]], [[9, 0.5, 0, -2, 0, 0], [4, 0, 0.5, 0, 0, 1]]])
        counts = self.scene.count_intersections(rays)
        self.assertEqual((counts.dtype, counts.tolist()), (np.int32, [[4, 0], [4, 1]]))
        got = self.scene.list_intersections(rays)
        self.assertEqual(
            {k: (a.dtype.name, a.shape) for k, a in got.items()},
            {
                "ray_splits": ("uint32", (5,)),
                "ray_ids": ("uint32", (9,)),
                "t_hit": ("float32", (9,)),
                "geometry_ids": ("uint32", (9,)),
                "primitive_ids": ("uint32", (9,)),
                "primitive_uvs": ("float32", (9, 2)),
            },
        )
        self.assertEqual(got["ray_splits"].tolist(), [0, 4, 4, 8, 9])
        self.assertEqual(got["ray_ids"].tolist(), [0] * 4 + [2] * 4 + [3])
        self.assertEqual(got["t_hit"].tolist(), [8, 10, 12, 14, 2, 3, 4, 5, 0.5])
        self.assertEqual(got["geometry_ids"].tolist(), [0, 0, 1, 1, 1, 1, 0, 0, 1])
        self.assertLess(got["primitive_ids"].max(), 12)


if __name__ == "__main__":
    unittest.main()
