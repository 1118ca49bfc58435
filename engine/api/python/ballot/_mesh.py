"""Meshes as people have them: arrays, and the classes of trimesh and Open3D."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from . import _arrays, _query


class Mesh(NamedTuple):
    """A mesh as the extension takes it, with copies of its own of what a pickled scene needs."""

    vertices: np.ndarray  # (n, 3) float32
    indices: np.ndarray | None  # (3 m,) uint16 or uint32
    id: int
    normals: np.ndarray | None  # (n, 3) float32


def parts(given: Any, name: str) -> tuple[Any, Any]:
    """Returns vertices and triangles of a pair, or of a mesh of trimesh or Open3D."""
    if isinstance(given, (tuple, list)) and len(given) == 2:
        return given[0], given[1]
    if hasattr(given, "vertex") and hasattr(given, "triangle"):  # open3d.t.geometry.TriangleMesh
        return given.vertex.positions, given.triangle.indices
    if hasattr(given, "vertices") and hasattr(given, "faces"):  # trimesh.Trimesh
        return np.asarray(given.vertices), np.asarray(given.faces)
    if hasattr(given, "vertices") and hasattr(given, "triangles"):  # open3d.geometry.TriangleMesh
        return np.asarray(given.vertices), np.asarray(given.triangles)
    raise TypeError(
        f"{name}: found {type(given).__name__}; expected (vertices, triangles), or a mesh of trimesh or Open3D"
    )


def vectors(given: Any, name: str) -> np.ndarray:
    """Returns (n, 3) float32 that the library can read."""
    array = _arrays.floats(given, name, (3,))
    if array.ndim != 2:
        raise ValueError(f"{name}: shape is {array.shape}; expected (n, 3)")
    return _arrays.rows(array)


def _own(array: np.ndarray, given: Any) -> np.ndarray:
    """Returns the array itself if it was made here, else a copy."""
    return array.copy() if array is given or array.base is not None or not array.flags.owndata else array


def make(vertices: Any, triangles: Any, mesh_id: Any, normals: Any, where: str) -> Mesh:
    v = vectors(vertices, f"{where}: vertices")
    if len(v) == 0:
        raise ValueError(f"{where}: vertices: shape is {v.shape}: none; leave empty meshes out")
    t = None if triangles is None else _arrays.indices(triangles, f"{where}: triangles")
    n = None
    if normals is not None:
        n = vectors(normals, f"{where}: normals")
        if n.shape != v.shape:
            raise ValueError(f"{where}: normals: shape is {n.shape}; expected {v.shape}, one for each vertex")
        v, n = _arrays.contiguous(v), _arrays.contiguous(n)
    return Mesh(v, t, _query.integer(mesh_id, f"{where}: id", 0, 0xFFFFFFFF), n)


def kept(mesh: Mesh, triangles: Any, normals: Any) -> Mesh:
    """Returns the mesh without its vertices, which the scene can tell, and with arrays that nobody else changes."""
    return Mesh(
        np.empty((len(mesh.vertices), 0), np.float32),
        None if mesh.indices is None else _own(mesh.indices, triangles),
        mesh.id,
        None if mesh.normals is None else _own(mesh.normals, normals),
    )


def readable(parts: Iterable[Any]) -> tuple[Any, ...]:
    """Returns what came from another process with arrays that the library can read: there they lie at any address."""
    return tuple(_arrays.contiguous(part) if isinstance(part, np.ndarray) else part for part in parts)


def restored(mesh: Mesh, corners: np.ndarray) -> Mesh:
    """Returns the mesh with vertices again, from the corners (m, 3, 3) of its triangles."""
    corners = corners.reshape(-1, 3)
    if mesh.indices is None:
        vertices = corners.copy()
    else:
        vertices = np.zeros((len(mesh.vertices), 3), np.float32)  # those of no triangle stay zero
        vertices[mesh.indices] = corners
    return mesh._replace(vertices=vertices)


def transforms(given: Any) -> np.ndarray:
    """Returns (k, 12) float32 of matrices (k, 3, 4) or (k, 4, 4), whose last row is left out."""
    array = _arrays.floats(given, "instances", (4,))
    if array.ndim != 3 or array.shape[1] not in (3, 4):
        raise ValueError(f"instances: shape is {array.shape}; expected (k, 3, 4) or (k, 4, 4)")
    return np.array(array[:, :3], np.float32, order="C").reshape(-1, 12)


def instances(given: Any, meshes: Any) -> tuple[np.ndarray, ...]:
    """Returns what the extension takes besides the meshes: nothing, or matrices and the numbers of their meshes."""
    if given is None:
        if meshes is not None:
            raise ValueError("instance_meshes: there are no instances; expected None")
        return ()
    matrices = transforms(given)
    if meshes is None:
        return matrices, np.zeros(len(matrices), np.uint32)
    numbers = _arrays.as_numpy(meshes, "instance_meshes")
    if numbers.size == 0:
        numbers = numbers.astype(np.uint32)
    if numbers.dtype.kind not in "iuf" or numbers.shape != (len(matrices),):
        raise ValueError(
            f"instance_meshes: shape is {numbers.shape}, dtype {numbers.dtype}; expected {len(matrices)} integers"
        )
    wrong = np.nonzero((numbers < 0) | (numbers > 0xFFFFFFFF) | (numbers != np.floor(numbers)))[0]
    if len(wrong):
        raise ValueError(f"instance_meshes: number {wrong[0]} is {numbers[wrong[0]]}; expected the index of a mesh")
    return matrices, _arrays.contiguous(numbers, np.uint32)
