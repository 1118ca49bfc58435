"""Information about a scene, its meshes and its animations."""

from __future__ import annotations

from typing import NamedTuple


class SceneInfo(NamedTuple):
    """What a scene holds, and its tree."""

    triangles: int
    degenerate: int  # triangles without area; never hit
    meshes: int
    views: int
    lo: tuple[float, float, float]  # the bounds; zero if the scene is empty
    hi: tuple[float, float, float]
    nodes: int
    leaves: int
    depth: int
    sah: float  # expected cost of a random ray that meets the bounds; 0 with instances
    build_seconds: float  # of the last build of the tree
    instances: int  # of a scene of instances, or of meshes that a file's scene keeps once; else 0
    instance_triangles: int  # counted through all instances
    top_seconds: float  # of the last build or refit of the tree over the instances
    decay: float  # sah divided by that at the last build: traces are slower by about this factor
    update_seconds: float  # of the last update of vertices or time
    refits: int  # such updates since the last build


class Animation(NamedTuple):
    """An animation of a scene that was loaded from a glTF file."""

    name: str
    seconds: float  # its times are 0 to this
    channels: int  # number of node properties that it moves


class MeshInfo(NamedTuple):
    """A mesh of a scene.

    Its triangles are first to first + triangles - 1 of Scene.triangles(), and of HIT's prim unless the scene has
    instances.
    """

    id: int
    first: int
    triangles: int
