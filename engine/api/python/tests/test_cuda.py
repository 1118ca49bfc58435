"""Arrays that CUDA fills and reads, by its driver's interface through ctypes. Skipped without a GPU of NVIDIA."""

import ctypes
import unittest

import ballot
import numpy as np
import reference as ref


class Cuda(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        info = ballot.default_device().info
        if info.is_cpu or not info.exports:
            raise unittest.SkipTest(f"{info.name} does not share memory with CUDA")
        try:
            cls.cuda = ctypes.CDLL("libcuda.so.1")
        except OSError as error:
            raise unittest.SkipTest(str(error)) from None
        cls.scene = ballot.Scene(*ref.soup(200))
        six = ref.random_rays(1000)
        cls.rays = np.zeros((1000, 8), np.float32)
        cls.rays[:, :3], cls.rays[:, 4:7], cls.rays[:, 7] = six[:, :3], six[:, 3:], 100

    def call(self, name, *arguments):
        self.assertEqual(getattr(self.cuda, name)(*arguments), 0, name)

    def current(self, number):
        """Makes the primary context of a device current."""
        device, context = ctypes.c_int(), ctypes.c_void_p()
        self.call("cuInit", 0)
        self.call("cuDeviceGet", ctypes.byref(device), number)
        self.call("cuDevicePrimaryCtxRetain", ctypes.byref(context), device)
        self.addCleanup(self.cuda.cuDevicePrimaryCtxRelease_v2, device)
        self.call("cuCtxSetCurrent", context)

    def test_rays_from_cuda_hits_to_cuda(self):
        rays, hits = ballot.Array("rays", 1000), ballot.Array("hits", 1000)
        kind, number = rays.__dlpack_device__()
        self.assertEqual(kind, 2)
        self.current(number)
        source = self.rays.ctypes.data_as(ctypes.c_void_p)
        self.call("cuMemcpyHtoD_v2", ctypes.c_uint64(rays.cuda_address), source, ctypes.c_size_t(self.rays.nbytes))
        self.call("cuCtxSynchronize")
        self.scene.trace(rays, out=hits)
        found = np.zeros(1000, ballot.HIT)
        address = hits.__cuda_array_interface__["data"][0]
        self.call(
            "cuMemcpyDtoH_v2",
            found.ctypes.data_as(ctypes.c_void_p),
            ctypes.c_uint64(address),
            ctypes.c_size_t(found.nbytes),
        )
        np.testing.assert_array_equal(found, self.scene.trace(self.rays))

    def test_meshes_from_cuda(self):
        """Vertices and indices of other libraries are copied on the device and checked there."""

        class Other:
            def __init__(self, array, **changes):
                self.__cuda_array_interface__ = array.__cuda_array_interface__ | changes

        v, t = ref.soup(200)
        vertices, indices, masks = ballot.Array("vertices", 600), ballot.Array("uint32", 600), ballot.Array("uint32", 1)
        vertices.write(v)
        indices.write(t.reshape(-1))
        whole = Other(indices, shape=(200, 3), typestr="<i4")
        hits = self.scene.trace(self.rays)
        scene = ballot.Scene(Other(vertices), whole)
        np.testing.assert_array_equal(scene.trace(self.rays), hits)
        np.testing.assert_array_equal(ballot.Scene(Other(vertices, shape=(200, 3, 3))).trace(self.rays), hits)
        np.testing.assert_array_equal(ballot.Scene(v, whole).trace(self.rays), hits)
        masks.write(np.uint32([6]))
        scene.set_masks(None, Other(masks, typestr="<i4"))
        scene.commit()
        self.assertEqual(scene.instances[0].mask, 6)
        indices.write(np.uint32([600]), first=77)
        with self.assertRaisesRegex(ValueError, "index 77 is 600, but there are 600 vertices"):
            ballot.Scene(Other(vertices), whole)
        with self.assertRaisesRegex(TypeError, "int64 on CUDA; expected int32 or uint32"):
            ballot.Scene(Other(vertices), Other(indices, shape=(100, 3), typestr="<i8"))
        with self.assertRaisesRegex(ValueError, "float64"):
            ballot.Scene(Other(vertices, shape=(300, 3), typestr="<f8"), whole)

    def test_points_from_cuda_answers_to_cuda(self):
        points, answers = ballot.Array("points", 1000), ballot.Array("distances", 1000)
        self.current(points.__dlpack_device__()[1])
        given = np.full((1000, 4), np.inf, np.float32)
        given[:, :3] = np.random.default_rng(2).uniform(-2, 2, (1000, 3))
        source = given.ctypes.data_as(ctypes.c_void_p)
        self.call("cuMemcpyHtoD_v2", ctypes.c_uint64(points.cuda_address), source, ctypes.c_size_t(given.nbytes))
        self.call("cuCtxSynchronize")
        how = {"sign": "pseudonormal", "assume_closed": True}
        self.scene.nearest(points, ("signed_distances",), out={"signed_distances": answers}, **how)
        found = np.zeros(1000, np.float32)
        self.assertEqual(answers.__cuda_array_interface__["shape"], (1000,))
        address = ctypes.c_uint64(answers.__cuda_array_interface__["data"][0])
        target = found.ctypes.data_as(ctypes.c_void_p)
        self.call("cuMemcpyDtoH_v2", target, address, ctypes.c_size_t(found.nbytes))
        want = self.scene.nearest(given[:, :3], ("signed_distances",), **how)
        np.testing.assert_array_equal(found, want["signed_distances"])
        self.assertEqual(ballot.Array("inside", 3).__cuda_array_interface__["typestr"], "<u4")

    def test_what_others_see(self):
        array = ballot.Array("hits", 10, exported=True)
        interface = array.__cuda_array_interface__
        self.assertEqual((interface["shape"], interface["typestr"], interface["version"]), ((10, 4), "<f4", 3))
        for arguments in ({}, {"stream": 1}, {"max_version": (1, 0), "dl_device": None, "copy": None}):
            self.assertIn("dltensor", repr(array.__dlpack__(**arguments)))
        with self.assertRaisesRegex(ballot.Error, "GPU's own memory"):
            array.numpy()
        self.assertFalse(hasattr(ballot.Array("hits", 10, exported=False), "__cuda_array_interface__"))
        capsule = array.__dlpack__()
        array.close()  # the capsule keeps the memory
        del capsule


if __name__ == "__main__":
    unittest.main()
