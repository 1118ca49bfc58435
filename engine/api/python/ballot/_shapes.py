"""Shapes other than triangles, which stand where a mesh is asked for."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from . import _arrays, _mesh, _query


class Shapes(NamedTuple):
    """A mesh of spheres, discs, capsules, boxes or heights, as their functions return it. Scene, add_mesh() and
    replace_mesh() take it in the place of a mesh. heights() are triangles; what follows is of the others.

    A ray enters a closed shape and leaves it: two hits, of which the nearest counts, or the second where the ray starts
    inside. u and v of a hit tell its outward normal; column "normals" has it. The front of a closed shape is its
    outside, of a disc the side of its normal. A prim is a shape's number. Such a mesh lies in a tree of its own.
    Modes "double" and "fast" are of triangles; "exact" finds nearest and any hits alone, by the host. In pictures
    shapes give no light. set_vertices() moves the vertices.
    """

    #: "spheres", "discs", "capsules", "boxes" or "heights"
    kind: str
    #: (n, 3) float32: centers, ends or corners; or (n,), heights row by row
    vertices: np.ndarray
    #: the vertices of each shape, one shape after the other; None: in turn
    indices: np.ndarray | None
    #: (n,) float32, of each vertex; None: of boxes
    radii: np.ndarray | None
    #: (n, 3) float32, of each vertex; None: but of discs
    normals: np.ndarray | None
    #: of heights: columns, spacing along x and y, x and y of the first; None: of others
    grid: tuple[int, float, float, float, float] | None = None


def _radii(given: Any, count: int, name: str) -> np.ndarray:
    """Returns radii (count,) float32, of one for all as well."""
    array = _arrays.as_numpy(given, name)
    if array.ndim == 0:
        array = np.full(count, array)
    if array.ndim != 1 or array.dtype.kind not in "iuf" or len(array) != count:
        raise ValueError(f"{name}: shape is {array.shape}, dtype {array.dtype}; expected a number, or ({count},)")
    wrong = np.nonzero(~((array >= 0) & (array <= 1e12)))[0]
    if len(wrong):
        raise ValueError(f"{name}: radius {wrong[0]} is {array[wrong[0]]}; expected 0 to 1e12")
    return _arrays.contiguous(array, np.float32)


def _vertices(given: Any, name: str) -> np.ndarray:
    found = _arrays.contiguous(_mesh.positions(given, name))
    if len(found) == 0:
        raise ValueError(f"{name}: shape is {found.shape}: none; leave empty meshes out")
    return found


def spheres(centers: Any, radii: Any) -> Shapes:
    """Returns spheres: a point cloud, particles. A sphere of radius 0 is never hit.

    centers  (n, 3) float32 or float64
    radii    (n,), or one for all; 0 to 1e12

    >>> scene = ballot.Scene(ballot.spheres([[0, 0, 0], [4, 0, 0]], 1))
    >>> scene.trace([[0, 0, 5, 0, 0, -1]])["t"].tolist()
    [4.0]
    """
    v = _vertices(centers, "centers")
    return Shapes("spheres", v, None, _radii(radii, len(v), "radii"), None)


def discs(centers: Any, normals: Any, radii: Any) -> Shapes:
    """Returns flat discs, met from both sides: surfels. A disc of radius 0 is never hit.

    centers  (n, 3) float32 or float64
    normals  (n, 3) of any length but 0
    radii    (n,), or one for all; 0 to 1e12
    """
    v = _vertices(centers, "centers")
    n = _arrays.contiguous(_mesh.vectors(normals, "normals"), np.float32)
    if n.shape != v.shape:
        raise ValueError(f"normals: shape is {n.shape}; expected {v.shape}, one for each center")
    return Shapes("discs", v, None, _radii(radii, len(v), "radii"), n)


def capsules(points: Any, radii: Any, segments: Any = None) -> Shapes:
    """Returns capsules, each the convex hull of two spheres: hair, cables, pipes. Where the radii differ it is a cone
    with round ends.

    points    (n, 3) float32 or float64
    radii     (n,) of the points, or one for all; 0 to 1e12
    segments  (m, 2) integers: the ends of each; None: points 0 1, 2 3, ...
    """
    v = _vertices(points, "points")
    t = None
    if segments is None:
        if len(v) % 2:
            raise ValueError(f"points: shape is {v.shape}; expected an even number, two of each capsule, or segments")
    else:
        t = _arrays.indices(segments, "segments", 2, "segments")
    return Shapes("capsules", v, t, _radii(radii, len(v), "radii"), None)


def boxes(low: Any, high: Any) -> Shapes:
    """Returns boxes along the axes, from two opposite corners; instances turn them. One that is flat along two axes is
    never hit.

    low, high  (n, 3) float32 or float64
    """
    a, b = _vertices(low, "low"), _vertices(high, "high")
    if a.shape != b.shape:
        raise ValueError(f"high: shape is {b.shape}; expected {a.shape}, as that of low")
    return Shapes("boxes", np.stack([a, b], 1).reshape(-1, 3), None, None, None)


def heights(heights: Any, spacing: Any = 1, corner: Any = (0, 0)) -> Shapes:
    """Returns a height field: a raster whose cells are two triangles each. Nobody needs to make vertices and indices
    of it; the scene keeps 4 bytes a sample instead of 24. Answers are those of a mesh of these triangles, in all modes.

    heights  (rows, columns) float32, or what it is rounded from; at least 2 x 2. NaN, or masked: no data, so no
             triangle that touches the sample is there
    spacing  from a sample to the next, one number or two: along x and along y, above 0
    corner   x and y of heights[0, 0]

    heights[r, c] lies at x = corner[0] + c * spacing[0], y = corner[1] + r * spacing[1], and z is the height; as of
    vertices in float64 an origin is found where x and y are large. Cell (r, c) is number r * (columns - 1) + c = i, its
    triangles are prims 2 i, of the samples (r, c), (r, c + 1), (r + 1, c + 1), and 2 i + 1, of (r, c), (r + 1, c + 1),
    (r + 1, c). set_heights() moves them. Raises ValueError for infinite heights, once a scene takes them.

    >>> scene = ballot.Scene(ballot.heights([[0, 0, 1], [0, 0, 1]], spacing=(2, 3)))
    >>> scene.trace([[3, 1, 9, 0, 0, -1]])["t"].tolist(), scene.meshes[0].shapes
    ([8.5], 'heights')
    """
    raster = _mesh.raster(heights, "heights")
    pair = (spacing, spacing) if np.ndim(spacing) == 0 else spacing
    dx, dy = _query.numbers(pair, "spacing", 2)
    if not (dx > 0 and dy > 0):
        raise ValueError(f"spacing: found ({dx}, {dy}); expected numbers above 0")
    x, y = _query.numbers(corner, "corner", 2)
    return Shapes("heights", raster.reshape(-1), None, None, None, (raster.shape[1], dx, dy, x, y))
