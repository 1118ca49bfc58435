"""float64 that float32 cannot hold: a warning at every door, with the figure and what to subtract."""

import os
import tempfile
import types
import unittest
import warnings

import ballot
import numpy as np
import reference as ref

FAR = 2.0**22  # float32 is 0.5 apart there
PLACE = np.array([FAR, 0, 0])
INEXACT = ref.CUBE_VERTICES.astype(np.float64) + PLACE
INEXACT[5, 0] += 0.125  # the vertex that is moved: by 0.125 of 2.125


class Precision(unittest.TestCase):
    def test_every_door_warns(self):
        cube, faces = ref.CUBE_VERTICES, ref.CUBE_TRIANGLES
        moved = ballot.Scene(cube, faces)
        place = np.eye(4)
        place[0, 3] = FAR + 0.125
        placed = ballot.Scene(cube, faces, instances=np.eye(4)[None])
        mesh = types.SimpleNamespace(vertices=INEXACT, faces=faces)
        text = "vertex 5 by 0.125, which is 5.9e-02 of .* size of 2.125 .*subtract its middle .4194304.06, 0, 0."
        for name, expected, call in (
            ("Scene", "^mesh: vertices: float32 moves " + text, lambda: ballot.Scene(INEXACT, faces)),
            ("lists", text, lambda: ballot.Scene(INEXACT.tolist(), faces.tolist())),
            ("corners", "moves vertex 7 by 0.125", lambda: ballot.Scene(INEXACT[faces])),
            (
                "meshes",
                "^mesh 1: vertices: float32 moves " + text,
                lambda: ballot.Scene(meshes=[(cube, faces), (INEXACT, faces)]),
            ),
            ("a mesh", text, lambda: ballot.Scene(mesh)),
            ("vertices", "^mesh 0: vertices: float32 moves " + text, lambda: moved.set_vertices(0, INEXACT)),
            ("Open3D", text, lambda: ballot.RaycastingScene().add_triangles(INEXACT, faces)),
            ("Open3D, a mesh", text, lambda: ballot.RaycastingScene().add_triangles(mesh)),
            (
                "instances",
                "instances: float32 moves instance 1 by 0.125.*of its size of 2 ",
                lambda: ballot.Scene(cube, faces, instances=np.stack([np.eye(4), place])),
            ),
            ("transforms", "moves instance 0 by 0.125", lambda: placed.set_transforms(place[None])),
        ):
            with self.subTest(name), self.assertWarnsRegex(ballot.PrecisionWarning, expected) as caught:
                call()
            self.assertEqual(caught.filename, __file__)  # the line of the caller

    def test_what_float32_holds_is_no_news(self):
        faces = ref.CUBE_TRIANGLES
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            ballot.Scene(ref.CUBE_VERTICES.astype(np.float64) + PLACE, faces)
            ballot.Scene(INEXACT.astype(np.float32), faces)
            ballot.Scene(ref.CUBE_VERTICES / 3.0 + 5, faces)  # rounded by less than 2^-20 of its size
            ballot.Scene(ref.CUBE_VERTICES * 1e-9 / 3, faces)
            ballot.Scene(*ref.soup(9), instances=np.linalg.inv(np.diag([3.0, 7, 9, 1]) + 0.1)[None])
            ballot.trimesh_ray.RayMeshIntersector((INEXACT, faces)).contains_points(PLACE[None])

    def test_files(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "far.obj")
            for finer, told in ((0.4, True), (0, False)):  # float32 is 0.5 apart there
                with open(path, "w", encoding="ascii") as file:
                    file.write(f"v 500000 {4649776 + finer} 0\nv 500001 4649776 0\nv 500000 4649777 0\nf 1 2 3\n")
                with warnings.catch_warnings(record=True) as caught:
                    warnings.simplefilter("always")
                    ballot.load_scene(path, cache=False)
                self.assertEqual([w.category for w in caught], [ballot.PrecisionWarning] * told)
                self.assertTrue(not told or "by up to 0.25, which is 2.5e-01" in str(caught[0].message))

    def test_the_bound(self):
        """A triangle of size 1 at 16, where float32 is 2^-19 apart: 2^-20 is the most that is not told."""
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            ballot.Scene(np.array([[[16, 0, 0], [17, 0, 0], [16 + 2.0**-20, 1, 0]]]))
        with self.assertWarnsRegex(ballot.PrecisionWarning, "moves vertex 2 by 1.43e-06"):
            ballot.Scene(np.array([[[32, 0, 0], [33, 0, 0], [32 + 1.5 * 2.0**-20, 1, 0]]]))

    def test_not_finite(self):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            for number in (np.nan, np.inf, 1e300):
                bad = INEXACT.copy()
                bad[3, 1] = number
                with self.assertRaisesRegex(ValueError, "vertex 3"):
                    ballot.Scene(bad, ref.CUBE_TRIANGLES)


if __name__ == "__main__":
    unittest.main()
