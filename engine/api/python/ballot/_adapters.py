"""Meshes of other libraries, known by their members: none of the libraries is imported."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ._shapes import Shapes

_TAKEN = "(vertices, triangles), shapes, or a mesh of trimesh, Open3D, PyVista or meshio"


def parts(given: Any, name: str) -> tuple[Any, Any]:
    """Returns vertices and triangles of a pair, or of a mesh of another library."""
    if isinstance(given, Shapes):
        return given, None
    if isinstance(given, (tuple, list)) and len(given) == 2:
        return given[0], given[1]
    found = read(given, name)
    if found is None:
        raise TypeError(f"{name}: found {type(given).__name__}; expected {_TAKEN}")
    return found


def read(given: Any, name: str) -> tuple[Any, Any] | None:
    """Returns vertices and triangles of a mesh of another library; None if it is none that is known. Raises ValueError
    if it is known but holds what is no triangle."""
    if isinstance(given, Shapes):
        return given, None
    if _has(given, "vertex", "triangle"):  # open3d.t.geometry.TriangleMesh
        if not (_has(given.vertex, "positions") and _has(given.triangle, "indices")):
            raise ValueError(f"{name}: the mesh has no vertices or no triangles; leave empty meshes out")
        return given.vertex.positions, given.triangle.indices
    if _has(given, "geometry", "graph"):  # trimesh.Scene
        return _of_scene(given, name)
    if _has(given, "points", "faces"):  # pyvista.PolyData
        return _of_polydata(given, name)
    if _has(given, "points", "cells") and isinstance(given.cells, (list, tuple)):  # meshio.Mesh
        return _of_cells(given, name)
    if _has(given, "extract_surface"):  # grids of PyVista
        raise ValueError(f"{name}: found {type(given).__name__}, which holds cells; pass its extract_surface()")
    for triangles in ("faces", "triangles"):  # trimesh.Trimesh, open3d.geometry.TriangleMesh
        if _has(given, "vertices", triangles):
            return np.asarray(given.vertices), np.asarray(getattr(given, triangles))
    return None


def _has(given: Any, *names: str) -> bool:
    """Returns whether an object has all of these members."""
    try:
        return all(hasattr(given, name) for name in names)
    except KeyError:  # what a map of Open3D raises for those that it has not
        return False


class Nodes(NamedTuple):
    """A scene of trimesh: meshes and where they are."""

    meshes: list[tuple[np.ndarray, np.ndarray]]
    names: list[str]  # of the meshes
    matrices: np.ndarray  # (k, 4, 4) float64, of the nodes in the order of its graph
    which: np.ndarray  # (k,) the mesh of each


def nodes(given: Any, name: str) -> Nodes | None:
    """Returns the meshes and nodes of a trimesh.Scene; None: it is none, or has no nodes. Of a mesh that a node mirrors
    there is one that is turned round, so that its outside stays outside."""
    if not _has(given, "geometry", "graph"):
        return None
    numbers: dict[tuple[Any, bool], int] = {}
    found, matrices, which = Nodes([], [], np.empty((0, 4, 4)), np.empty(0, int)), [], []
    for node in given.graph.nodes_geometry:
        matrix, key = given.graph[node]
        part, turn = given.geometry[key], np.asarray(matrix, np.float64)
        if not _has(part, "vertices", "faces"):
            raise ValueError(f"{name}: geometry {key!r} is a {type(part).__name__}; expected meshes; pass to_mesh()")
        mirrored = bool(np.linalg.det(turn[:3, :3]) < 0)
        if (key, mirrored) not in numbers:
            numbers[key, mirrored] = len(found.meshes)
            corners = np.asarray(part.faces)
            found.meshes.append((np.asarray(part.vertices), corners[:, ::-1] if mirrored else corners))
            found.names.append(str(key))
        matrices.append(turn)
        which.append(numbers[key, mirrored])
    return found._replace(matrices=np.array(matrices), which=np.array(which)) if matrices else None


def _of_scene(scene: Any, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Returns the meshes of all nodes where the graph puts them, in its order, as one."""
    vertices, triangles, first = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], 0
    found = nodes(scene, name)
    if found is None:
        return vertices[0], triangles[0]
    for turn, number in zip(found.matrices, found.which):
        points, corners = found.meshes[number]
        vertices.append(points @ turn[:3, :3].T + turn[:3, 3])
        triangles.append(corners + first)
        first += len(points)
    return np.concatenate(vertices), np.concatenate(triangles)


def _of_polydata(mesh: Any, name: str) -> tuple[Any, np.ndarray]:
    """Returns the triangles of a surface of PyVista. Other faces are cut into triangles by PyVista."""
    for kind in ("lines", "verts"):
        if np.size(getattr(mesh, kind, ())) and np.size(mesh.faces):
            raise ValueError(f"{name}: it has {kind} besides its faces; pass PolyData(mesh.points, mesh.faces)")
    if getattr(mesh, "n_strips", 0) or not _all_triangles(np.asarray(mesh.faces)):
        mesh = mesh.triangulate()
    return np.asarray(mesh.points), np.asarray(mesh.faces).reshape(-1, 4)[:, 1:]


def _all_triangles(faces: np.ndarray) -> bool:
    """Returns whether each face, its number of corners and then the corners, is a triangle."""
    return faces.size % 4 == 0 and bool((faces[::4] == 3).all())


def _of_cells(mesh: Any, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Returns the triangles of a mesh of meshio, cell by cell; a quadrilateral becomes two."""
    points, triangles = np.asarray(mesh.points), [np.empty((0, 3), np.int64)]
    for cells in mesh.cells:
        if cells.type not in ("triangle", "quad"):
            raise ValueError(
                f"{name}: the mesh has cells of type {cells.type!r}; expected 'triangle' and 'quad' alone: pass "
                "(mesh.points, mesh.cells_dict['triangle'])"
            )
        corners = np.asarray(cells.data, np.int64)
        triangles.append(corners if cells.type == "triangle" else _halves(points, corners))
    return points, np.concatenate(triangles)


def _halves(points: np.ndarray, quads: np.ndarray) -> np.ndarray:
    """Returns two triangles (2 q, 3) for each quadrilateral (q, 4), cut from corner 0 to 2, or from 1 to 3 where that
    cut would lie outside of it."""
    if points.ndim != 2 or quads.size == 0 or not 0 <= quads.min() <= quads.max() < len(points):
        return quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)  # what is wrong will be told of the triangles
    a, b, c, d = np.moveaxis(points[quads].astype(np.float64), 1, 0)
    outside = (np.cross(b - a, c - a) * np.cross(c - a, d - a)).sum(-1) < 0
    cut = np.where(outside[:, None], quads[:, [1, 2, 3, 1, 3, 0]], quads[:, [0, 1, 2, 0, 2, 3]])
    return cut.reshape(-1, 3)
