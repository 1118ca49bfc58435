"""Meshes as arrays: checked, converted, placed."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from . import _arrays, _errors, _query
from ._scene_info import InstanceInfo, MeshInfo


class Mesh(NamedTuple):
    """A mesh as the extension takes it, with copies of its own of what a pickled scene needs."""

    vertices: np.ndarray  # (n, 3) float32
    indices: np.ndarray | None  # (3 m,) uint16 or uint32
    id: int
    normals: np.ndarray | None  # (n, 3) float32


def vectors(given: Any, name: str) -> np.ndarray:
    """Returns (n, 3) float32 that the library can read."""
    array = _arrays.floats(given, name, (3,))
    if array.ndim != 2:
        raise ValueError(f"{name}: shape is {array.shape}; expected (n, 3)")
    return _arrays.rows(array)


def positions(given: Any, name: str, corners: bool = False) -> np.ndarray:
    """Returns vertices as vectors() does, and warns if float32 moves one by too much. `corners`: (m, 3, 3), of
    triangles, are taken too."""
    array = _arrays.as_numpy(given, name)
    if corners and array.ndim == 3 and array.shape[1:] == (3, 3):
        array = array.reshape(-1, 3)
    rounded = vectors(array, name)
    far = rounding(array, rounded)
    if far is not None:
        _errors.warn(f"{name}: {far}")
    return rounded


_MOST_MOVED = 2.0**-20  # of a mesh's size: more is told


def rounding(array: np.ndarray, rounded: np.ndarray) -> str | None:
    """Returns a text about the vertex (n, 3) that float32 moves most, if that is more than 2^-20 of the mesh's size."""
    if len(array) == 0 or array.dtype.itemsize <= 4:
        return None
    with np.errstate(all="ignore"):
        most = 2.0**-23 * max(abs(float(array.min())), abs(float(array.max()))) + 2.0**-148  # that float32 moves one
        for part in (array[:: 1 + len(array) // 4096], array):  # some suffice to tell that a mesh is large
            low, high = part.min(axis=0), part.max(axis=0)
            size = float((high - low).max())
            if most <= _MOST_MOVED * size:
                return None
        if not 0 < size < np.inf:
            return None
        moved = np.linalg.norm(array - rounded, axis=1)
    vertex = int(moved.argmax())
    if not moved[vertex] > _MOST_MOVED * size:
        return None
    middle = ", ".join(f"{x:.9g}" for x in low / 2 + high / 2)
    return (
        f"float32 moves vertex {vertex} by {moved[vertex]:.3g}, which is {moved[vertex] / size:.1e} of the mesh's size "
        f"of {size:.6g} (above 2^-20), so answers may be others; subtract its middle ({middle}) from vertices, rays "
        "and points in float64 first, or place the mesh near the origin"
    )


def _own(array: np.ndarray, given: Any) -> np.ndarray:
    """Returns the array itself if it was made here, else a copy."""
    return array.copy() if array is given or array.base is not None or not array.flags.owndata else array


def make(vertices: Any, triangles: Any, mesh_id: Any, normals: Any, where: str, soup: bool) -> Mesh:
    """Returns a mesh of checked arrays. `soup`: every three rows of vertices without triangles are one."""
    corners = triangles is None
    v = positions(vertices, f"{where}: vertices", corners)
    if len(v) == 0:
        raise ValueError(f"{where}: vertices: shape is {v.shape}: none; leave empty meshes out")
    if corners and not soup and _arrays.as_numpy(vertices, where).ndim == 2:
        raise ValueError(
            f"{where}: vertices: shape is {v.shape}, and there are no triangles; pass their indices (m, 3), or corners "
            "(m, 3, 3), or soup=True if every three vertices are a triangle"
        )
    t = None if corners else _arrays.indices(triangles, f"{where}: triangles")
    n = None
    if normals is not None:
        given = _arrays.as_numpy(normals, f"{where}: normals")
        n = vectors(given.reshape(-1, 3) if corners and given.shape[1:] == (3, 3) else given, f"{where}: normals")
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


def boxes(meshes: list[Mesh]) -> tuple[np.ndarray, np.ndarray]:
    """Returns the middle and half the size of the bounds of each mesh: (m, 3) float64 both."""
    bounds = np.array([(m.vertices.min(axis=0), m.vertices.max(axis=0)) for m in meshes], np.float64).reshape(-1, 2, 3)
    return bounds.mean(axis=1), (bounds[:, 1] - bounds[:, 0]) / 2


def places(
    instances: list[InstanceInfo], meshes: list[MeshInfo]
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Returns the mesh of each instance, and what boxes() returns of the meshes."""
    bounds = np.array([(m.lo, m.hi) for m in meshes], np.float64).reshape(-1, 2, 3)
    which = np.array([i.mesh for i in instances], np.uint32)
    return which, (bounds.mean(axis=1), (bounds[:, 1] - bounds[:, 0]) / 2)


def shrunk(placed: np.ndarray, which: list[bool]) -> np.ndarray:
    """Returns matrices (k, 12) of which some are so small that any vertices can be placed."""
    matrices = np.array(placed, np.float32).reshape(-1, 3, 4)
    matrices[which] = np.eye(3, 4, dtype=np.float32) * np.float32(1e-12)
    return matrices.reshape(-1, 12)


def transforms(given: Any, which: np.ndarray, bounds: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Returns (k, 12) float32 of matrices (k, 3, 4) or (k, 4, 4), whose last row is left out. Warns if float32 moves an
    instance by too much: `which` is the mesh of each, `bounds` what boxes() returned."""
    array = _arrays.as_numpy(given, "instances")
    rounded = _arrays.floats(array, "instances", (4,))
    if array.ndim != 3 or array.shape[1] not in (3, 4):
        raise ValueError(f"instances: shape is {array.shape}; expected (k, 3, 4) or (k, 4, 4)")
    matrices = np.array(rounded[:, :3], np.float32, order="C")
    if array.dtype.itemsize > 4 and len(array) == len(which) and np.all(which < len(bounds[0])):
        _warn_of_places(array[:, :3].astype(np.float64), matrices, *(each[which] for each in bounds))
    return matrices.reshape(-1, 12)


def _warn_of_places(given: np.ndarray, rounded: np.ndarray, middle: np.ndarray, half: np.ndarray) -> None:
    """Warns if float32 moves an instance, of a mesh with these bounds, by more than 2^-20 of its size."""
    with np.errstate(all="ignore"):
        wrong = given - rounded
        shift = np.einsum("kij,kj->ki", wrong[..., :3], middle) + wrong[..., 3]
        moved = (np.abs(shift) + np.einsum("kij,kj->ki", np.abs(wrong[..., :3]), half)).max(axis=1, initial=0)
        size = 2 * np.einsum("kij,kj->ki", np.abs(given[..., :3]), half).max(axis=1, initial=0)
        share = np.where((size > 0) & np.isfinite(size), moved / size, 0)
    if not (share > _MOST_MOVED).any():
        return
    worst, places = int(share.argmax()), given[..., 3]
    origin = ", ".join(f"{x:.9g}" for x in places.min(axis=0) / 2 + places.max(axis=0) / 2)
    _errors.warn(
        f"instances: float32 moves instance {worst} by {moved[worst]:.3g}, which is {share[worst]:.1e} of its size of "
        f"{size[worst]:.6g} (above 2^-20), so answers may be others; subtract ({origin}) from the last column of the "
        "matrices, from rays and points in float64 first"
    )


def instances(given: Any, meshes: Any, bounds: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, ...]:
    """Returns what the extension takes besides the meshes: nothing, or matrices and the numbers of their meshes."""
    if given is None:
        if meshes is not None:
            raise ValueError("instance_meshes: there are no instances; expected None")
        return ()
    matrices = _arrays.as_numpy(given, "instances")
    count = len(matrices) if matrices.ndim else 0
    if meshes is None:
        which = np.zeros(count, np.uint32)
        return transforms(matrices, which, bounds), which
    numbers = _arrays.as_numpy(meshes, "instance_meshes")
    if numbers.size == 0:
        numbers = numbers.astype(np.uint32)
    if numbers.dtype.kind not in "iuf" or numbers.shape != (count,):
        raise ValueError(
            f"instance_meshes: shape is {numbers.shape}, dtype {numbers.dtype}; expected {count} integers"
        )
    wrong = np.nonzero((numbers < 0) | (numbers > 0xFFFFFFFF) | (numbers != np.floor(numbers)))[0]
    if len(wrong):
        raise ValueError(f"instance_meshes: number {wrong[0]} is {numbers[wrong[0]]}; expected the index of a mesh")
    which = _arrays.contiguous(numbers, np.uint32)
    return transforms(matrices, which, bounds), which
