"""Sensors: where points are and what they tell, returns of beams, motion, against closed forms."""

import base64
import json
import os
import tempfile
import unittest

import ballot
import numpy as np
import reference as ref
from ballot import sensors

FAR = 50.0


def walls(*at, **options):
    """Returns a scene of large squares across the x axis at these places, each a mesh, all facing -x."""
    square = np.float32([[0, -FAR, -FAR], [0, -FAR, FAR], [0, FAR, FAR], [0, FAR, -FAR]])
    meshes = [(square + np.float32([x, 0, 0]), [[0, 1, 2], [0, 2, 3]]) for x in at]
    return ballot.Scene(meshes=meshes, **options)


def turned(angle, shift=(0, 0, 0)):
    """Returns a pose that turns about +z and shifts."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, shift[0]], [s, c, 0, shift[1]], [0, 0, 1, shift[2]]])


def ahead(*angles):
    """Returns a pattern of unit rays at angles from +x towards +y."""
    return ballot.Pattern(np.stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))], -1))


class Points(unittest.TestCase):
    def test_a_scan_is_the_trace(self):
        scene = ballot.Scene(meshes=[ref.soup(60), ref.soup(40)], ids=[7, 9])
        sensor = sensors.spinning(np.linspace(-1, 1, 8), 90, near=0.1, far=4)
        poses = np.stack([turned(0.3, (0.2, 0, 0)), turned(2, (0, 0.1, 0.3))])
        names = ("xyz", "range", "depth", "normal", "id", "instance", "prim", "material", "pose", "beam", "ring",
                 "time", "return_number")  # fmt: skip
        cloud = sensor.scan(scene, poses, fields=names)
        columns = ("t", "positions", "normals", "mesh_ids", "instances", "prims", "materials")
        truth = scene.trace_columns(sensor.pattern, columns, poses=poses, t=(0.1, 4))
        pose, ring, column = np.nonzero(np.isfinite(truth["t"]))
        self.assertGreater(len(pose), 300)
        met = {name: c[pose, ring, column] for name, c in truth.items()}
        for name, values in (
            ("range", met["t"]), ("id", met["mesh_ids"]), ("instance", met["instances"]), ("prim", met["prims"]),
            ("material", met["materials"]), ("pose", pose), ("ring", ring), ("beam", ring * 90 + column),
            ("time", np.float32(0.1 * column / 90)), ("return_number", np.ones(len(pose))),
            *((f"normal_{axis}", met["normals"][:, k]) for k, axis in enumerate("xyz")),
        ):  # fmt: skip
            np.testing.assert_array_equal(cloud[name], values, name)
        np.testing.assert_allclose(cloud["depth"], met["t"], rtol=1e-6)
        for k, axis in enumerate("xyz"):
            np.testing.assert_allclose(cloud[axis], met["positions"][:, k], atol=4e-6)
        own = sensor.scan(scene, poses, fields=("xyz", "normal"), frame="sensor")
        for group in ("xyz", ("normal_x", "normal_y", "normal_z")):
            there = np.stack([own[name] for name in group], -1).astype(float)
            back = np.einsum("nij,nj->ni", poses[pose][:, :, :3], there) + poses[pose][:, :, 3] * (group == "xyz")
            np.testing.assert_allclose(back, np.stack([cloud[name] for name in group], -1), atol=4e-6)
        whole = sensor.scan(scene, poses.reshape(2, 1, 3, 4), fields=names, organized=True)
        self.assertEqual(whole.shape, (2, 1, 8, 90))
        there = np.isfinite(truth["t"]).reshape(whole.shape)
        np.testing.assert_array_equal(whole[there], cloud)
        self.assertTrue(np.isnan(whole["x"][~there]).all() and (whole["id"][~there] == ballot.MISS).all())
        self.assertEqual(sensor.scan(scene, np.empty((0, 3, 4))).shape, (0,))
        self.assertEqual(sensor.scan(scene, np.empty((0, 3, 4)), returns=2, organized=True).shape, (0, 8, 90, 2))

    def test_cameras_project_back(self):
        k = np.array([[60, 0, 40.5], [0, 62, 29.5], [0, 0, 1]])
        k1, k2, p1, p2, k3 = bent = (-0.2, 0.05, 0.003, -0.002, 0.01)
        scene = ballot.Scene([[-FAR, -FAR, 4], [FAR, -FAR, 5], [0, FAR, 6]], [[0, 1, 2]])
        camera = ballot.Camera.pinhole(80, 60, k, distortion=bent)
        cloud = sensors.Sensor(camera, times=np.linspace(0, 0.03, 60)[:, None]).scan(
            scene, fields=("xyz", "depth", "ring", "beam", "time"), organized=True
        )
        self.assertTrue(np.isfinite(cloud["depth"]).all())
        np.testing.assert_allclose(cloud["depth"], cloud["z"], rtol=1e-6)
        x, y = cloud["x"] / cloud["z"].astype(float), cloud["y"] / cloud["z"].astype(float)
        r = x * x + y * y
        radial = 1 + r * (k1 + r * (k2 + r * k3))
        u = k[0, 0] * (x * radial + 2 * p1 * x * y + p2 * (r + 2 * x * x)) + k[0, 2]
        v = k[1, 1] * (y * radial + p1 * (r + 2 * y * y) + 2 * p2 * x * y) + k[1, 2]
        np.testing.assert_allclose(u, np.tile(np.arange(80) + 0.5, (60, 1)), atol=1e-4)
        np.testing.assert_allclose(v, np.tile(np.arange(60)[:, None] + 0.5, (1, 80)), atol=1e-4)
        np.testing.assert_array_equal(cloud["ring"], np.tile(np.arange(60)[:, None], (1, 80)))
        np.testing.assert_allclose(cloud["time"][-1], 0.03)
        limited = sensors.Sensor(ballot.Camera.pinhole(80, 60, k), near=5, far=6).scan(scene, fields=("range",))
        self.assertTrue(((limited["range"] >= 5) & (limited["range"] <= 6)).all() and len(limited))
        room = walls(5)
        around = sensors.Sensor(ballot.Camera.panorama(64, 32)).scan(room, fields=("xyz",))
        np.testing.assert_allclose(around["x"], 5, rtol=1e-6)

    def test_patterns(self):
        offsets = np.array([0.0, 0.01, -0.01])
        turning = sensors.spinning([-0.1, 0, 0.1], 100, offsets=offsets, period=0.05)
        np.testing.assert_allclose(np.linalg.norm(turning.directions(), axis=-1), 1, atol=1e-6)
        np.testing.assert_allclose(np.arctan2(turning.directions()[:, 0, 1], turning.directions()[:, 0, 0]), offsets,
                                   atol=1e-7)  # fmt: skip
        self.assertEqual((turning.times.shape, turning.period), ((1, 100), 0.05))
        solid = sensors.solid_state(4, 6, horizontal=1.2, vertical=0.4).directions()
        azimuth, up = np.arctan2(solid[..., 1], solid[..., 0]), np.arcsin(solid[..., 2])
        np.testing.assert_allclose(azimuth[0], np.linspace(0.5, -0.5, 6), atol=1e-6)
        np.testing.assert_allclose(up[:, 0], np.linspace(0.15, -0.15, 4), atol=1e-6)
        petals = sensors.rosette(5000, cone=1.0)
        from_axis = np.arccos(np.clip(petals.directions()[:, 0].astype(float), -1, 1))
        self.assertAlmostEqual(float(from_axis.max()), 0.5, places=3)
        self.assertEqual(set(petals.rings.tolist()), {0})
        wide = sensors.Sensor(ahead(0, 1), divergence=0.02, rays=19).directions()
        cosine = np.einsum("bri,bi->br", wide.astype(float), wide[:, 0].astype(float))
        self.assertEqual(wide.shape, (2, 19, 3))
        self.assertAlmostEqual(float(np.arccos(cosine.min())), 0.01, places=4)
        np.testing.assert_allclose(wide[1].astype(float).mean(0), wide[1, 0], atol=1e-3)

    def test_intensity(self):
        luminance = np.float32([0.25, 0.5])
        paint = [{"gray": ballot.Attribute(luminance[0], "mesh")}, None]
        scene = walls(4, 6, attributes=paint)
        angles = (0.0, 0.5, 1.0)
        sensor = sensors.Sensor(ahead(*angles))
        plain = sensor.scan(scene, fields=("intensity",), returns=2)
        np.testing.assert_allclose(plain["intensity"], np.repeat(np.cos(angles), 2), rtol=1e-6)
        gray = sensor.scan(scene, returns=2, reflectance="gray", organized=True)["intensity"]
        np.testing.assert_allclose(gray, np.cos(angles)[:, None] * [0.25, 1], rtol=1e-6)
        white = sensor.scan(scene, reflectance="colors")["intensity"]
        base = scene.trace_columns(sensor.pattern, ("colors",))["colors"][:, :3] @ [0.2126, 0.7152, 0.0722]
        np.testing.assert_allclose(white, np.cos(angles) * base, rtol=1e-6)
        half = sensors.Sensor(ballot.Pattern(np.float32([[0.5, 0.5, 0]])))  # directions of any length
        self.assertAlmostEqual(half.scan(scene)["intensity"].item(), np.sqrt(0.5), places=6)
        self.assertAlmostEqual(half.scan(scene)["range"].item(), 4 * np.sqrt(2), places=5)

    def test_noise(self):
        scene, sensor = walls(10), sensors.Sensor(ballot.Pattern(np.tile([1.0, 0, 0], (40000, 1))), noise=0.02)
        found = sensor.scan(scene, seed=3)
        np.testing.assert_array_equal(found, sensor.scan(scene, seed=3))
        self.assertFalse((found["range"] == sensor.scan(scene, seed=4)["range"]).all())
        self.assertAlmostEqual(float(found["range"].std()), 0.02, delta=5e-4)
        self.assertAlmostEqual(float(found["range"].mean()), 10, delta=5e-4)
        np.testing.assert_allclose(found["x"], found["range"])

    def test_groups_and_masks_of_poses(self):
        matrices = np.tile(np.eye(4), (2, 1, 1))
        matrices[1, 0, 3] = 2
        square = walls(4).triangles()
        scene = ballot.Scene(square, instances=matrices, groups=[0, 1], masks=[1, 2])
        sensor, poses = sensors.Sensor(ahead(0.0)), np.tile(np.eye(3, 4), (3, 1, 1))
        self.assertEqual(sensor.scan(scene, poses, groups=[0, 1, 1])["x"].tolist(), [4, 6, 6])
        self.assertEqual(sensor.scan(scene, poses, masks=[2, 3, 1])["x"].tolist(), [6, 4, 4])
        self.assertEqual(sensor.scan(scene, poses, groups=1)["x"].tolist(), [6, 6, 6])


class Returns(unittest.TestCase):
    def test_of_one_ray(self):
        paint = [{"gray": ballot.Attribute(g, "mesh")} for g in (0.2, 0.9, 0.4, 0.9)]
        scene, sensor = walls(2, 3, 5, 9, attributes=paint), sensors.Sensor(ahead(0.0, 0.4))

        def x(**options):
            return sensor.scan(scene, reflectance="gray", organized=True, **options)["x"].round(4).tolist()

        self.assertEqual(x(), [2, 2])
        self.assertEqual(x(returns="last"), [9, 9])
        self.assertEqual(x(returns="strongest"), [3, 3])
        self.assertEqual(x(returns="last", depth=3), [5, 5])
        self.assertEqual(x(returns=1), [[2], [2]])
        self.assertEqual(x(returns=3), [[2, 3, 5]] * 2)
        self.assertEqual(x(returns=2, depth=16), [[2, 3]] * 2)
        many = sensor.scan(scene, returns=6, fields=("x", "return_number"))
        self.assertEqual(many["return_number"].tolist(), [1, 2, 3, 4] * 2)
        both = sensor.scan(scene, returns=2, depth=4, resolution=1.2, reflectance="gray", organized=True)[0]
        np.testing.assert_allclose(both["range"], [(0.2 * 2 + 0.9 * 3) / 1.1, 5], rtol=1e-6)
        np.testing.assert_allclose(both["intensity"], [1.1, 0.4], rtol=1e-6)
        self.assertEqual(both["id"].tolist(), [1, 2])  # of the surface that adds most

    def test_of_wide_beams(self):
        square = np.float32([[0, -1, 0], [0, 1, 0], [0, 1, FAR], [0, -1, FAR]])  # above the middle of the beam
        far = walls(8).triangles().reshape(-1, 3)
        scene = ballot.Scene(meshes=[(square + [4, 0, 0], [[0, 1, 2], [0, 2, 3]]), (far, [[0, 1, 2], [3, 4, 5]])])
        pattern = ballot.Pattern(np.float32([[1, 0, -1e-4]]))
        sensor = sensors.Sensor(pattern, divergence=0.02, rays=400)
        names = ("x", "range", "intensity", "id")
        found = sensor.scan(scene, returns=3, resolution=0.5, fields=names, organized=True)[0]
        self.assertEqual(found["id"].tolist(), [0, 1, ballot.MISS])
        np.testing.assert_allclose(found["x"][:2], [4, 8], rtol=1e-4)
        self.assertTrue(np.isnan(found["range"][2]) and np.isnan(found["intensity"][2]))
        np.testing.assert_allclose(found["intensity"][:2], 0.5, atol=0.02)
        self.assertAlmostEqual(float(found["intensity"][:2].sum()), 1, places=3)
        self.assertEqual(sensor.scan(scene, returns="last", resolution=0.5)["id"].tolist(), [1])
        strongest = sensor.scan(scene, returns="strongest", resolution=0.5)
        self.assertEqual(strongest["intensity"], found["intensity"][:2].max())
        through = sensor.scan(scene, returns=2, depth=2, resolution=0.5)
        np.testing.assert_allclose(through["intensity"], [found["intensity"][0], 1], atol=1e-3)


    def test_through_alpha(self):
        """Of three squares the first is cut away by its material's alpha, the others stop the beam."""
        scene = ballot.load_scene(self.file([(2, 0.3), (3, 0.7), (5, 1.0)]))
        sensor = sensors.Sensor(ahead(0.0, 0.2))
        self.assertEqual(sensor.scan(scene, alpha=True)["x"].round(5).tolist(), [3, 3])
        several = sensor.scan(scene, returns=3, alpha=True, organized=True, fields=("x", "material", "return_number"))
        np.testing.assert_allclose(several["x"], [[3, 5, np.nan]] * 2, rtol=1e-6)
        self.assertEqual(several["material"].tolist(), [[1, 2, ballot.MISS]] * 2)
        self.assertEqual(sensor.scan(scene, returns=3)["x"].round(5).tolist(), [2, 3, 5] * 2)
        self.assertEqual(sensor.scan(scene, returns="last", alpha=True)["x"].round(5).tolist(), [5, 5])

    def file(self, squares):
        """Writes squares across the x axis, at their places, with their opacities: a glTF file. Returns its path."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        corners = walls(*(x for x, _ in squares)).triangles().reshape(-1, 6, 3)
        data = base64.b64encode(corners.tobytes()).decode()
        numbers = range(len(squares))
        content = {
            "asset": {"version": "2.0"},
            "buffers": [{"byteLength": corners.nbytes, "uri": f"data:application/octet-stream;base64,{data}"}],
            "bufferViews": [{"buffer": 0, "byteOffset": 72 * k, "byteLength": 72} for k in numbers],
            "accessors": [{"bufferView": k, "componentType": 5126, "count": 6, "type": "VEC3",
                           "min": corners[k].min(0).tolist(), "max": corners[k].max(0).tolist()} for k in numbers],
            "materials": [{"alphaMode": "MASK", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, a]}}
                          for _, a in squares],
            "meshes": [{"primitives": [{"attributes": {"POSITION": k}, "material": k}]} for k in numbers],
            "nodes": [{"mesh": k} for k in numbers],
            "scenes": [{"nodes": list(numbers)}],
        }  # fmt: skip
        path = os.path.join(folder.name, "squares.gltf")
        with open(path, "w", encoding="utf-8") as file:
            json.dump(content, file)
        return path


class Motions(unittest.TestCase):
    def test_a_sensor_that_moves(self):
        scene = walls(20)
        angles = np.linspace(-0.3, 0.3, 11)
        sensor = sensors.Sensor(ahead(*angles), times=np.linspace(0, 1, 11))
        start, end = turned(0), turned(0.6, (5, 2, 0))
        found = sensor.scan(scene, start, until=end, organized=True, fields=("xyz", "range"))
        share = np.linspace(0, 1, 11)
        y, heading = 2 * share, angles + 0.6 * share
        np.testing.assert_allclose(found["range"], (20 - 5 * share) / np.cos(heading), rtol=2e-6)
        np.testing.assert_allclose(found["y"], y + (20 - 5 * share) * np.tan(heading), rtol=1e-5, atol=1e-5)
        still = sensor.scan(scene, [start, end], until=[start, end], fields=("range",))
        np.testing.assert_allclose(still["range"], sensor.scan(scene, [start, end], fields=("range",))["range"],
                                   rtol=1e-6)  # fmt: skip
        turning = sensors.spinning([-0.1, 0, 0.1], 60, rays=3, divergence=0.01, period=1)
        several = turning.scan(scene, [start, start], until=[start, end], organized=True, resolution=1)
        alone = turning.scan(scene, start, organized=True, resolution=1)
        np.testing.assert_allclose(several["range"][0], alone["range"], rtol=1e-5)

    def test_instances_that_move(self):
        scene = ballot.Scene(walls(0).triangles(), instances=[turned(0, (10, 0, 0)), turned(0, (500, 0, 0))])
        sensor = sensors.Sensor(ballot.Pattern(np.tile(np.float32([1, 0, 0]), (40, 1))), times=np.linspace(0, 1, 40))
        start, end = turned(0, (10, 0, 0)), turned(0, (14, 0, 0))
        truth = 10 + 4 * np.linspace(0, 1, 40)
        for slices in (1, 8, 64):
            move = sensors.Motion(0, start, end, slices)
            found = sensor.scan(scene, motion=move, fields=("x",))["x"]
            self.assertLessEqual(float(abs(found - truth).max()), 4 / (2 * slices) + 1e-5)
            self.assertEqual(scene.instances[0].transform[0, 3], 14)
        self.assertEqual(scene.instances[1].transform[0, 3], 500)
        both = sensors.Motion([0, 1], [start, end], [turned(1.0, (10, 0, 0)), end], 4)
        found = sensor.scan(scene, np.tile(start[None], (2, 1, 1)) * [[[1], [1], [1]]], motion=both, organized=True)
        self.assertEqual(found.shape, (2, 40))


class Clouds(unittest.TestCase):
    def test_plain_structs(self):
        scene, sensor = walls(4), sensors.spinning([-0.1, 0.1], 16)
        cloud = sensor.scan(scene)
        self.assertEqual(cloud.dtype, sensors.point_dtype())
        made = sensors.PointCloud2.of(cloud)
        self.assertEqual((made.height, made.width, made.is_dense, made.is_bigendian), (1, len(cloud), True, False))
        self.assertEqual([f.name for f in made.fields], list(cloud.dtype.names))
        self.assertEqual(dict((f.name, f.datatype) for f in made.fields), {
            "x": 7, "y": 7, "z": 7, "range": 7, "intensity": 7, "ring": 4, "time": 7, "id": 6})  # fmt: skip
        self.assertEqual((len(made.data), made.row_step), (cloud.nbytes, cloud.nbytes))
        np.testing.assert_array_equal(made.points(), cloud)
        whole = sensors.PointCloud2.of(sensor.scan(scene, organized=True))
        self.assertEqual((whole.height, whole.width, whole.is_dense), (2, 16, False))
        self.assertEqual(whole.points().shape, (2, 16))
        x = np.frombuffer(whole.data, "<f4", offset=whole.fields[0].offset)[:: whole.point_step // 4]
        np.testing.assert_array_equal(x, whole.points()["x"].reshape(-1))
        self.assertEqual(sensors.PointCloud2.of(cloud[:0]).width, 0)
        packed = np.zeros(3, [("rgb", "<f4", 3), ("label", "i1")])
        rgb, label = sensors.PointCloud2.of(packed).fields
        self.assertEqual((rgb, label), (sensors.PointField("rgb", 0, 7, 3), sensors.PointField("label", 12, 1)))
        for wrong in (np.zeros(3), [1, 2], np.zeros(2, [("a", "<i8")]), np.zeros(2, [("a", ">f4")])):
            with self.assertRaisesRegex(TypeError, "points: f"):
                sensors.PointCloud2.of(wrong)


class BadInput(unittest.TestCase):
    def test_sensors(self):
        pattern, camera = ahead(0.0, 1.0), ballot.Camera.pinhole(4, 3, fov=1)
        for error, text, call in (
            (ValueError, r"shape is \(0,\): no beams", lambda: sensors.Sensor(ballot.Pattern(np.zeros((0, 3))))),
            (ValueError, r"shape is \(\): no beams", lambda: sensors.Sensor(ballot.Pattern([1.0, 0, 0]))),
            (ValueError, r"\(0, 1800\): no beams", lambda: sensors.spinning([])),
            (TypeError, "pattern: found ndarray", lambda: sensors.Sensor(np.zeros((2, 3)))),
            (ValueError, "divergence is -0.1", lambda: sensors.Sensor(pattern, divergence=-0.1)),
            (ValueError, "rays is 0", lambda: sensors.Sensor(pattern, rays=0)),
            (TypeError, "rays: found float", lambda: sensors.Sensor(pattern, rays=2.5)),
            (ValueError, "near and far are 5 and 2", lambda: sensors.Sensor(pattern, near=5, far=2)),
            (ValueError, "near and far are -1", lambda: sensors.Sensor(pattern, near=-1)),
            (ValueError, "noise is -1", lambda: sensors.Sensor(pattern, noise=-1)),
            (ValueError, "rings: found float64", lambda: sensors.Sensor(pattern, rings=np.zeros(2))),
            (ValueError, "rings: found int64", lambda: sensors.Sensor(pattern, rings=np.array([0, 70000]))),
            (ValueError, r"rings: shape is \(3,\)", lambda: sensors.Sensor(pattern, rings=np.zeros(3, int))),
            (ValueError, "times: one is negative", lambda: sensors.Sensor(pattern, times=[0, -1])),
            (TypeError, "times: dtype is bool", lambda: sensors.Sensor(pattern, times=np.zeros(2, bool))),
            (ValueError, r"times: shape is \(4, 1\)", lambda: sensors.Sensor(camera, times=np.zeros((4, 1)))),
            (ValueError, "period is 0.5; expected at least 1", lambda: sensors.Sensor(pattern, times=1, period=0.5)),
            (ValueError, "offsets: found 2", lambda: sensors.spinning([0, 1, 2], offsets=[0, 1])),
            (ValueError, "elevations: shape is", lambda: sensors.spinning([[0.0]])),
            (ValueError, "columns is 0", lambda: sensors.spinning([0], 0)),
            (ValueError, "period is -1", lambda: sensors.spinning([0], period=-1)),
            (ValueError, "horizontal and vertical", lambda: sensors.solid_state(2, 2, vertical=4)),
            (ValueError, "cone is 0", lambda: sensors.rosette(9, cone=0)),
        ):  # fmt: skip
            with self.subTest(text), self.assertRaisesRegex(error, text):
                call()

    def test_scans(self):
        scene, sensor, one = walls(4), sensors.Sensor(ahead(0.0)), np.eye(3, 4)
        placed = ballot.Scene(walls(4).triangles(), instances=[one])
        for error, text, options in (
            (ValueError, "returns is 0; expected 1 to 16", {"returns": 0}),
            (ValueError, "returns is 1000; expected 1 to 16", {"returns": 1000}),
            (ValueError, "returns is 'most'", {"returns": "most"}),
            (TypeError, "returns: found float", {"returns": 2.0}),
            (ValueError, "depth is 17", {"depth": 17}),
            (ValueError, "resolution is -1", {"resolution": -1}),
            (ValueError, "fields: found 'colour'; expected some of x, y", {"fields": ("x", "colour")}),
            (ValueError, "fields: found 'x' twice", {"fields": ("x", "xyz")}),
            (ValueError, "fields: found none", {"fields": ()}),
            (ValueError, "frame is 'world'", {"frame": "world"}),
            (ValueError, "columns: found 'gray'", {"reflectance": "gray"}),
            (TypeError, "first: found an argument that scans do not take", {"first": 2}),
            (TypeError, "colour: found an argument that is no option", {"colour": 2}),
            (ValueError, r"poses: shape is \(3, 3\)", {"poses": np.eye(3)}),
            (TypeError, "poses: dtype is int64", {"poses": np.eye(4, dtype=np.int64)}),
            (ValueError, r"poses: matrix \[1\] scales", {"poses": [one, 2 * one]}),
            (TypeError, "poses: found None beside until", {"until": one}),
            (ValueError, r"until: shape is \(1, 3, 4\)", {"poses": one, "until": [one]}),
            (ValueError, "from start to end is half a turn", {"poses": one, "until": turned(np.pi)}),
            (ValueError, r"groups: shape is \(2,\)", {"poses": [one] * 3, "groups": [0, 1]}),
            (ValueError, "masks: found float64", {"masks": 0.5}),
            (ValueError, "seed is -1", {"seed": -1}),
            (TypeError, "motion: found int", {"motion": 1}),
            (ValueError, "slices is 0", {"motion": sensors.Motion(0, one, one, 0)}),
            (ValueError, "motion: from start to end: matrix", {"motion": sensors.Motion(0, one, 2 * one)}),
            (ValueError, "start cannot be inverted", {"motion": sensors.Motion(0, 0 * one, one)}),
        ):  # fmt: skip
            with self.subTest(text), self.assertRaisesRegex(error, text):
                sensor.scan(placed if "motion" in options else scene, **options)
        pair = walls(4, attributes=[{"pair": ballot.Attribute([1, 2], "mesh")}])
        with self.assertRaisesRegex(ValueError, "reflectance: attribute 'pair' has 2 numbers; expected one"):
            sensor.scan(pair, reflectance="pair")
        with self.assertRaisesRegex(TypeError, "scene: found RaycastingScene"):
            sensor.scan(ballot.RaycastingScene())
        lost = np.full((3, 4), np.nan)
        self.assertEqual(len(sensor.scan(scene, [lost, one], until=[lost, one])), 1)
        self.assertEqual(len(sensor.scan(scene, [lost, one])), 1)


if __name__ == "__main__":
    unittest.main()
