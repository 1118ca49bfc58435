"""Scenes: what they are made of, moved, described and pickled."""

import base64
import json
import os
import pathlib
import pickle
import tempfile
import types
import unittest

import ballot
import numpy as np
import reference as ref
from ballot import _load

UP = np.float32([[0.25, 0.3, 5, 0, 0, -1]])


class Scenes(unittest.TestCase):
    def test_info(self):
        scene = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        info = scene.info
        self.assertEqual(
            (info.triangles, info.degenerate, info.meshes, info.lo, info.hi), (12, 0, 1, (-1,) * 3, (1,) * 3)
        )
        self.assertGreater(info.nodes, 0)
        self.assertGreaterEqual(info.build_seconds, 0)
        np.testing.assert_array_equal(scene.triangles(), ref.CUBE_VERTICES[ref.CUBE_TRIANGLES])
        at = (-1,) * 3, (1,) * 3, 0, 0, (0,) * 3
        mesh = ballot.MeshInfo("scene", 0, 0, 12, *at, 0, "triangles", 0, (0, 0), (0, 0))
        self.assertEqual(scene.meshes, [mesh])
        self.assertEqual([(i.mesh, i.instance, i.mask) for i in scene.instances], [(0, 0, 2**32 - 1)])
        self.assertIn("12 triangles", repr(scene))

    def test_meshes_that_are_kept_once(self):
        path = pathlib.Path(__file__).resolve().parents[4] / "scenes" / "dance.gltf"
        kept, copied = (ballot.load_scene(path, cache=False, instances=policy) for policy in ("keep", "copy"))
        self.assertGreater(kept.info.instances, 1)
        self.assertEqual(copied.info.trees, 0)
        np.testing.assert_allclose(_load._world_corners(kept), copied.triangles(), atol=1e-5)
        self.assertEqual([i.name for i in kept.instances], [m.name for m in copied.meshes])
        self.assertEqual(pickle.loads(pickle.dumps(kept)).info.instances, kept.info.instances)
        with self.assertRaisesRegex(ValueError, "animations move it"):
            ref.place(kept, np.stack([i.transform for i in kept.instances]))
        with self.assertRaisesRegex(ValueError, "auto, keep, copy"):
            ballot.load_scene(path, instances="kept")
        with self.assertRaises(TypeError):
            ballot.load_scene(path, instances=3)

    def test_parts_of_files(self):
        points = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
        data = base64.b64encode(points.tobytes()).decode()
        gltf = {
            "asset": {"version": "2.0"},
            "scenes": [{"nodes": [0, 1]}],
            "nodes": [{"name": "left", "mesh": 0}, {"name": "right", "mesh": 0, "translation": [3, 0, 0]}],
            "materials": [{}, {}],
            "meshes": [{"name": "plate", "primitives": [{"attributes": {"POSITION": 0}, "material": 1}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "buffers": [{"byteLength": 36, "uri": f"data:application/octet-stream;base64,{data}"}],
        }
        rays = np.float32([[0.2, 0.2, 2, 0, 0, -1], [3.2, 0.2, 2, 0, 0, -1]])
        columns = ("t", "prims", "mesh_ids", "instances")
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder, "plates.gltf")
            path.write_text(json.dumps(gltf), encoding="ascii")
            for ids, expected in (("mesh", [0, 0]), ("node", [0, 1]), ("material", [1, 1])):
                for policy in ("keep", "copy"):
                    scene = ballot.load_scene(path, cache=False, instances=policy, ids=ids)
                    found = scene.trace_columns(rays, columns)
                    self.assertEqual(found["mesh_ids"].tolist(), expected)
                    self.assertEqual(found["prims"].tolist(), [0, 0])
                    self.assertEqual(found["instances"].tolist(), [0, 1])
            self.assertEqual([m.name for m in scene.meshes], ["left", "right"])
            with self.assertRaisesRegex(ValueError, "mesh, node, material"):
                ballot.load_scene(path, ids="name")
            scene = ballot.load_scene(path, cache=False, instances="keep")
            self.assertEqual([(m.name, m.id, m.first, m.triangles) for m in scene.meshes], [("plate", 0, 0, 1)])
            found = [(i.name, i.id, i.mesh, i.first) for i in scene.instances]
            self.assertEqual(found, [("left", 0, 0, 0), ("right", 1, 0, 1)])
            places = np.stack([i.transform for i in scene.instances]).astype(np.float64)
            places[1, 2, 3] = 0.5
            ref.place(scene, places)
            ref.move(scene, 0, points + np.float32([0, 0, 1]))
            for moved in (scene, pickle.loads(pickle.dumps(scene))):
                self.assertEqual(moved.trace_columns(rays, columns)["t"].tolist(), [1, 0.5])
            self.assertEqual((scene.instances[1].lo, scene.instances[1].hi), ((3, 0, 1.5), (4, 1, 1.5)))
            places[1, 2, 3] = 1e9 + 1 / 3
            with self.assertWarnsRegex(ballot.PrecisionWarning, "moves instance 1"):
                ref.place(scene, places)
            # A mesh that only its instances' last places can hold is pickled all the same.
            gltf["nodes"][1]["scale"] = [100, 100, 100]
            path.write_text(json.dumps(gltf), encoding="ascii")
            scene = ballot.load_scene(path, cache=False, instances="keep")
            with self.assertRaisesRegex(ValueError, "instance 1: the transform moves the mesh"):
                ref.move(scene, 0, points * np.float32(9e11))
            ref.place(scene, np.stack([np.eye(3, 4) * 1e-12, np.eye(3, 4) * 2e-12]))
            ref.move(scene, 0, points * np.float32(9e11))
            again = pickle.loads(pickle.dumps(scene))
            np.testing.assert_array_equal(again.trace(rays), scene.trace(rays))

    def test_animations(self):
        path = pathlib.Path(__file__).resolve().parents[4] / "scenes" / "dance.gltf"
        scene = ballot.load_scene(path, cache=False)
        self.assertEqual([(a.name, a.seconds) for a in scene.animations], [("dance", 4.0), ("nod", 1.0)])
        rest = scene.triangles()
        scene.set_time(1.5)
        moved = scene.triangles()
        self.assertFalse(np.array_equal(moved, rest))
        np.testing.assert_array_equal(pickle.loads(pickle.dumps(scene)).triangles(), moved)
        scene.set_time(0.5, "nod")
        self.assertFalse(np.array_equal(scene.triangles(), moved))
        for seconds, animation, error in ((0, 2, "animation 2"), (0, "run", "dance, nod"), (np.nan, 0, "finite")):
            with self.assertRaisesRegex(ValueError, error):
                scene.set_time(seconds, animation)
        with self.assertRaises(TypeError):
            scene.set_time(0, 1.5)
        self.assertEqual(ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES).animations, [])

    def test_types_of_meshes(self):
        truth = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES).trace(UP)
        v, t = ref.CUBE_VERTICES, ref.CUBE_TRIANGLES
        wide = np.zeros((8, 5), np.float32)
        wide[:, 1:4] = v
        for name, args in {
            "float64 and int64": (v.astype(np.float64), t.astype(np.int64)),
            "uint16": (v, t.astype(np.uint16)),
            "int32": (v, t.astype(np.int32)),
            "lists": (v.tolist(), t.tolist()),
            "strides": (wide[:, 1:4], np.asfortranarray(t)),
            "odd addresses": (ref.at_odd_address(v), ref.at_odd_address(t.astype(np.uint32))),
            "corners of triangles": (v[t], None),
            "trimesh": (types.SimpleNamespace(vertices=v, faces=t),),
            "open3d": (
                types.SimpleNamespace(
                    vertex=types.SimpleNamespace(positions=v), triangle=types.SimpleNamespace(indices=t)
                ),
            ),
        }.items():
            with self.subTest(name):
                np.testing.assert_array_equal(ballot.Scene(*args).trace(UP), truth)

    def test_points_without_triangles(self):
        points = ref.soup(6)[0]
        text = r"shape is \(18, 3\), and there are no triangles; .*\(m, 3, 3\), or soup=True"
        for arguments in ((points,), (points.tolist(),)):
            with self.assertRaisesRegex(ValueError, text):
                ballot.Scene(*arguments)
        with self.assertRaisesRegex(ValueError, "mesh 1: vertices: " + text):
            ballot.Scene(meshes=[ref.soup(2), (points, None)])
        with self.assertRaisesRegex(ValueError, "expected a multiple of 3"):
            ballot.Scene(points[:4], soup=True)
        for scene in (
            ballot.Scene(points, soup=True),
            ballot.Scene(points.reshape(-1, 3, 3)),
            ballot.Scene(points.reshape(-1, 3, 3).tolist()),
            ballot.Scene(meshes=[(points.reshape(-1, 3, 3), None)], normals=[points.reshape(-1, 3, 3)]),
        ):
            np.testing.assert_array_equal(scene.triangles().reshape(-1, 3), points)
            ref.move(scene, 0, 2 * points.reshape(-1, 3, 3))
            np.testing.assert_array_equal(scene.triangles().reshape(-1, 3), 2 * points)
        with self.assertRaisesRegex(ValueError, r"vertices: shape is \(8, 3, 3\)"):
            ballot.Scene(np.zeros((8, 3, 3)), ref.CUBE_TRIANGLES)

    def test_several_meshes(self):
        cube = (ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        high = (ref.CUBE_VERTICES + np.float32([0, 0, 10]), ref.CUBE_TRIANGLES)
        scene = ballot.Scene(meshes=[cube, high], ids=[7, 4000000000])
        self.assertEqual([tuple(m)[:4] for m in scene.meshes], [("mesh 0", 7, 0, 12), ("mesh 1", 4000000000, 12, 12)])
        self.assertEqual((scene.meshes[1].lo, scene.meshes[1].hi), ((-1, -1, 9), (1, 1, 11)))
        got = scene.trace_columns(np.float32([[0.2, 0.3, 5, 0, 0, -1], [0.2, 0.3, 5, 0, 0, 1], [9, 9, 9, 0, 0, 1]]))
        self.assertEqual(got["mesh_ids"].tolist(), [7, 4000000000, ballot.MISS])
        self.assertTrue((got["prims"][:2] < 12).all())
        self.assertEqual(ballot.Scene(*cube, ids=3).meshes[0].id, 3)

    def test_empty_scene(self):
        scene = ballot.Scene(meshes=[])
        self.assertEqual(scene.info.triangles, 0)
        self.assertEqual(scene.triangles().shape, (0, 3, 3))
        self.assertEqual(scene.trace(UP)["prim"].tolist(), [ballot.MISS])

    def test_flat_triangles_are_never_hit(self):
        scene = ballot.Scene([[0, 0, 0], [1, 0, 0], [2, 0, 0], [-1, 1, 0], [1, 1, 0]], [[0, 1, 2], [0, 4, 3]])
        self.assertEqual(scene.info.degenerate, 1)
        self.assertEqual(scene.trace([[0, 0.5, 1, 0, 0, -1]])["prim"].tolist(), [1])

    def test_settings(self):
        for options in ({"max_leaf": 1}, {"max_leaf": 6, "split_budget": 0}, {"split_budget": 16}):
            with self.subTest(options):
                scene = ballot.Scene(*ref.soup(50), **options)
                self.assertEqual(scene.info.triangles, 50)

    def test_update(self):
        vertices = ref.CUBE_VERTICES.copy()
        scene = ballot.Scene(meshes=[(vertices, ref.CUBE_TRIANGLES), ref.soup(5)])
        before = scene.triangles()
        ref.move(scene, 0, vertices.astype(np.float64) * 2)
        self.assertEqual(scene.trace(UP)["t"].tolist(), [3])
        np.testing.assert_array_equal(scene.triangles()[12:], before[12:])
        vertices[3, 1] = np.nan
        for bad, text in (
            (vertices, "vertex 3"),
            (vertices[:7], "7 vertices"),
            (vertices[:, :2], r"\(n, 3\)|\(\.\.\., 3\)"),
        ):
            with self.assertRaisesRegex(ValueError, text):
                ref.move(scene, 0, bad)
        with self.assertRaisesRegex(ValueError, "mesh 2"):
            ref.move(scene, 2, vertices)
        self.assertEqual(scene.trace(UP)["t"].tolist(), [3])

    def test_update_modes(self):
        soup, rays = ref.soup(300)[0], ref.random_rays(400)
        moved = soup[::-1].copy()  # as bad for the tree as a move can be
        expected = ballot.Scene(moved, soup=True).trace(rays)
        for mode, refits in (("refit", 1), ("rebuild", 0), ("auto", None)):
            with self.subTest(mode):
                scene = ballot.Scene(soup, soup=True, updates=mode)
                self.assertEqual((scene.info.decay, scene.info.refits), (1, 0))
                ref.move(scene, 0, moved)
                np.testing.assert_array_equal(scene.trace(rays), expected)
                info = scene.info
                if refits is not None:
                    self.assertEqual(info.refits, refits)
                self.assertGreater(info.update_seconds, 0)
                self.assertEqual(info.decay > 1.5, info.refits == 1)
                flat = moved.copy()
                flat[:3] = flat[0]  # a triangle loses its area
                ref.move(scene, 0, flat)
                self.assertEqual((scene.info.refits, scene.info.degenerate), (0, 1))
                again = pickle.loads(pickle.dumps(scene))
                np.testing.assert_array_equal(again.trace(rays), scene.trace(rays))
        with self.assertRaisesRegex(ValueError, "update mode.*auto, refit, rebuild"):
            ballot.Scene(soup, soup=True, updates="never")
        with self.assertRaisesRegex(ValueError, "expected_rays"):
            ballot.Scene(soup, soup=True, expected_rays=-1)
        self.assertEqual(ballot.Scene(soup, soup=True, builder="auto", expected_rays=1e9).info.triangles, 300)

    def test_file(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "one.obj")
            with open(path, "w", encoding="ascii") as file:
                file.write("v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n")
            scene = ballot.load_scene(path, cache=False)
            self.assertEqual(scene.trace([[0, 0, 2, 0, 0, -1]])["t"].tolist(), [2])
            again = pickle.loads(pickle.dumps(scene))
            self.assertEqual(again.info.triangles, 1)
            ref.move(scene, 0, np.float32([[[-1, -1, 1], [1, -1, 1], [0, 1, 1]]]))
            for moved in (scene, pickle.loads(pickle.dumps(scene))):
                self.assertEqual(moved.trace([[0, 0, 2, 0, 0, -1]])["t"].tolist(), [1])
            with self.assertRaisesRegex(ValueError, "4 vertices"):
                ref.move(scene, 0, np.zeros((4, 3), np.float32))
            with open(path, "w", encoding="ascii") as file:
                file.write("v a b c\nf 1 2 3\n")
            with self.assertRaisesRegex(ballot.Error, "one.obj"):
                ballot.load_scene(path, cache=False)
        with self.assertRaisesRegex(ballot.Error, "one.obj"):
            ballot.load_scene(path)

    def test_pickle(self):
        normals = ref.CUBE_VERTICES / np.float32(np.sqrt(3))
        soup = ref.soup(20)
        scene = ballot.Scene(
            meshes=[(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES), (soup[0], None)],
            soup=True,
            ids=[5, 9],
            normals=[normals, None],
            max_leaf=2,
            split_budget=0.0,
        )
        ref.move(scene, 1, soup[0] + np.float32(0.125))
        rays = ref.random_rays(200)
        again = pickle.loads(pickle.dumps(scene))
        self.assertEqual(again.meshes, scene.meshes)
        np.testing.assert_array_equal(again.triangles(), scene.triangles())
        np.testing.assert_array_equal(again.trace(rays), scene.trace(rays))
        ref.move(again, 0, ref.CUBE_VERTICES)
        self.assertEqual(len(pickle.loads(pickle.dumps(ballot.Scene(meshes=[]))).meshes), 0)

    def test_pickled_arrays_lie_at_any_address(self):
        scene = ballot.Scene(*ref.soup(20), instances=np.eye(4, dtype=np.float32)[None])
        parts = []
        pickled = pickle.dumps(scene, protocol=5, buffer_callback=parts.append)
        self.assertTrue(parts)
        moved = [ref.at_odd_address(np.frombuffer(part, np.uint32)) for part in parts]
        again = pickle.loads(pickled, buffers=[pickle.PickleBuffer(part) for part in moved])
        rays = ref.random_rays(200)
        np.testing.assert_array_equal(again.trace(rays), scene.trace(rays))

    def test_pickle_keeps_the_device(self):
        with ballot.Device("cpu") as device:
            scene = ballot.Scene(*ref.soup(3), device=device)
            pair = pickle.loads(pickle.dumps((scene, scene)))
            self.assertTrue(pair[0]._device.info.is_cpu)
            self.assertIs(pair[0]._device, pickle.loads(pickle.dumps(device)))

    def test_what_is_pickled_does_not_change_with_the_callers_arrays(self):
        triangles = ref.CUBE_TRIANGLES.copy()
        scene = ballot.Scene(ref.CUBE_VERTICES, triangles)
        triangles[:] = 0
        self.assertEqual(pickle.loads(pickle.dumps(scene)).info.degenerate, 0)


class Devices(unittest.TestCase):
    def test_list(self):
        found = ballot.devices()
        self.assertTrue(any(not d.refusal for d in found))

    def test_open_and_close(self):
        with ballot.Device("cpu") as device:
            self.assertTrue(device.info.is_cpu)
            self.assertIn(device.info.name, repr(device))
            scene = ballot.Scene(*ref.soup(3), device=device)
        self.assertTrue(device.closed)
        self.assertIn("closed", repr(device))
        self.assertEqual(scene.info.triangles, 3)  # the scene keeps the device for itself
        for call in (lambda: device.info, lambda: ballot.Scene(*ref.soup(3), device=device)):
            with self.assertRaisesRegex(RuntimeError, "closed") as caught:
                call()
            self.assertEqual(caught.exception.code, ballot.Code.CLOSED)

    def test_each_object_says_what_it_is(self):
        scene, rays = ballot.Scene(*ref.soup(3)), ref.random_rays(5)
        array, job = ballot.Array("rays", 2), scene.submit(rays)
        job.wait()
        self.assertEqual(repr(scene), "<ballot.Scene of 3 triangles>")
        self.assertEqual(repr(array), "<ballot.Array of 2 rays, float32 of shape (2, 8)>")
        self.assertEqual(repr(job), "<ballot.Job of 5 rays, ended>")
        array.close()
        self.assertEqual(repr(array), "<ballot.Array of 2 rays, closed>")
        open3d = ballot.RaycastingScene()
        open3d.add_triangles(*ref.soup(3))
        self.assertEqual(repr(open3d), "<ballot.RaycastingScene of 1 geometries, 3 triangles>")
        ray = ballot.trimesh_ray.RayMeshIntersector(types.SimpleNamespace(vertices=[], faces=[]))
        self.assertIn("RayMeshIntersector of a SimpleNamespace", repr(ray))
        picture = ballot.render(scene, width=6, height=4)
        self.assertEqual(repr(picture), "<ballot.Picture of 6 x 4 pixels, float32 linear RGBA>")
        for value in (scene.info, scene.meshes[0], ballot.devices()[0], job.times, ballot.Code.DEVICE):
            self.assertTrue(repr(value).lstrip("<").startswith(type(value).__name__), repr(value))

    def test_default_is_shared(self):
        self.assertIs(ballot.default_device(), ballot.default_device())

    def test_unknown(self):
        with self.assertRaisesRegex((ballot.Error, ValueError), "no such thing"):
            ballot.Device("no such thing")
        with self.assertRaisesRegex(TypeError, "string"):
            ballot.Device(0)

    def test_error(self):
        error = pickle.loads(pickle.dumps(ballot.Error("text", ballot.Code.FORKED)))
        self.assertEqual((str(error), error.code), ("text", ballot.Code.FORKED))


if __name__ == "__main__":
    unittest.main()
