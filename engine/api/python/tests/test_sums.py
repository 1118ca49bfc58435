"""Sums by what rays end on."""

import unittest

import ballot
import numpy as np
import reference as ref


def summed(entries, weights, found):
    """Returns the sums of whole multiples, as Scene.sums() defines them."""
    rows = found.reshape(len(weights), -1)
    n, most = rows.size, np.abs(weights).max()
    unit = 2.0 ** (max(np.frexp(most)[1] - 1, -126) + int(np.ceil(np.log2(n))) - 61)
    whole = [int(w) for w in np.rint(weights.astype(np.float64) / unit)]
    sums = [0] * (entries + 1)
    for row, weight in zip(rows, whole):
        for k, prim in enumerate(row):
            if prim != ballot.MISS:
                sums[prim] += weight
            elif k == 0:
                sums[entries] += weight
    return np.array([float(s) * unit for s in sums])


class Sums(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = ballot.Scene(meshes=[ref.soup(60), ref.soup(40)])
        cls.rays = ref.random_rays(500)
        random = np.random.default_rng(5)
        cls.weights = (random.normal(size=500) * 2.0 ** random.integers(-40, 40, 500)).astype(np.float32)

    def test_sums_of_the_host(self):
        hits = self.scene.trace(self.rays)["prim"]
        columns = self.scene.trace_columns(self.rays, ("instances", "mesh_ids"))
        expected = {"prim": (100, hits), "instance": (2, columns["instances"]), "mesh": (2, columns["mesh_ids"])}
        for by, (entries, found) in expected.items():
            truth = summed(entries, self.weights, found)
            for rays, weights in ((self.rays, self.weights), (self.rays[::-1], self.weights[::-1].astype(float))):
                times = []
                sums = self.scene.sums(rays, weights, by, times=times)
                self.assertEqual(times[0].hits, (hits != ballot.MISS).sum())
                np.testing.assert_array_equal(sums, truth)
        counts = self.scene.sums(self.rays)
        self.assertEqual((counts.dtype, counts.shape, counts.sum()), (np.float64, (101,), 500))
        np.testing.assert_array_equal(counts[:100], np.bincount(hits[hits != ballot.MISS], minlength=100))
        np.testing.assert_array_equal(self.scene.sums(self.rays, 0.5), counts / 2)
        np.testing.assert_array_equal(self.scene.sums(self.rays.reshape(20, 25, 6), np.ones((20, 1))), counts)
        out = np.empty(101)
        self.assertIs(self.scene.sums(self.rays, out=out), out)
        np.testing.assert_array_equal(out, counts)

    def test_options(self):
        odd = np.arange(500) % 2
        for options in ({"first": 3}, {"cull": "back"}, {"numeric": "exact", "first": 20}, {"masks": odd}):
            found = self.scene.trace(self.rays, **options)["prim"]
            np.testing.assert_array_equal(
                self.scene.sums(self.rays, self.weights, **options), summed(100, self.weights, found)
            )

    def test_sums_on_the_device(self):
        eight = np.zeros((500, 8), np.float32)
        eight[:, :3], eight[:, 4:7], eight[:, 7] = self.rays[:, :3], self.rays[:, 3:], 1e9
        rays, weights, one = ballot.Array("rays", 500), ballot.Array("float32", 500), ballot.Array("float32", 1)
        rays.write(eight)
        weights.write(self.weights)
        one.write([0.3])
        for by in ("prim", "instance", "mesh"):
            for there, here in ((None, None), (weights, self.weights), (one, 0.3)):
                sums = self.scene.sums(rays, there, by)
                self.assertEqual((sums.record, sums.dtype), ("float64", np.float64))
                np.testing.assert_array_equal(sums.read(), self.scene.sums(eight, here, by))
        out = ballot.Array("float64", 101)
        out.write(np.arange(101.0))
        self.assertEqual(out.read()[7], 7)
        self.assertIs(self.scene.sums(rays, weights, out=out, count=400, first=2), out)
        np.testing.assert_array_equal(out.read(), self.scene.sums(eight[:400], self.weights[:400], first=2))
        with self.assertRaisesRegex(TypeError, "weights: found ndarray; expected a ballot.Array of float32"):
            self.scene.sums(rays, self.weights)
        with self.assertRaisesRegex(TypeError, "out: found ndarray"):
            self.scene.sums(rays, out=np.empty(101))
        with self.assertRaisesRegex(ValueError, "prim_sums has 100 entries; expected 101"):
            self.scene.sums(rays, out=ballot.Array("float64", 100))
        weights.write([np.nan], first=3)
        with self.assertRaisesRegex(ValueError, "weights: number 3 is nan"):
            self.scene.sums(rays, weights)

    def test_bad_input(self):
        for error, text, arguments in (
            (ValueError, "weight of ray 7 is inf", {"weights": np.where(np.arange(500) == 7, np.inf, 1)}),
            (ValueError, r"weights: shape is \(3,\)", {"weights": [1, 2, 3]}),
            (TypeError, "weights: found", {"weights": "heavy"}),
            (ValueError, "by is 'ray'; expected one of prim, instance, mesh", {"by": "ray"}),
            (TypeError, "out: dtype is float32", {"out": np.empty(101, np.float32)}),
            (ValueError, r"out: shape is \(100,\)", {"out": np.empty(100)}),
            (TypeError, "count: it is for", {"count": 3}),
        ):
            with self.subTest(text), self.assertRaisesRegex(error, text):
                self.scene.sums(self.rays, **arguments)


if __name__ == "__main__":
    unittest.main()
