"""What a pickled scene holds, and how it is made again: as it was at first, then by one commit."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _arrays, _mesh
from ._mesh import Mesh

_NOTHING = Mesh(np.zeros((3, 3), np.float32), None, 0, None)  # holds the number of a mesh that is gone
_UNIT = np.eye(3, 4, dtype=np.float32).reshape(1, 12)


def state_of(scene: Any) -> dict[str, Any]:
    """Returns what tells a scene, but for its device and options. What has not changed of a file is left to it."""
    edited = scene._edited
    meshes, instances = (scene.meshes, scene.instances) if edited or scene._path is None else ([], [])
    kept = scene._own  # lacks what a commit that Ctrl-C ended has added
    taken = [m.mesh for m in meshes if m.mesh not in kept or kept[m.mesh] is not None or m.mesh in scene._moved]
    corners = scene.triangles() if taken else np.empty((0, 3, 3), np.float32)
    arrays = {}
    for m in meshes:
        if m.mesh in taken:
            own = kept.get(m.mesh) or Mesh(np.empty((3 * m.triangles, 0), np.float32), None, m.id, None)
            if m.columns:
                arrays[m.mesh] = tuple(_heights(scene, m, own))
                continue
            its = corners[m.first : m.first + m.triangles]
            arrays[m.mesh] = tuple(_mesh.restored(own, its, scene._handle.indices(m.mesh), m.origin))
    return {
        "path": scene._path,
        "time": scene._time,
        "first": scene._first,
        "next": tuple(scene._next),
        "edited": edited,
        "kept": [m.mesh for m in meshes],
        "meshes": arrays,
        "attributes": [
            (mesh, (name, of, width, near, scene._handle.attribute_values(mesh, place).reshape(-1, width)))
            for mesh, name, of, width, near, place in scene._handle.attributes()
        ],
        "moved": set(scene._moved),
        "numbers": np.array([i.instance for i in instances], np.uint32),
        "which": np.array([i.mesh for i in instances], np.uint32),
        "origin": scene.info.origin,
        "matrices": _matrices(meshes, instances, scene.info.origin),
        "masks": np.array([i.mask for i in instances], np.uint32),
        "groups": np.array([i.group for i in instances], np.uint32),
    }


def _heights(scene: Any, m: Any, own: Mesh) -> Mesh:
    """Returns a mesh of heights, as they are now."""
    origin = m.origin if any(m.origin) else None
    grid = (m.columns, *m.spacing, *m.corner)
    return own._replace(vertices=scene._handle.heights(m.mesh), kind=m.shapes, origin=origin, grid=grid)


def _matrices(meshes: list[Any], instances: list[Any], origin: tuple[float, float, float]) -> np.ndarray:
    """Returns the matrices of instances in the world, from numbers of their meshes' own spaces: (k, 12)."""
    matrices = np.array([i.transform for i in instances], np.float32).reshape(-1, 12)
    origins = {m.mesh: m.origin for m in meshes}
    if not any(origin) and not any(any(o) for o in origins.values()):
        return matrices
    minus = -np.array([origins[i.mesh] for i in instances], np.float64).reshape(-1, 3)
    return _mesh.places(matrices, minus, -np.asarray(origin, np.float64)).reshape(-1, 12)


def source_of(state: dict[str, Any]) -> tuple[Any, Any]:
    """Returns what the scene is made of at first: a path, or meshes; and their instances, or None."""
    if state["path"] is not None:
        return state["path"], None
    count, placed = state["first"]
    meshes = [_mesh.passed(_readable(state["meshes"].get(m, _NOTHING))) for m in range(count)]
    if placed is None:
        return meshes, None
    matrices, which = np.repeat(_UNIT, placed, 0).astype(state["matrices"].dtype), np.zeros(placed, np.uint32)
    masks, groups = np.full((2, placed), 0xFFFFFFFF, np.uint32)
    own = (state["numbers"] < placed) & (state["which"] < count)
    at = state["numbers"][own]
    matrices[at], which[at], masks[at] = state["matrices"][own], state["which"][own], state["masks"][own]
    groups[at] = state["groups"][own]
    return meshes, (matrices, which, masks, groups)


def _readable(mesh: Any) -> Mesh:
    """Returns a mesh from another process with arrays that the library can read: there they lie at any address."""
    parts: list[Any] = [_arrays.contiguous(part) if isinstance(part, np.ndarray) else part for part in mesh]
    return Mesh(*parts)


def restore(scene: Any, state: dict[str, Any]) -> None:
    """Edits a scene that was just made until it is the one that was pickled."""
    _edit(scene, state)
    for mesh, (*words, values) in state["attributes"]:
        scene._handle.set_attribute(mesh, (*words, _arrays.contiguous(values)))
    if state["attributes"]:
        scene._handle.commit([])
    arrays, moved, kept = state["meshes"], state["moved"], state["kept"]
    own: dict[int, Mesh | None] = {
        m: _mesh.kept(_readable(arrays[m]), None) if m in arrays and m not in moved else None
        for m in kept or range(len(scene._handle.meshes()))
    }
    scene._begin(own, 0)
    scene._moved, scene._next, scene._edited = set(moved), list(state["next"]), state["edited"]


def _edit(scene: Any, state: dict[str, Any]) -> None:
    handle, (meshes, instances), arrays, held = scene._handle, state["next"], state["meshes"], []
    if not state["edited"]:
        return
    kept, count = set(state["kept"]), len(handle.meshes())
    for m in range(count, meshes):
        handle.add_mesh(_mesh.passed(_readable(arrays.get(m, _NOTHING))))
    if state["path"] is not None:
        for m in (m for m in arrays if m < count):
            mesh = _readable(arrays[m])
            move = handle.set_heights if mesh.grid else handle.set_vertices
            move(m, mesh.vertices) if m in state["moved"] else handle.replace_mesh(m, _mesh.passed(mesh))
            held.append(mesh)
    there = {i[-3]: i[2] for i in handle.instances()}
    numbers, which = state["numbers"], state["which"]
    if instances > len(there):
        new = np.arange(len(there), instances, dtype=np.uint32)
        of = np.full(len(new), next(iter(kept), 0), np.uint32)
        later = numbers >= len(there)
        of[numbers[later] - len(there)] = which[later]
        if kept:
            handle.add_instances((np.repeat(_UNIT, len(new), 0), of, None, None))
            there |= dict(zip(new.tolist(), of.tolist()))
    for m in set(range(meshes)) - kept:
        handle.remove_mesh(m)
    alive = set(numbers.tolist())
    gone = [i for i, m in there.items() if i not in alive and m in kept]
    handle.remove_instances(np.array(gone, np.uint32))
    handle.set_transforms(_arrays.contiguous(state["matrices"]), numbers)
    handle.set_masks(numbers, _arrays.contiguous(state["masks"]))
    handle.set_groups(numbers, _arrays.contiguous(state["groups"]))
    handle.commit([])
