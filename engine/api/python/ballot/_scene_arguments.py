"""Arguments that make a scene, checked."""

from __future__ import annotations

from typing import Any

import numpy as np

from . import _adapters, _mesh, _query


def options(
    builder: str,
    max_leaf: int,
    split_budget: float,
    cache: bool,
    updates: str,
    expected_rays: float,
    instances: str = "auto",
    ids: str = "mesh",
    layout: str = "auto",
) -> tuple[str, int, float, bool, str, float, str, str, str]:
    texts = (("builder", builder), ("updates", updates), ("instances", instances), ("ids", ids), ("layout", layout))
    for name, text in texts:
        _query.text(text, name)
    rays = _query.number(expected_rays, "expected_rays")
    if rays < 0:
        raise ValueError(f"expected_rays is {rays}; expected at least 0")
    budget = _query.number(split_budget, "split_budget")
    if not 0 <= budget <= 16:
        raise ValueError(f"split_budget is {budget}; expected 0 to 16")
    return (
        builder,
        _query.integer(max_leaf, "max_leaf", 1, 6),
        budget,
        bool(cache),
        updates,
        rays,
        instances,
        ids,
        layout,
    )


def pairs(vertices: Any, triangles: Any, meshes: Any) -> list[tuple[Any, Any]]:
    """Returns vertices and triangles of each mesh that a scene was given."""
    if meshes is None:
        if vertices is None:
            raise TypeError("Scene: found neither vertices nor meshes; expected one of them")
        mesh = _adapters.read(vertices, "mesh") if triangles is None else None
        return [mesh or (vertices, triangles)]
    if vertices is not None or triangles is not None:
        raise TypeError("Scene: found both vertices and meshes; expected one of them")
    return [_adapters.parts(mesh, f"mesh {k}") for k, mesh in enumerate(meshes)]


def one_each(ids: Any, normals: Any, count: int, single: bool) -> tuple[list[Any], list[Any]]:
    if ids is None:
        numbers = list(range(count))
    else:
        numbers = [ids] if single and hasattr(ids, "__index__") else list(ids)
    directions = [None] * count if normals is None else [normals] if single else list(normals)
    for found, name in ((numbers, "ids"), (directions, "normals")):
        if len(found) != count:
            raise ValueError(f"{name}: found {len(found)}; expected {count}, one for each mesh")
    return numbers, directions


def instances(given: Any, meshes: Any, masks: Any, made: list[_mesh.Mesh]) -> _mesh.Instances | None:
    """Returns the instances of meshes that a scene was given; None: none were."""
    if given is None:
        for found, name in ((meshes, "instance_meshes"), (masks, "masks")):
            if found is not None:
                raise ValueError(f"{name}: there are no instances; expected None")
        return None
    boxes = np.array([_mesh.box(m) for m in made]).reshape(-1, 2, 3)
    return _mesh.instances(given, meshes, masks, lambda which: boxes[which] if (which < len(boxes)).all() else None)
