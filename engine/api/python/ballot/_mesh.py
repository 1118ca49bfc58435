"""Meshes as arrays: checked, converted, placed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from . import _arrays, _attributes, _errors, _query
from ._array import Array, there
from ._device import Device
from ._door import MeshInfo


class Mesh(NamedTuple):
    """A mesh, with copies of its own of what a pickled scene needs."""

    vertices: np.ndarray | Array  # (n, 3) float32 or float64; of heights (n,) float32
    indices: np.ndarray | Array | None  # (3 m,) uint16 or uint32
    id: int
    normals: np.ndarray | None  # (n, 3) float32
    kind: str | None = None  # of shapes; None: triangles
    radii: np.ndarray | None = None  # (n,) float32, of shapes
    name: str | None = None
    attributes: tuple[_attributes.Passed, ...] = ()
    origin: tuple[float, float, float] | None = None  # None: the library's choice
    grid: tuple[int, float, float, float, float] | None = None  # of heights: Shapes.grid


def vectors(given: Any, name: str) -> np.ndarray:
    """Returns (n, 3) float32 that the library can read."""
    array = _arrays.floats(given, name, (3,))
    if array.ndim != 2:
        raise ValueError(f"{name}: shape is {array.shape}; expected (n, 3)")
    return _arrays.rows(array)


def raster(given: Any, name: str) -> np.ndarray:
    """Returns heights (rows, columns) float32 that the library can read; masked ones are NaN."""
    if isinstance(given, np.ma.MaskedArray):
        given = np.where(np.ma.getmaskarray(given), np.float32(np.nan), np.ma.getdata(given))
    array = _arrays.as_numpy(given, name)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: dtype is {array.dtype}; expected float32, or other numbers, which are converted")
    if array.ndim != 2 or min(array.shape) < 2:
        raise ValueError(f"{name}: shape is {array.shape}; expected (rows, columns), at least (2, 2)")
    with np.errstate(over="ignore"):  # infinity, which is refused
        return _arrays.contiguous(array, np.float32)


def positions(given: Any, name: str, corners: bool = False) -> np.ndarray:
    """Returns vertices as vectors() does, or float64 as it is: the library counts it from an origin. `corners`:
    (m, 3, 3), of triangles, are taken too."""
    array = _arrays.as_numpy(given, name)
    if corners and array.ndim == 3 and array.shape[1:] == (3, 3):
        array = array.reshape(-1, 3)
    if array.dtype.kind != "f" or array.dtype.itemsize != 8:
        return vectors(array, name)
    array = _arrays.numbers(array, name, (3,))
    if array.ndim != 2:
        raise ValueError(f"{name}: shape is {array.shape}; expected (n, 3)")
    return _arrays.contiguous(array)


def warn_of_rounding(meshes: Iterable[MeshInfo], names: Mapping[int, str]) -> None:
    """Warns of those meshes of a scene that are named and whose vertices float32 has moved by too much."""
    for m in meshes:
        size = max(high - low for low, high in zip(m.lo, m.hi))
        if m.mesh not in names or not 0 < _MOST_MOVED * size < m.rounding:
            continue
        origin = ", ".join(f"{x:.9g}" for x in m.origin)
        _errors.warn(
            f"{names[m.mesh]}: float32 moves a vertex by {m.rounding:.3g}, which is {m.rounding / size:.1e} of the "
            f"mesh's size of {size:.6g} (above 2^-20), so answers may be others: numbers are counted from ({origin}), "
            "and reach too far from there; give what lies far apart scenes of its own"
        )


_MOST_MOVED = 2.0**-20  # of a mesh's size: more is told


def rounding(array: np.ndarray) -> str | None:
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
        moved = np.linalg.norm(array - array.astype(np.float32), axis=1)
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


def passed(mesh: Mesh) -> tuple[Any, ...]:
    """Returns a mesh as the extension takes it."""
    parts = [part._handle if isinstance(part, Array) else part for part in mesh[:-3]]
    return (*parts, [_attributes.passed(a) for a in mesh.attributes], mesh.origin, mesh.grid)


def _indices(triangles: Any, name: str, device: Device | None) -> np.ndarray | Array:
    interface = getattr(triangles, "__cuda_array_interface__", None)
    if interface is not None and not isinstance(triangles, Array):
        if interface["typestr"] not in ("<u4", "<i4"):
            kind = np.dtype(interface["typestr"])
            raise TypeError(f"{name}: found {kind} on CUDA; expected int32 or uint32; convert them there first")
        if tuple(interface["shape"])[1:] != (3,):
            raise ValueError(f"{name}: shape is {tuple(interface['shape'])}; expected (m, 3)")
    on = there(triangles, "uint32", device)
    return _arrays.indices(triangles, name) if on is None else on


def make(
    vertices: Any, triangles: Any, mesh_id: Any, normals: Any, where: str, soup: bool, device: Device | None
) -> Mesh:
    """Returns a mesh of checked arrays. `soup`: every three rows of vertices without triangles are one."""
    number = _query.integer(mesh_id, f"{where}: id", 0, 0xFFFFFFFF)
    if hasattr(vertices, "radii"):  # shapes, which are checked
        if triangles is not None or normals is not None:
            raise ValueError(f"{where}: found triangles or normals beside shapes; expected shapes alone")
        made = Mesh(vertices.vertices, vertices.indices, number, vertices.normals, vertices.kind, vertices.radii)
        return made._replace(grid=vertices.grid)
    corners = triangles is None
    on = there(vertices, "vertices", device)
    v = positions(vertices, f"{where}: vertices", corners) if on is None else on
    if len(v) == 0:
        raise ValueError(f"{where}: vertices: shape is {v.shape}: none; leave empty meshes out")
    rows = on is vertices or len(_shape(vertices, where)) == 2
    if corners and not soup and rows:
        raise ValueError(
            f"{where}: vertices: shape is {v.shape}, and there are no triangles; pass their indices (m, 3), or corners "
            "(m, 3, 3), or soup=True if every three vertices are a triangle"
        )
    t = None if corners else _indices(triangles, f"{where}: triangles", device)
    n = None
    if normals is not None:
        at = there(normals, "vertices", device)
        given = _arrays.as_numpy(normals, f"{where}: normals") if at is None else at.read()
        n = vectors(given.reshape(-1, 3) if corners and given.shape[1:] == (3, 3) else given, f"{where}: normals")
        if n.shape != v.shape:
            raise ValueError(f"{where}: normals: shape is {n.shape}; expected {v.shape}, one for each vertex")
        v, n = v if isinstance(v, Array) else _arrays.contiguous(v), _arrays.contiguous(n)
    return Mesh(v, t, number, n)


def is_moved(vertices: np.ndarray | Array) -> bool:
    """Returns True if float32 without an origin would move a vertex of float64 by too much."""
    return isinstance(vertices, np.ndarray) and vertices.dtype == np.float64 and rounding(vertices) is not None


def beside(mesh: Mesh, attributes: Any, name: Any, where: str, device: Device | None) -> Mesh:
    """Returns the mesh with checked attributes and its name, or None."""
    read = _attributes.read_all(attributes, where, device)
    return mesh._replace(attributes=read, name=None if name is None else _query.text(name, "names"))


def _shape(given: Any, name: str) -> tuple[int, ...]:
    interface = getattr(given, "__cuda_array_interface__", None)
    return _arrays.as_numpy(given, name).shape if interface is None else tuple(interface["shape"])


def kept(mesh: Mesh, normals: Any) -> Mesh:
    """Returns the mesh without its vertices, indices and attributes, which the scene can tell, and with normals that
    nobody else changes. Of shapes it tells all but attributes; their heights the scene can tell."""
    if mesh.grid:
        mesh = mesh._replace(vertices=np.empty(0, np.float32))
    if mesh.kind:
        own: list[Any] = [part.copy() if isinstance(part, np.ndarray) else part for part in mesh[:-3]]
        return Mesh(*own)._replace(grid=mesh.grid)
    return Mesh(
        np.empty((len(mesh.vertices), 0), np.float32),
        None if mesh.indices is None else np.empty(0, np.uint32),
        mesh.id,
        None if mesh.normals is None else _own(mesh.normals, normals),
        name=mesh.name,
    )


def readable(parts: Iterable[Any]) -> tuple[Any, ...]:
    """Returns what came from another process with arrays that the library can read: there they lie at any address."""
    return tuple(_arrays.contiguous(part) if isinstance(part, np.ndarray) else part for part in parts)


def restored(mesh: Mesh, corners: np.ndarray, indices: np.ndarray, origin: tuple[float, float, float]) -> Mesh:
    """Returns the mesh with vertices again, from the corners (m, 3, 3) of its triangles about its origin, and with its
    indices."""
    if mesh.kind:
        return mesh
    corners = corners.reshape(-1, 3)
    if any(origin):
        corners, mesh = corners + np.asarray(origin, np.float64), mesh._replace(origin=origin)
    if mesh.indices is None:
        return mesh._replace(vertices=corners.copy())
    vertices = np.zeros((len(mesh.vertices), 3), corners.dtype)
    vertices += np.asarray(origin, corners.dtype)  # where those of no triangle stay
    vertices[indices] = corners
    return mesh._replace(vertices=vertices, indices=indices)


def box_of(low: Any, high: Any) -> np.ndarray:
    """Returns the middle and half the size of bounds: (2, 3) float64."""
    lo, hi = np.asarray(low, np.float64), np.asarray(high, np.float64)
    return np.stack([(lo + hi) / 2, (hi - lo) / 2])


def box(mesh: Mesh) -> np.ndarray:
    """Returns box_of() of the vertices; of those on the device, and of heights, NaN, of which nobody warns."""
    if isinstance(mesh.vertices, Array) or mesh.grid:
        return np.full((2, 3), np.nan)
    return box_of(mesh.vertices.min(axis=0), mesh.vertices.max(axis=0))


def transforms(given: Any) -> np.ndarray:
    """Returns (k, 12) float32 or float64 of matrices (k, 3, 4) or (k, 4, 4), whose last row is left out."""
    array = _arrays.numbers(given, "instances", (4,))
    if array.ndim != 3 or array.shape[1] not in (3, 4):
        raise ValueError(f"instances: shape is {array.shape}; expected (k, 3, 4) or (k, 4, 4)")
    return _arrays.contiguous(array[:, :3]).reshape(-1, 12)


def places(matrices: np.ndarray, meshes: np.ndarray, scene: np.ndarray) -> np.ndarray:
    """Returns matrices (k, 3, 4) from numbers about the origins of meshes (k, 3) to those about the scene's (3,)."""
    own = matrices.astype(np.float64).reshape(-1, 3, 4)
    own[..., 3] = (own[..., 3] - scene) + np.einsum("kij,kj->ki", own[..., :3], meshes)
    return own


