"""Scenes from files."""

from __future__ import annotations

import os

import numpy as np

from . import _errors, _scene_arguments
from ._device import Device
from ._scene import Scene


def load_scene(
    path: str | os.PathLike[str],
    device: Device | None = None,
    *,
    builder: str = "best",
    max_leaf: int = 6,
    split_budget: float = 0.5,
    cache: bool = True,
    instances: str = "auto",
    ids: str = "mesh",
    updates: str = "auto",
    layout: str = "auto",
) -> Scene:
    """Loads a glTF 2.0 (.gltf, .glb), OBJ, PLY or STL file, with its cameras and materials.

    instances    meshes that a glTF file uses several times. "keep": each is there once, as are meshes that an animation
                 moves as a whole. "copy": each use is a moved copy. "auto": kept where that saves 4 million triangles
                 and half of the scene's, or where copies would not fit into memory. HIT's prim is the same in all three
    ids          what the column "mesh_ids" holds, by the numbers of the file. "mesh": the mesh of glTF, the group of
                 OBJ; 0 where a file has one mesh. "node": the node of glTF, else as "mesh". "material": the material

    Scene.meshes lists the nodes of glTF that place triangles, or the groups of OBJ, else the whole; Scene.instances
    where they lie.

    Other arguments as Scene. Gives a PrecisionWarning if the file lies so far from the origin that float32 rounds its
    numbers by more than 2^-20 of the scene's size. Raises Error, which names file and place, if the file cannot be
    read. Pickling the scene stores the path, the time that was set, and what was
    moved.
    """
    scene = Scene.__new__(Scene)
    name = os.path.abspath(os.fsdecode(path))
    options = _scene_arguments.options(builder, max_leaf, split_budget, cache, updates, 0, instances, ids, layout)
    scene._load(name, device, options)
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
