"""Scenes from files."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from . import _errors, _scene_arguments
from ._device import Device
from ._door import FileOptions, documented
from ._scene import Scene

if TYPE_CHECKING:
    from typing_extensions import Unpack


@documented
def load_scene(
    path: str | os.PathLike[str], device: Device | None = None, **options: Unpack[FileOptions]
) -> Scene:
    """Loads a glTF 2.0 (.gltf, .glb), OBJ, PLY, STL or NumPy file, with its cameras and materials.

    {files_options}

    Scene.meshes lists the nodes of glTF that place triangles, or the groups of OBJ, else the whole; Scene.instances
    where they lie.

    The tree is kept on disk unless `cache` is False. Gives a PrecisionWarning if the file lies so far from the origin
    that float32 rounds its numbers by more than 2^-20 of the scene's size. Raises Error, which names file and place, if
    the file cannot be read. Pickling the scene stores the path, the time that was set, and what was moved.
    """
    scene = Scene.__new__(Scene)
    name = os.path.abspath(os.fsdecode(path))
    options.setdefault("cache", True)
    scene._load(name, device, _scene_arguments.options(options, "files"))
    _warn_of_rounding(scene, name)
    return scene


def _world_corners(scene: Scene) -> np.ndarray:
    """Returns the corners of all triangles where they lie in the world: (n, 3, 3) float32."""
    corners, first = scene.triangles(), {m.mesh: m.first for m in scene.meshes}
    if not scene.info.trees:
        return corners
    parts = [corners[:0]]
    for i in scene.instances:
        own = corners[first[i.mesh] :][: i.triangles].astype(np.float64)
        parts.append((own @ i.transform[:, :3].T.astype(np.float64) + i.transform[:, 3]).astype(np.float32))
    return np.concatenate(parts)


def _warn_of_rounding(scene: Scene, path: str) -> None:
    """Warns as the program's note does: vertices that use all bits of float32 where it is coarse were rounded."""
    low, high = np.array(scene.info.lo, np.float64), np.array(scene.info.hi, np.float64)
    size, reach = float((high - low).max()), float(np.abs([low, high]).max())
    moved = float(np.spacing(np.float32(reach))) / 2
    if not 0 < size * 2.0**-20 < moved:
        return
    corners = _world_corners(scene)
    if not (corners.view(np.uint32)[np.abs(corners) >= 2.0 ** np.floor(np.log2(reach))] & 1).any():
        return
    middle = ", ".join(f"{x:.9g}" for x in (low + high) / 2)
    _errors.warn(
        f"{path}: far from the origin, up to {reach:.9g}, float32 rounds coordinates by up to {moved:.3g}, which is "
        f"{moved / size:.1e} of its size of {size:.6g}; subtract ({middle}) from its vertices before you save it"
    )
