"""Scenes: meshes on a device, and the rays that are traced in them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _ballot, _mesh, _pickles, _query, _scene_arguments
from ._answers import Answers
from ._device import Device, device_or_default
from ._door import AnimationInfo, SceneInfo, SceneOptions, documented
from ._edits import Edits
from ._errors import Error
from ._sums import Sums

if TYPE_CHECKING:
    from typing_extensions import Unpack


@documented
class Scene(Edits, Answers, Sums):
    """A scene on a device, made of triangle meshes.

    vertices      (n, 3) float32 or float64: x, y, z; finite, at most 1e12. Without triangles: their corners (m, 3, 3),
                  or a mesh of trimesh (also its Scene), Open3D, PyVista or meshio; other faces are cut into triangles.
                  A trimesh.Scene becomes `meshes`, `names` and `instances`, unless the last are given: then it is one
                  mesh, as among `meshes`. Where its graph mirrors a mesh that is turned round
                  Or an Array of "vertices", or float32 of CUDA's (torch, cupy, Warp), copied and checked on the device
    triangles     (m, 3) integers: vertices of each triangle. Or an Array of "uint32", or int32 or uint32 of CUDA's
    soup          True: every three of (n, 3) vertices without triangles are one; False: those are refused
    meshes        instead of the two: a list of (vertices, triangles) and of such meshes
    device        a Device; None: the default one
    ids           a number 0 to 2^32 - 1 for each mesh, which trace_columns() reports; None: 0, 1, 2, ...
    normals       (n, 3) unit normal of each vertex, for pictures; with `meshes` a list of such arrays or None
    attributes    a dict of names and what an Attribute is, or numbers of vertices, which columns of answers then tell;
                  with `meshes` a list of such dicts or None. Of one name all have as many components
    names         the name of the mesh, with `meshes` a list of them or None; None: "scene", or "mesh N"
    instances     (k, 3, 4) or (k, 4, 4) float32 or float64: a matrix for each instance of a mesh, whose points p lie at
                  m[:3, :3] @ p + m[:3, 3]. None: each mesh lies where its vertices say
    instance_meshes  with `instances`: (k,) integers, the mesh of each, from 0; None: 0
    masks         with `instances`: (k,) whole numbers below 2^32, as set_masks() says; None: all bits
    groups        likewise, as set_groups() says; None: ballot.SHARED
    {scenes_options}

    Meshes and instances are numbered from 0. Without `instances` each mesh has one, with its own number. HIT's prim
    counts the triangles of the first instance, then those of the second, and so on; columns "instances" and "prims"
    name instance and triangle. Triangles without area keep their number and are never hit. commit() edits the scene.
    The scene copies what it needs; contiguous float32 and uint32 arrays are read in place. float64 that lies far from
    zero is kept as float32 about an origin (info.origin, meshes[i].origin): rounded by 2^-24 of the mesh's size
    (meshes[i].rounding), with a PrecisionWarning above 2^-20. Questions and answers are of the world. Raises
    ValueError, which names mesh and vertex or index, if a number is not finite, an index is out of range, a mesh is
    empty, or there are more than 2^31 - 1 triangles.

    With `instances` the tree of each mesh is built once, below a tree over the instances. Method "packet-wide" cannot
    trace such a scene, and pictures and make_rays() take matrices that multiply rounding errors by 4096 at most. One
    that cannot be inverted in float32 is a ValueError.

    A scene may be used from any thread, and can be pickled: geometry, settings and the name of its device go along.

    >>> scene = ballot.Scene([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> hits = scene.trace([[0, 0, 5, 0, 0, -1], [9, 9, 5, 0, 0, -1]])
    >>> hits["t"].tolist()[0], hits["prim"].tolist()
    (5.0, [0, 4294967295])
    """

    def __init__(
        self,
        vertices: Any = None,
        triangles: Any = None,
        *,
        soup: bool = False,
        meshes: Iterable[Any] | None = None,
        device: Device | None = None,
        ids: Sequence[int] | int | None = None,
        normals: Any = None,
        attributes: Any = None,
        names: Sequence[str | None] | str | None = None,
        instances: Any = None,
        instance_meshes: Any = None,
        masks: Any = None,
        groups: Any = None,
        **options: Unpack[SceneOptions],
    ):
        parts = _scene_arguments.nodes(vertices, triangles, meshes, instances)
        if parts is not None:
            vertices, meshes, instances, instance_meshes = None, parts.meshes, parts.matrices, parts.which
            names = parts.names if names is None else names
        given = _scene_arguments.pairs(vertices, triangles, meshes)
        numbers, directions = _scene_arguments.one_each(ids, normals, len(given), meshes is None)
        where = ["mesh"] if meshes is None else [f"mesh {k}" for k in range(len(given))]
        made = [
            _mesh.make(v, t, i, n, w, bool(soup), device)
            for (v, t), i, n, w in zip(given, numbers, directions, where)
        ]
        beside = [_scene_arguments.for_each(a, len(given), meshes is None, n)
                  for a, n in ((attributes, "attributes"), (names, "names"))]  # fmt: skip
        made = [_mesh.beside(m, a, n, w, device) for m, a, n, w in zip(made, *beside, where)]
        self._options = _scene_arguments.options(options, "scenes")
        self._path: str | None = None
        self._device = device
        self._time: tuple[int, float] | None = None
        placed = _scene_arguments.instances(instances, instance_meshes, masks, groups)
        self._open([_mesh.passed(m) for m in made], placed)
        self._first: tuple[int, int | None] = (len(made), None if placed is None else len(placed[0]))
        own: dict[int, _mesh.Mesh | None] = {
            k: _mesh.kept(m, n) for k, (m, n) in enumerate(zip(made, directions))
        }
        self._begin(own, len(made) if placed is None else len(placed[0]))
        moved = {k: f"{w}: vertices" for k, (m, w) in enumerate(zip(made, where)) if _mesh.is_moved(m.vertices)}
        if moved:
            _mesh.warn_of_rounding(self.meshes, moved)
        if placed is not None and placed[0].dtype == np.float64:
            boxes = np.array([_mesh.box(m) for m in made]).reshape(-1, 2, 3)[placed[1]]
            if _mesh.moved_place(placed[0].reshape(-1, 3, 4), boxes):
                self._warn_of_places(placed[0], placed[1])

    def _load(self, path: str, device: Device | None, options: Any) -> None:
        """Loads a file into a new object."""
        self._device, self._options, self._path, self._time = device, options, path, None
        self._first = (0, None)
        self._open(path)
        self._begin(dict.fromkeys(range(len(self._handle.meshes()))), len(self._handle.instances()))

    def _open(self, source: Any, instances: Any = None) -> None:
        device = device_or_default(self._device)._handle
        if isinstance(source, str):
            self._handle = _ballot.Scene(device, os.fsencode(source), self._options)
        else:
            self._handle = _ballot.Scene(device, source, instances, self._options)

    @property
    def info(self) -> SceneInfo:
        """What the scene holds, as it was committed last."""
        return SceneInfo(*self._handle.info())

    @property
    def animations(self) -> list[AnimationInfo]:
        """The animations of a scene that was loaded from a glTF file."""
        return [AnimationInfo(*animation) for animation in self._handle.animations()]

    def set_time(self, seconds: float, animation: int | str = 0) -> None:
        """Moves the scene to a time of one of its animations.

        seconds    0 to its end; a time outside means the beginning or end
        animation  its number or name

        Moves triangles, and for pictures lights and views. The scene's `updates` says how the tree moves. Raises
        ValueError if there is no such animation or the time is not finite; the scene is then as it was.
        """
        if isinstance(animation, str):
            names = [a.name for a in self.animations]
            if animation not in names:
                raise ValueError(f"animation is {animation!r}; the scene has {', '.join(names) or 'none'}")
            animation = names.index(animation)
        time = (_query.integer(animation, "animation", 0, 2**31), _query.finite(seconds, "seconds"))
        self._handle.set_time(*time)
        self._time = time

    def triangles(self) -> np.ndarray:
        """Returns the corners of the triangles of each mesh, in its own space: (m, 3, 3) float32."""
        return self._handle.triangles()

    def make_rays(self, view: Any = None, kind: str = "primary", width: int = 512, height: int = 512) -> np.ndarray:
        """Returns the rays of a kind for a view: (n, 8) float32, float64 if the scene has an origin (info.origin), in
        the order that suits the device (tiles of pixels).

        view   None: the scene's first; a name; or a dict of eye and target, (3,), and perhaps up, yfov (full vertical
               angle in radians) and ymag (orthographic: half the height)
        kind   "primary", "shadow", "ao", ...: `ballot methods` lists them; each is made from primary hits
        """
        w, h = _query.integer(width, "width", 1, 16384), _query.integer(height, "height", 1, 16384)
        make = self._handle.make_rays_double if any(self.info.origin) else self._handle.make_rays
        return make(_query.view(view), _query.text(kind, "kind"), w, h)

    def __repr__(self) -> str:
        if self.closed:
            return "<ballot.Scene, closed>"
        try:
            info = self.info
        except Error as error:  # such as one that was made before fork()
            return f"<ballot.Scene, {error.code.name.lower()}>"
        placed = f" in {info.instances} instances" if info.trees else ""
        return f"<ballot.Scene of {info.triangles} triangles{placed}>"

    def __getstate__(self) -> dict[str, Any]:
        return {"device": self._device, "options": self._options} | _pickles.state_of(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._device, self._options, self._path = state["device"], state["options"], state["path"]
        self._first = state["first"]
        if any(state["origin"]) and self._path is None:
            self._options = {**self._options, "origin": state["origin"]}
        self._open(*_pickles.source_of(state))
        _pickles.restore(self, state)
        self._time = state["time"]
        if self._time is not None:
            self._handle.set_time(*self._time)
