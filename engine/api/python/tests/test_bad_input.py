"""Bad input: one clear exception each, and nothing written."""

import os
import unittest

import ballot
import numpy as np
import reference as ref


class Rays(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scene = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        cls.rays = np.float32([[0.25, 0.5, 3, 0, 0, -1]] * 4)

    def refused(self, error, text, rays=None, call=None, **arguments):
        with self.assertRaisesRegex(error, text) as caught:
            (call or self.scene.trace)(self.rays if rays is None else rays, **arguments)
        self.assertNotIn("\n", str(caught.exception))

    def test_types(self):
        self.refused(TypeError, "rays: dtype is int32; expected float32", self.rays.astype(np.int32))
        self.refused(TypeError, "rays: dtype is complex64; expected float32", self.rays.astype(np.complex64))
        self.refused(TypeError, "rays: found str", "rays")
        self.refused(TypeError, "rays: found NoneType", call=lambda _: self.scene.trace(None))
        self.refused(TypeError, "rays: found list", [["a"] * 6])
        self.refused((TypeError, ValueError), "rays: ", [[0] * 6, [0] * 5])

    def test_shapes(self):
        self.refused(ValueError, r"rays: shape is \(4, 5\); expected \(\.\.\., 8\) or \(\.\.\., 6\)", self.rays[:, :5])
        self.refused(ValueError, r"rays: shape is \(\)", np.float32(1))
        self.refused(ValueError, "have their own", np.zeros((4, 8), np.float32), t=(0, 1))
        self.refused(ValueError, "t: found 3", t=3)
        self.refused(ValueError, "t: shapes", t=(np.zeros(3), 1))

    def test_ranges_and_limits(self):
        nan, inf = float("nan"), float("inf")
        scene, rays, point = self.scene, self.rays, np.float32([[0, 0, 3]])
        twin = ballot.RaycastingScene()
        twin.add_triangles(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        ranges = [(nan, 1), (0, nan), (2, 1), (-inf, 1), (inf, None), (0, -inf), ("a", 1), (0, "b"), (0, [None] * 4)]
        for t in ranges:
            for call in (scene.trace, scene.trace_columns, scene.occluded, scene.submit, scene.count_crossings,
                         scene.crossings):  # fmt: skip
                self.refused((ValueError, TypeError), "^t(:| is)", call=call, t=t)
        for t in ranges[:6]:
            call = lambda r, t: twin.test_occlusions(r, *t)  # noqa: E731
            self.refused(ValueError, "^t(:| is)", call=call, t=t)
        self.assertTrue(twin.test_occlusions(rays, None, None).all())
        for limit in (nan, 0, -1, -inf, 1e-60):
            self.refused(ValueError, "limit is", point, scene.nearest, limit=limit)
        self.refused(TypeError, "limit: found 'a'", point, scene.nearest, limit="a")
        for limit in (None, inf, 1e300, 2):
            self.assertEqual(scene.nearest(point, ("distances",), limit=limit)["distances"].tolist(), [2])
        self.refused(ValueError, "seconds is nan", call=lambda r: scene.set_time(nan))
        self.refused(TypeError, "seconds: found None", call=lambda r: scene.set_time(None))
        pinhole = ballot.RaycastingScene.create_rays_pinhole
        for fov in (nan, 0, 180, -5, inf):
            call = lambda r, f: pinhole(f, [0, 0, 0], [0, 0, 1], [0, 1, 0], 4, 4)  # noqa: E731
            self.refused(ValueError, "fov_deg is", call=call, f=fov)
        call = lambda r: pinhole(60, [0, 0, 0], [0, 0, nan], [0, 1, 0], 4, 4)  # noqa: E731
        self.refused(ValueError, "eye: it holds nan", call=call)
        self.refused(ValueError, "diagonal", call=lambda r: pinhole(np.zeros((3, 3)), np.eye(4), 4, 4))

    def test_what_an_object_raises_reaches_the_caller(self):
        class Own(BaseException):
            pass

        def raising(what, error):
            def raises(*_, **__):
                raise error

            body = {what: raises if what in ("__dlpack__", "__array__") else property(raises)}
            return type("Given", (), {"__dlpack_device__": lambda self: (1, 0), **body} if "dl" in what else body)()

        for what in ("__dlpack__", "__array_interface__", "__cuda_array_interface__", "__array__"):
            for error in (KeyboardInterrupt, Own, MemoryError, KeyError, ValueError):
                calls = [self.scene.trace, self.scene.nearest, lambda g: ballot.Scene(g, ref.CUBE_TRIANGLES)]
                if what != "__array__":
                    calls.append(lambda g: self.scene.trace(self.rays, out=g))
                for call in calls:
                    with self.subTest(what=what, error=error), self.assertRaises(error):
                        call(raising(what, error("mine")))
        for error in (TypeError, BufferError, RuntimeError):
            self.refused(error, "mine", raising("__dlpack__", error("mine")))

    def test_no_names_of_the_c_interface(self):
        """Error texts are of one line, in the words of Python."""
        scene, rays, v, t = self.scene, self.rays, ref.CUBE_VERTICES, ref.CUBE_TRIANGLES
        placed = ballot.Scene(v, t, instances=np.eye(4)[None])
        opened = ballot.Scene(v, t[:-1])
        other = ballot.Array("rays", 2, ballot.Device())
        few, points, hits = ballot.Array("rays", 1), ballot.Array("points", 1), ballot.Array("hits", 1)
        wrong = np.eye(4)[None] * np.nan
        bad = "\udc80"
        calls = [
            lambda: scene.nearest(v, numeric="plain"), lambda: scene.nearest(v, ("inside",), sign="no"),
            lambda: opened.nearest(v, ("inside",)), lambda: scene.count_crossings(rays, numeric="fast"),
            lambda: scene.count_crossings(rays, masks=[1, 2, 3]),
            lambda: scene.count_crossings(rays, numeric="exact", alpha=True), lambda: scene.crossings(rays, cull="no"),
            lambda: ref.move(scene, 1, v), lambda: ref.move(scene, 0, v[:3]), lambda: ref.move(scene, 0, v * np.inf),
            lambda: scene.set_time(0), lambda: ref.place(scene, np.eye(4)[None].repeat(2, 0)),
            lambda: ref.place(placed, np.eye(4)[None].repeat(2, 0)), lambda: ref.place(placed, wrong),
            lambda: placed.nearest(v, numeric="fast"),
            lambda: placed.make_rays("no"), lambda: ballot.render(placed, "no"), lambda: ref.move(placed, 0, v[:3]),
            lambda: placed.set_time(0),
            lambda: placed.trace(rays, method="packet-wide"), lambda: ballot.Scene(v, t, instances=wrong),
            lambda: ballot.Scene(v, t, expected_rays=-1), lambda: ballot.Scene(v, t, expected_rays=float("nan")),
            lambda: ballot.Scene(v, t, updates="no"), lambda: ballot.Scene(v, t, builder="no"),
            lambda: scene.trace(few, out=hits, count=2), lambda: scene.trace(other, out=hits, count=1),
            lambda: scene.trace(hits, out=few), lambda: scene.nearest(few),
            lambda: scene.nearest(points, ("prims",), out={"prims": hits}), lambda: few.read(first=2),
            lambda: few.write(np.zeros((2, 8))),
            lambda: few.write(np.zeros((1, 8), np.float32), first=1), lambda: ballot.Array("rays", 2**31),
            lambda: ballot.Array("rays", 1, exported=True).fd(), lambda: few.cuda_address,
            lambda: ballot.load_scene("/no/such.obj"), lambda: ballot.load_scene("/no/such\n.obj"),
            lambda: ballot.load_scene("/no/" + bad + ".obj"), lambda: ballot.load_scene(os.devnull),
            lambda: ballot.Device("no such"), lambda: ballot.Device(bad), lambda: ballot.Device("a\0b"),
            lambda: scene.trace(rays, method=bad), lambda: scene.trace(rays, method="no\nsuch"),
            lambda: scene.trace(rays, knobs={"vote": "no\nsuch"}), lambda: scene.trace(rays, knobs={bad: 1}),
            lambda: ballot.render(scene, "no\nsuch"), lambda: ballot.render(scene, bad),
            lambda: ballot.render(scene, sky="/no/such.exr"), lambda: ballot.render(scene, shading=bad),
            lambda: scene.make_rays(kind="no"), lambda: scene.make_rays("no"),
        ]  # fmt: skip
        for number, call in enumerate(calls):
            with self.subTest(number=number):
                try:
                    call()
                except (ValueError, TypeError, ballot.Error) as error:
                    self.assertNotRegex(str(error), r"\n|Ballot[A-Z]|ballot_|BALLOT_|std::|incompatible function")
                    self.assertTrue(str(error))
                else:
                    self.assertIn(number, (34,))  # a device that can export

    def test_out(self):
        out = np.zeros(4, ballot.HIT)
        before = out.copy()
        out.flags.writeable = False
        self.refused(ValueError, "out: the array is read-only", out=out)
        self.refused(ValueError, r"out: shape is \(3,\); expected \(4,\)", out=np.zeros(3, ballot.HIT))
        self.refused(TypeError, "out: dtype is float64; expected ballot.HIT", out=np.zeros((4, 4)))
        self.refused(ValueError, "out: strides", out=np.zeros(8, ballot.HIT)[::2])
        self.refused(TypeError, "out: found list", out=[0] * 4)
        self.refused(TypeError, "out: dtype", out=np.zeros(4, bool), call=lambda r, out: self.scene.trace(r, out=out))
        self.refused(TypeError, "dtype", call=self.scene.occluded, out=np.zeros(4, np.int64))
        room = np.zeros((4, 6), np.float32)
        self.refused(ValueError, "overlaps the rays", room, out=room.reshape(-1)[:16].reshape(4, 4))
        np.testing.assert_array_equal(out, before)

    def test_columns(self):
        self.refused(ValueError, "columns: found 'tt'", call=lambda r: self.scene.trace_columns(r, ("tt",)))
        call = lambda r: self.scene.trace_columns(r, ("t",), out={"uvs": np.zeros(8, np.float32)})  # noqa: E731
        self.refused(ValueError, "uvs", call=call)

    def test_a_failed_call_writes_nothing(self):
        out = np.full(4, 7, np.uint8).repeat(16).view(ballot.HIT)
        before = out.copy()
        for arguments in ({"method": "no"}, {"numeric": "no"}, {"knobs": {"no": 1}}, {"knobs": {"vote": "no"}}):
            self.refused(ValueError, "no", out=out, **arguments)
        np.testing.assert_array_equal(out, before)

    def test_names(self):
        self.refused(ValueError, "packet", method="no-such")  # lists the known ones
        self.refused(ValueError, "watertight", numeric="no-such")
        self.refused(TypeError, "method: found int", method=3)
        self.refused(TypeError, "knobs: found list", knobs=["vote"])
        self.refused(TypeError, "knobs: a name", knobs={3: 4})
        self.refused(TypeError, "ray_class: found int", ray_class=3)
        self.refused(TypeError, "progress: found int", progress=3)


class Meshes(unittest.TestCase):
    def refused(self, error, text, *args, **kwargs):
        with self.assertRaisesRegex(error, text) as caught:
            ballot.Scene(*args, **kwargs)
        self.assertNotIn("\n", str(caught.exception))

    def test_vertices(self):
        v, t = ref.CUBE_VERTICES, ref.CUBE_TRIANGLES
        for number in (np.nan, np.inf):
            bad = v.copy()
            bad[5, 2] = number
            self.refused(ValueError, "vertex 5 is", bad, t)
            self.refused(ValueError, "mesh 1: vertex 5 is", meshes=[(v, t), (bad, t)])
        self.refused(ValueError, r"vertices: shape is \(8, 2\)", v[:, :2], t)
        self.refused(ValueError, r"vertices: shape is \(24,\)", v.ravel(), t)
        self.refused(ValueError, r"expected \(n, 3\)", v[None], t)
        self.refused(TypeError, "vertices: dtype is int64", v.astype(np.int64), t)
        self.refused(ValueError, "vertex", np.float32([[1e20, 0, 0], [0, 1, 0], [0, 0, 1]]), [[0, 1, 2]])

    def test_triangles(self):
        v, t = ref.CUBE_VERTICES, ref.CUBE_TRIANGLES
        bad = t.copy()
        bad[3, 1] = 8
        self.refused(ValueError, "index 10 is 8, but there are 8 vertices", v, bad)
        self.refused(ValueError, "index -1", v, np.where(bad == 8, -1, bad.astype(np.int64)))
        self.refused(ValueError, "index 4294967296", v, np.where(bad == 8, 2**32, bad.astype(np.int64)))
        self.refused(TypeError, "triangles: dtype is float32", v, t.astype(np.float32))
        self.refused(ValueError, r"triangles: shape is \(18, 2\); expected \(m, 3\)", v, t.reshape(18, 2))
        self.refused(ValueError, "there are no triangles", v, None)
        self.refused(ValueError, "expected a multiple of 3", v, None, soup=True)

    def test_empty(self):
        self.refused(ValueError, "leave empty meshes out", np.empty((0, 3), np.float32), None)
        self.refused(ValueError, "leave empty meshes out", ref.CUBE_VERTICES, np.empty((0, 3), np.uint32))
        self.refused(TypeError, "neither vertices nor meshes")
        self.refused(TypeError, "both vertices and meshes", ref.CUBE_VERTICES, meshes=[])
        self.refused(TypeError, "mesh 0: found int", meshes=[3])

    def test_masks_and_flags(self):
        scene = ballot.Scene(meshes=[ref.soup(2), ref.soup(2)])
        rays = ref.random_rays(6).reshape(2, 3, 6)
        for call in (scene.count_crossings, scene.crossings):
            with self.assertRaisesRegex(ValueError, r"masks: shape is \(3, 2\); expected .* an array of \(2, 3\)"):
                call(rays, masks=np.ones((3, 2), np.uint32))
            call(rays, masks=np.ones((2, 3), np.uint32))
        for wrong in ([1, 2], [0.5], -1, 2**32):
            with self.assertRaisesRegex(ValueError, "masks: "):
                scene.nearest(np.zeros((3, 3)), masks=wrong)
        flags = ballot.Array("inside", 2)
        flags.write([True, False])
        self.assertEqual(flags.read().tolist(), [1, 0])
        for wrong in ([0.5, 1.0], np.ones((1, 2), np.uint32)):
            with self.assertRaisesRegex(ValueError, "records: shape is"):
                flags.write(wrong)

    def test_too_many_triangles(self):
        huge = np.empty((2**31, 3), np.uint16)  # 12 GB of address space that nobody touches
        self.refused(ValueError, "2147483648 triangles", ref.CUBE_VERTICES, huge)

    def test_settings(self):
        v, t = ref.CUBE_VERTICES, ref.CUBE_TRIANGLES
        self.refused(ValueError, "max_leaf is 0; expected 1 to 6", v, t, max_leaf=0)
        self.refused(ValueError, "max_leaf is 7; expected 1 to 6", v, t, max_leaf=7)
        self.refused(ValueError, "split_budget is -1.0; expected 0 to 16", v, t, split_budget=-1)
        self.refused(ValueError, "split_budget is nan", v, t, split_budget=float("nan"))
        self.refused(TypeError, "split_budget: found 'a'", v, t, split_budget="a")
        self.refused(ValueError, "ids: found 2; expected 1", v, t, ids=[1, 2])
        self.refused(ValueError, "id is -1", v, t, ids=-1)
        self.refused(ValueError, r"normals: shape is \(7, 3\); expected \(8, 3\)", v, t, normals=v[:7])
        self.refused(TypeError, "device: found str", v, t, device="gpu")


class Closed(unittest.TestCase):
    def test_scene(self):
        scene = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        scene.close()
        scene.close()
        self.assertIn("closed", repr(scene))
        rays = ref.random_rays(3)
        array = ballot.Array("rays", 3)
        calls = [
            lambda: scene.info,
            lambda: scene.meshes,
            lambda: scene.triangles(),
            lambda: scene.trace(rays),
            lambda: scene.occluded(rays),
            lambda: scene.submit(rays),
            lambda: ref.move(scene, 0, ref.CUBE_VERTICES),
            lambda: scene.make_rays(width=4, height=4),
            lambda: ballot.render(scene),
            lambda: scene.trace(array),
        ]
        for call in calls:
            with self.assertRaisesRegex(RuntimeError, "scene: it was closed") as caught:
                call()
            self.assertEqual(caught.exception.code, ballot.Code.CLOSED)

    def test_array(self):
        array = ballot.Array("rays", 3)
        array.close()
        for call in (array.read, array.numpy, array.fd, lambda: array.write(np.zeros((3, 8), np.float32))):
            with self.assertRaisesRegex(RuntimeError, "array: it was closed"):
                call()

    def test_a_job_outlives_its_scene(self):
        scene = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        job = scene.submit(ref.random_rays(1000))
        scene.close()
        self.assertEqual(len(job.wait()), 1000)


class Views(unittest.TestCase):
    def test_views_and_pictures(self):
        scene = ballot.Scene(ref.CUBE_VERTICES, ref.CUBE_TRIANGLES)
        camera = {"eye": (0, 0, 5), "target": (0, 0, 0)}
        for error, text, view, arguments in (
            (ValueError, "no-such", "no-such", {}),
            (ValueError, "name is empty", "", {}),
            (TypeError, "view: found int", 3, {}),
            (ValueError, "unknown key 'fov'", {**camera, "fov": 1}, {}),
            (ValueError, "at least eye and target", {"eye": (0, 0, 1)}, {}),
            (ValueError, "two points", {"eye": (0, 0, 1), "target": (0, 0, 1)}, {}),
            (ValueError, "eye: found 2 numbers", {**camera, "eye": (0, 1)}, {}),
            (ValueError, "eye is nan", {**camera, "eye": (0, 1, float("nan"))}, {}),
            (TypeError, "eye: found 'a'", {**camera, "eye": "abc"}, {}),
            (ValueError, "parallel", {**camera, "up": (0, 0, 2)}, {}),
            (ValueError, "yfov is 4", {**camera, "yfov": 4}, {}),
            (ValueError, "width is 0; expected 1 to 16384", camera, {"width": 0}),
            (TypeError, "width: found float", camera, {"width": 1.5}),
            (ValueError, "samples is 0", camera, {"samples": 0}),
            (ValueError, "bounces is 65", camera, {"bounces": 65}),
            (ValueError, "no-such", camera, {"shading": "no-such"}),
            (ValueError, "no-such", camera, {"sky": "no-such"}),
            (TypeError, "shading: found int", camera, {"shading": 3}),
        ):
            with self.subTest(text), self.assertRaisesRegex(error, text):
                ballot.render(scene, view, **{"width": 8, "height": 8, **arguments})
        with self.assertRaisesRegex(ValueError, "no-such"):
            scene.make_rays(camera, "no-such", 4, 4)
        with self.assertRaisesRegex(TypeError, "scene: found int"):
            ballot.render(3)
        with self.assertRaisesRegex(TypeError, "scene: found int"):
            ballot.bench(3)


if __name__ == "__main__":
    unittest.main()