def moved_place(given: np.ndarray, boxes: np.ndarray) -> str | None:
    """Returns a text about the instance, as places() returns it, that float32 moves most, if that is more than 2^-20 of
    its size. `boxes`: box() of the mesh of each."""
    middle, half = boxes[:, 0], boxes[:, 1]
    with np.errstate(all="ignore"):
        wrong = given - given.astype(np.float32)
        shift = np.einsum("kij,kj->ki", wrong[..., :3], middle) + wrong[..., 3]
        moved = (np.abs(shift) + np.einsum("kij,kj->ki", np.abs(wrong[..., :3]), half)).max(axis=1, initial=0)
        size = 2 * np.einsum("kij,kj->ki", np.abs(given[..., :3]), half).max(axis=1, initial=0)
        share = np.where((size > 0) & np.isfinite(size), moved / size, 0)
    if not (share > _MOST_MOVED).any():
        return None
    worst = int(share.argmax())
    return (
        f"instances: float32 moves instance {worst} by {moved[worst]:.3g}, which is {share[worst]:.1e} of its size of "
        f"{size[worst]:.6g} (above 2^-20), so answers may be others: it lies too far from the scene's origin; name "
        "another one (origin), or give what lies far apart scenes of its own"
    )


def _whole(given: Any, name: str, expected: str) -> np.ndarray:
    """Returns whole numbers below 2^32: (n,) uint32, side by side."""
    array = _arrays.as_numpy(given, name)
    if array.size == 0:
        array = array.astype(np.uint32)
    if array.dtype.kind not in "iuf" or array.ndim != 1:
        raise ValueError(f"{name}: shape is {array.shape}, dtype {array.dtype}; expected {expected}")
    wrong = np.nonzero((array < 0) | (array > 0xFFFFFFFF) | (array != np.floor(array)))[0]
    if len(wrong):
        raise ValueError(f"{name}: number {wrong[0]} is {array[wrong[0]]}; expected a whole number below 2^32")
    return _arrays.contiguous(array, np.uint32)


