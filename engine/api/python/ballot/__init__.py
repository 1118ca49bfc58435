"""Ballot: fast, correct ray queries by Vulkan compute, on GPUs without ray tracing hardware and on CPUs.

    import ballot
    scene = ballot.Scene(vertices, triangles)     # (n, 3) float32, (m, 3) uint32
    hits = scene.trace(rays)                      # (..., 6) or (..., 8) float32 -> ballot.HIT: t, prim, u, v
    blocked = scene.occluded(rays)                # -> bool
    image = ballot.render(scene, width=640, height=480)

Devices   Device opens one; without it, everything shares default_device(): the best GPU, else a CPU device.
Shapes    spheres, discs, capsules, boxes, heights stand where a mesh is asked for. Attribute is numbers of a mesh,
          which answers have as columns.
Scenes    Scene, load_scene; Scene.set_vertices moves vertices, Scene.set_time plays animations; a Job traces meanwhile.
Open3D    RaycastingScene has the names, shapes, dtypes and miss values of Open3D's class.
trimesh   trimesh_ray.RayMeshIntersector is in the style of trimesh.ray.
On GPUs   Array holds rays or hits on the device; CUDA's libraries fill and read it without a copy.
Kernels   Kernel is GLSL of yours that asks a scene, as often as it likes, for each index of a run.
Sensors   sensors has lidar, depth cameras and panoramas, whose scans are point clouds.
Pictures  render returns a Picture, an array that to_png() writes and notebooks show.
Rays      Camera, lidar, hemisphere: tables of rays, which trace(table, poses=T) moves; grid: points of three axes.
Speed     bench measures methods.
Trouble   `python -m ballot` prints devices, versions and caches, and tests itself: the start of every bug report.

Names     names() lists methods, numeric modes, builders, ray kinds and shadings.

Units     Lengths are in scene units, angles in radians. t counts multiples of a ray's direction.
Errors    ValueError and TypeError for wrong arguments; Error, a RuntimeError with a code, for failures of device
          and files, and for objects that were closed or made before fork(). A call with wrong arguments writes nothing;
          one that fails later, or is interrupted, may have written a part. PrecisionWarning where rounding float64 to
          float32 moves a vertex by more than 2^-20 of its mesh's size.
Threads   Everything may be called from any thread. Calls on one device run one after another, and let other threads of
          Python run meanwhile.
"""


def _refuse_subinterpreter() -> None:
    """Raises ImportError in a sub-interpreter: the extension has one state for the whole process."""
    import sys
    from importlib import import_module

    try:
        interpreters = import_module("_interpreters" if sys.version_info >= (3, 13) else "_xxsubinterpreters")
    except ImportError:
        return
    here, main = interpreters.get_current(), interpreters.get_main()
    if (here[0] if isinstance(here, tuple) else here) != (main[0] if isinstance(main, tuple) else main):
        raise ImportError(
            "ballot cannot be imported in a sub-interpreter; import it in the main one, or use processes instead"
        )


_refuse_subinterpreter()

try:
    from . import _ballot
except ImportError as error:
    if "cannot open shared object file" not in str(error):
        raise
    raise ImportError(
        f"{error}. This package was built here and takes libraries of the system. On Debian 12: apt install "
        "libembree3-3 libfmt9 libmeshoptimizer2d libopenexr-3-1-30 libpng16-16 libspirv-cross-c-shared0 libstb0 "
        "libtinygltf2d libwebp7; a wheel of `tools/dev.py wheel` holds them"
    ) from error

from . import sensors, trimesh_ray
from ._array import Array
from ._arrays import HIT, MISS, RAY, SHARED
from ._attributes import Attribute
from ._ballot import commit, names, version
from ._bench import bench
from ._cameras import Camera
from ._device import Device, default_device, devices
from ._door import AnimationInfo as Animation
from ._door import Code, DeviceInfo, InputInfo, InstanceInfo, MeshInfo, SceneInfo, Times
from ._errors import Error, PrecisionWarning
from ._job import Job
from ._kernel import Kernel
from ._listed import DeviceLists, Lists
from ._load import load_scene
from ._patterns import Grid, Pattern, frames, grid, hemisphere, lidar
from ._picture import Picture, render
from ._raycasting import RaycastingScene
from ._scene import Scene
from ._shapes import Shapes, boxes, capsules, discs, heights, spheres

__version__ = version()

__all__ = [
    "HIT",
    "MISS",
    "SHARED",
    "RAY",
    "Animation",
    "Array",
    "Attribute",
    "Camera",
    "Code",
    "Device",
    "DeviceInfo",
    "DeviceLists",
    "Error",
    "Grid",
    "InputInfo",
    "InstanceInfo",
    "Job",
    "Kernel",
    "Lists",
    "MeshInfo",
    "Pattern",
    "Picture",
    "PrecisionWarning",
    "RaycastingScene",
    "Scene",
    "SceneInfo",
    "Shapes",
    "Times",
    "bench",
    "boxes",
    "capsules",
    "commit",
    "default_device",
    "devices",
    "discs",
    "frames",
    "grid",
    "heights",
    "hemisphere",
    "lidar",
    "load_scene",
    "names",
    "render",
    "sensors",
    "spheres",
    "trimesh_ray",
    "version",
]
