"""Scenes from files."""

from __future__ import annotations

import os

from . import _scene_arguments
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
) -> Scene:
    """Loads a glTF 2.0 (.gltf, .glb), OBJ, PLY or STL file: one mesh of id 0, with the file's cameras and materials.

    instances    meshes that a glTF file uses several times. "keep": each is there once, as are meshes that an animation
                 moves as a whole; such a scene takes no queries of points and crossings. "copy": each use is a moved
                 copy. "auto": kept where that saves 4 million triangles and half of the scene's, or where copies would
                 not fit into memory. Hits have the same numbers in all three.

    Other arguments as Scene. Raises Error, which names file and place, if the file cannot be read. Pickling the scene
    stores the path and the time that was set.
    """
    scene = Scene.__new__(Scene)
    name = os.path.abspath(os.fsdecode(path))
    options = _scene_arguments.options(builder, max_leaf, split_budget, cache, "auto", 0, instances)
    scene.__setstate__({"device": device, "options": options, "path": name})
    return scene
