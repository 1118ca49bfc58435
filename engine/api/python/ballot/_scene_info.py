"""Information about a scene, its meshes and its animations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class SceneInfo(NamedTuple):
    """What a scene holds, and its tree."""

    triangles: int  #: of all meshes
    degenerate: int  #: triangles without area; never hit
    meshes: int  #: how many there are
    views: int  #: how many there are
    lo: tuple[float, float, float]  #: the bounds; zero if the scene is empty
    hi: tuple[float, float, float]  #: as lo
    nodes: int  #: of the tree; of all trees if there are several
    leaves: int  #: as nodes
    depth: int  #: of the tree; of the deepest one if there are several
    sah: float  #: expected cost of a random ray that meets the bounds; 0 of several trees
    build_seconds: float  #: of the last build of the tree
    instances: int  #: how many there are
    instance_triangles: int  #: counted through all instances
    top_seconds: float  #: of the last build or refit of the tree over the instances
    decay: float  #: sah divided by that at the last build: traces are slower by about this factor
    update_seconds: float  #: of the last commit or change of time
    refits: int  #: such updates since the last build
    trees: int  #: below the tree over the instances; 0: one tree over all, in the world


class Animation(NamedTuple):
    """An animation of a scene that was loaded from a glTF file."""

    name: str  #: as in the file
    seconds: float  #: its times are 0 to this
    channels: int  #: number of node properties that it moves


class MeshInfo(NamedTuple):
    """A mesh of a scene. Its triangles are first to first + triangles - 1 of Scene.triangles()."""

    name: str  #: as in the file, else "mesh N", or "scene" of one mesh; cut off after 255 bytes
    id: int  #: as the scene was made with, or of the mesh or group in the file
    first: int  #: number of its first triangle
    triangles: int  #: how many it has
    lo: tuple[float, float, float]  #: its bounds, in its own space; zero if it has no triangle
    hi: tuple[float, float, float]  #: as lo
    mesh: int  #: its number


class InstanceInfo(NamedTuple):
    """An instance of a mesh. Its triangles are first to first + triangles - 1 of HIT's prim."""

    name: str  #: of its node in the file, else of its mesh; cut off after 255 bytes
    id: int  #: its node in the file; else its own number
    mesh: int  #: number of its mesh
    first: int  #: number of its first triangle
    triangles: int  #: how many it has
    transform: np.ndarray  #: (3, 4) float32, as Scene takes it
    lo: tuple[float, float, float]  #: a box in the world that holds it; zero if it has no triangle
    hi: tuple[float, float, float]  #: as lo
    instance: int  #: its number
    mask: int  #: as Scene.set_masks() says