def numbers(given: Any, name: str) -> np.ndarray:
    """Returns one number, or several, as (k,) uint32."""
    return _whole([given] if np.ndim(given) == 0 else given, name, "a number, or (k,) integers")


def words(given: Any, name: str, count: int) -> np.ndarray:
    """Returns masks or groups of instances as (k,) uint32."""
    found = _whole([given] * count if np.ndim(given) == 0 else given, name, f"{count} integers")
    if len(found) != count:
        raise ValueError(f"{name}: found {len(found)}; expected {count}, one for each instance")
    return found


# Instances as the extension takes them: matrices (k, 12), the numbers of their meshes (k,), their masks (k,) or None,
# their groups (k,) or None.
Instances = tuple[np.ndarray, np.ndarray, "np.ndarray | None", "np.ndarray | None"]


def instances(given: Any, meshes: Any, masks: Any, groups: Any) -> Instances:
    """Returns instances of checked arrays."""
    matrices = _arrays.as_numpy(given, "instances")
    count = len(matrices) if matrices.ndim else 0
    which = np.zeros(count, np.uint32) if meshes is None else _whole(meshes, "instance_meshes", f"{count} integers")
    if len(which) != count:
        raise ValueError(f"instance_meshes: shape is {which.shape}; expected {count} integers, one for each matrix")
    bits = None if masks is None else words(masks, "masks", count)
    own = None if groups is None else words(groups, "groups", count)
    return transforms(matrices), which, bits, own
