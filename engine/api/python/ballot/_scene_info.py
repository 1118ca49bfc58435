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
    sah: float  # expected cost of a random ray that meets the bounds
    build_seconds: float  # of the last build of the tree
    instances: int  # 0: not a scene of instances
    instance_triangles: int  # counted through all instances
    top_seconds: float  # of the last build or refit of the tree over the instances
    decay: float  # sah over that at the last build: about how much slower traces have become
    update_seconds: float  # of the last update
    refits: int  # updates since the last build


class Animation(NamedTuple):
    """An animation of a scene that was loaded from a glTF file."""

    name: str
    seconds: float  # its times are 0 to this
    channels: int  # what it moves; 0: nothing


class MeshInfo(NamedTuple):
    """A mesh of a scene: its triangles have the numbers first to first + triangles - 1 in HIT's prim."""

    id: int
    first: int
    triangles: int
