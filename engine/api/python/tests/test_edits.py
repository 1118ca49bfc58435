"""Edits of scenes: meshes and instances come, go and move; pickled scenes are the edited ones."""

import os
import pickle
import tempfile
import unittest

import ballot
import numpy as np
import reference as ref

CUBE = (ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
SQUARE = (np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.uint32([[0, 1, 2], [0, 2, 3]]))


def at(x, y, z):
    m = np.eye(3, 4)
    m[:, 3] = x, y, z
    return m


def down(*points):
    return np.float32([[x, y, 50, 0, 0, -1] for x, y in points])


class Edits(unittest.TestCase):
    def answers(self, scene):
        rays = ref.random_rays(500)
        columns = scene.trace_columns(rays, ("t", "prims", "mesh_ids", "instances"))
        return [scene.trace(rays), *columns.values(), scene.count_crossings(rays, masks=np.ones(500, np.uint32))]

    def same(self, a, b):
        for x, y in zip(self.answers(a), self.answers(b)):
            np.testing.assert_array_equal(x, y)
        self.assertEqual([tuple(m) for m in a.meshes], [tuple(m) for m in b.meshes])
        for x, y in zip(a.instances, b.instances):
            self.assertEqual((x.name, x.id, x.mesh, x.instance, x.mask), (y.name, y.id, y.mesh, y.instance, y.mask))
            np.testing.assert_array_equal(x.transform, y.transform)

    def copied(self, scene):
        again = pickle.loads(pickle.dumps(scene))
        self.same(scene, again)
        self.assertEqual(again.add_mesh(*SQUARE), scene.add_mesh(*SQUARE))
        for each in (scene, again):
            each.discard()
        return again

    def test_parts_come_and_go(self):
        rays = down((0.5, 0.25), (5.5, 0.25), (9.5, 0.25))
        for layout in ("auto", "merge", "separate"):
            scene = ballot.Scene(*SQUARE, layout=layout)
            cube = scene.add_mesh(*CUBE, id=40)
            numbers = scene.add_instances([at(5, 0, 0), at(9, 0, 3)], cube)
            self.assertEqual((cube, numbers.tolist(), numbers.dtype), (1, [1, 2], np.uint32))
            self.assertEqual(scene.trace(rays)["t"].tolist(), [50, np.inf, np.inf])  # not committed yet
            scene.commit()
            out = scene.trace_columns(rays, ("t", "mesh_ids", "instances"))
            self.assertEqual([c.tolist() for c in out.values()], [[50, 49, 46], [0, 40, 40], [0, 1, 2]])
            scene.remove_instances(1)
            scene.set_transforms(at(5, 0, 1), 2)
            scene.commit()
            self.assertEqual(scene.trace_columns(rays, ["instances"])["instances"].tolist(), [0, 2, ballot.MISS])
            self.copied(scene)
            scene.replace_mesh(cube, SQUARE[0] + np.float32([0, 0, 4]), SQUARE[1])
            scene.set_vertices(0, SQUARE[0] * 2)
            scene.commit()
            self.assertEqual(scene.trace(rays)["t"].tolist(), [50, 45, np.inf])
            self.copied(scene)
            scene.remove_mesh(0)
            scene.commit()
            self.assertEqual([m.mesh for m in scene.meshes], [cube])
            again = self.copied(self.copied(scene))
            again.remove_mesh(cube)
            again.commit()
            self.assertEqual(again.info.triangles, 0)
            self.copied(again)

    def test_meshes_of_files(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "two.obj")
            with open(path, "w", encoding="ascii") as file:
                file.write("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 0 0\nv 6 0 0\nv 5 1 0\nv 5 1 9\n")
                file.write("g left\nf 1 2 3\ng right\nf 4 5 6\ng up\nf 5 6 7\n")
            rays = down((0.25, 0.25), (5.25, 0.25), (9.25, 0.25))
            scene = ballot.load_scene(path, cache=False)
            self.copied(scene)
            self.assertLess(len(pickle.dumps(scene)), 3000)
            scene.set_transforms([at(4, 0, 1)], [1])
            scene.set_vertices(0, np.float32([[0, 0, 2], [1, 0, 2], [0, 1, 2]]))
            number = scene.add_mesh(*SQUARE)
            scene.add_instances([at(5, 0, 3)], number)
            scene.remove_mesh(2)
            scene.commit()
            self.assertEqual(scene.trace(rays)["t"].tolist(), [48, 47, 49])
            self.assertEqual([m.name for m in scene.meshes], ["left", "right", "mesh 4"])
            again = self.copied(scene)
            again.replace_mesh(1, *SQUARE)
            again.commit()
            self.assertEqual([(m.name, m.id) for m in again.meshes], [("left", 0), ("right", 1), ("mesh 4", 4)])
            self.copied(again)

    def test_arrays_are_read_in_place(self):
        scene = ballot.Scene(*SQUARE)
        vertices = SQUARE[0].copy()
        scene.set_vertices(0, vertices)
        vertices += np.float32([0, 0, 2])
        scene.commit()
        self.assertEqual(scene.trace(down((0.5, 0.25)))["t"].tolist(), [48])

    def test_wrong_edits(self):
        scene = ballot.Scene(*SQUARE)
        for call, what in (
            (lambda: scene.remove_mesh(1), "mesh 1: the scene has no mesh"),
            (lambda: scene.set_vertices(0, SQUARE[0][:3]), "3 vertices, but the mesh was made with 4"),
            (lambda: scene.add_mesh(np.zeros((0, 3)), np.zeros((0, 3), int)), "leave empty meshes out"),
            (lambda: scene.add_instances([at(0, 0, 0)], 3), "mesh 3: the scene has no mesh"),
            (lambda: scene.add_instances([at(0, 0, 0)], [0, 0]), "expected 1 integers"),
            (lambda: scene.add_instances([at(0, 0, 0)], masks=[1, 2]), "masks: found 2; expected 1"),
            (lambda: scene.remove_instances([0, 0]), "instance 0: it is named twice"),
            (lambda: scene.set_transforms([at(0, 0, 0)] * 2), "2 transforms, but the scene has 1"),
            (lambda: scene.set_transforms([at(0, 0, 0)] * 2, [0]), "transforms: found 2; expected 1"),
            (lambda: scene.set_masks([0], [-1]), "masks: number 0 is -1"),
            (lambda: scene.set_masks([1.5], [1]), "instances: number 0 is 1.5"),
        ):
            with self.assertRaisesRegex(ValueError, what):
                call()
        scene.set_vertices(0, np.full_like(SQUARE[0], np.nan))
        with self.assertRaisesRegex(ValueError, "mesh 0: vertex 0 is"):
            scene.commit()
        scene.commit()
        self.assertEqual(scene.trace(down((0.5, 0.25)))["t"].tolist(), [50])
        with self.assertWarnsRegex(ballot.PrecisionWarning, "moves instance 0"):
            scene.set_transforms(at(1e6 + 0.1, 0, 0), 0)


if __name__ == "__main__":
    unittest.main()
