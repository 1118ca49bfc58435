"""Arguments that make a scene, checked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from . import _adapters, _mesh, _query


def options(given: Mapping[str, Any], kind: str) -> dict[str, Any]:
    """Returns the options of a scene as the extension takes them."""
    checked, _ = _query.options(given, kind)
    if not 0 <= checked.get("split_budget", 0) <= 16:
        raise ValueError(f"split_budget is {checked['split_budget']}; expected 0 to 16")
    if checked.get("split_budget") == 0:
        checked["split_budget"] = -1.0  # C's word for it
    return checked


def nodes(vertices: Any, triangles: Any, meshes: Any, instances: Any) -> _adapters.Nodes | None:
    """Returns the meshes and nodes of a trimesh.Scene that a scene was given alone; None: of nothing else."""
    if vertices is None or any(given is not None for given in (triangles, meshes, instances)):
        return None
    return _adapters.nodes(vertices, "mesh")


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


def for_each(given: Any, count: int, single: bool, name: str) -> list[Any]:
    """Returns what meshes were given, one for each; None: nothing."""
    found = [None] * count if given is None else [given] if single else list(given)
    if len(found) != count:
        raise ValueError(f"{name}: found {len(found)}; expected {count}, one for each mesh")
    return found


def instances(given: Any, meshes: Any, masks: Any, groups: Any) -> _mesh.Instances | None:
    """Returns the instances of meshes that a scene was given; None: none were."""
    if given is None:
        for found, name in ((meshes, "instance_meshes"), (masks, "masks"), (groups, "groups")):
            if found is not None:
                raise ValueError(f"{name}: there are no instances; expected None")
        return None
    return _mesh.instances(given, meshes, masks, groups)
