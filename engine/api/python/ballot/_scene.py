"""Scenes: meshes on a device, and the rays that are traced in them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from . import _arrays, _ballot, _mesh, _pickles, _query, _scene_arguments, _sources
from ._array import Array
from ._arrays import HIT
from ._device import Device, device_or_default
from ._edits import Edits
from ._errors import Error
from ._job import Job
from ._points import Queries
from ._query import Times
from ._scene_info import Animation, SceneInfo

Progress = Callable[[float], Any]

_COLUMNS = {  # name: (dtype, shape of one ray's entry)
    "t": (np.float32, ()),
    "prims": (np.uint32, ()),
    "mesh_ids": (np.uint32, ()),
    "uvs": (np.float32, (2,)),
    "normals": (np.float32, (3,)),
    "occluded": (np.bool_, ()),
    "instances": (np.uint32, ()),
}


class Scene(Edits, Queries):
    """A scene on a device, made of triangle meshes.

    vertices      (n, 3) float32 or float64: x, y, z; finite, at most 1e12. Without triangles: their corners (m, 3, 3),
                  or a mesh of trimesh (also its Scene), Open3D, PyVista or meshio; other faces are cut into triangles.
                  The meshes of a trimesh.Scene are taken where its graph puts them, as one; mirrored ones are turned
    triangles     (m, 3) integers: vertices of each triangle
    soup          True: every three of (n, 3) vertices without triangles are one; False: those are refused
    meshes        instead of the two: a list of (vertices, triangles) and of such meshes
    device        a Device; None: the default one
    ids           a number 0 to 2^32 - 1 for each mesh, which trace_columns() reports; None: 0, 1, 2, ...
    normals       (n, 3) unit normal of each vertex, for pictures; with `meshes` a list of such arrays or None
    builder       how the tree is built: "best", "balanced", "fast", "device" or "auto"; "": "auto", which is "device"
                  on a GPU and "balanced" on a CPU unless expected_rays says otherwise
    max_leaf      most triangles of a leaf of the tree, 1 to 6
    split_budget  of builder "best": share of references that spatial splits may add, 0 to 16
    instances     (k, 3, 4) or (k, 4, 4) float32 or float64: a matrix for each instance of a mesh, whose points p lie at
                  m[:3, :3] @ p + m[:3, 3]. None: each mesh lies where its vertices say
    instance_meshes  with `instances`: (k,) integers, the mesh of each, from 0; None: 0
    masks         with `instances`: (k,) whole numbers below 2^32, as set_masks() says; None: all bits
    layout        which meshes lie in one tree. "auto": all, unless `instances` are given. "merge": those that are
                  placed once, by the identity. "separate": none, so that each moves at its own cost
    cache         keep the tree on disk, in $XDG_CACHE_HOME/ballot
    updates       how trees follow set_vertices(). "refit": boxes move, the shape stays, so traces slow down as
                  triangles move apart. "rebuild": anew. "auto": refits until queries have lost as much time as a build
                  takes
    expected_rays hint for builder "auto": rays that will be traced in all; 0: unknown

    Meshes and instances are numbered from 0. Without `instances` each mesh has one, with its own number. HIT's prim
    counts the triangles of the first instance, then those of the second, and so on; columns "instances" and "prims"
    name instance and triangle. Triangles without area keep their number and are never hit. commit() edits the scene.
    The scene copies what it needs; contiguous float32 and uint32 arrays are read in place. float64 is rounded, with a
    PrecisionWarning if that moves a vertex by more than 2^-20 of its mesh's size. Raises ValueError, which names mesh
    and vertex or index, if a number is not finite, an index is out of range, a mesh is empty, or there are more than
    2^31 - 1 triangles.

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
        instances: Any = None,
        instance_meshes: Any = None,
        masks: Any = None,
        layout: str = "auto",
        builder: str = "",
        max_leaf: int = 6,
        split_budget: float = 0.5,
        cache: bool = False,
        updates: str = "auto",
        expected_rays: float = 0,
    ):
        given = _scene_arguments.pairs(vertices, triangles, meshes)
        numbers, directions = _scene_arguments.one_each(ids, normals, len(given), meshes is None)
        made = [
            _mesh.make(v, t, i, n, f"mesh {k}" if meshes is not None else "mesh", bool(soup))
            for k, ((v, t), i, n) in enumerate(zip(given, numbers, directions))
        ]
        self._options = _scene_arguments.options(
            builder, max_leaf, split_budget, cache, updates, expected_rays, layout=layout
        )
        self._path: str | None = None
        self._device = device
        self._time: tuple[int, float] | None = None
        placed = _scene_arguments.instances(instances, instance_meshes, masks, made)
        self._open([tuple(m) for m in made], placed)
        self._first: tuple[int, int | None] = (len(made), None if placed is None else len(placed[0]))
        own: dict[int, _mesh.Mesh | None] = {
            k: _mesh.kept(m, n) for k, (m, n) in enumerate(zip(made, directions))
        }
        self._begin(own, len(made) if placed is None else len(placed[0]))

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
    def animations(self) -> list[Animation]:
        """The animations of a scene that was loaded from a glTF file."""
        return [Animation(*animation) for animation in self._handle.animations()]

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

    def trace(
        self,
        rays: Any = None,
        *,
        origins: Any = None,
        directions: Any = None,
        t: Any = None,
        out: Any = None,
        any: bool = False,
        method: str = "auto",
        numeric: str = "watertight",
        knobs: Mapping[str, Any] | None = None,
        ray_class: str | None = None,
        progress: Progress | None = None,
        times: list[Times] | None = None,
    ) -> np.ndarray:
        """Traces rays and returns their hits.

        rays       (..., 8): origin x y z, t_min, direction x y z, t_max; or (..., 6): origin, direction, with t from 0
                   without a bound; or an array of dtype RAY. NumPy, DLPack on the CPU, or nested lists. float32 and
                   float64 are read in place, at any strides; float64 is rounded. Neighbours share a subgroup: order
                   rays for coherence
        origins, directions  instead of rays: (..., 3) each. Their other axes broadcast as NumPy's do: one origin for
                   all directions, one direction for all origins, each with each
        t          (t_min, t_max) for all but rays of 8 numbers: numbers, or arrays that broadcast to the rays' shape;
                   None: 0, and no end. A number that is NaN, or a t_min above t_max, is an error; in arrays it is a
                   dead ray
        out        where hits go: an array of dtype HIT and the rays' shape, or float32 of shape (..., 4)
        any        True: some hit, for visibility; False: the nearest
        method     a traversal method, such as "packet" (`ballot methods` and the README list them); "auto" takes the
                   fastest one
        numeric    "watertight", "exact", "plain" or "fast"
        knobs      settings of the method, such as {"vote": "count"}
        ray_class  for method auto: a ray kind ("primary", "shadow", "ao", "diffuse", ...), or "coherent",
                   "mixed", "incoherent"; None: it looks at the rays
        progress   called with the share done, 0 to 1, before the call waits and after about each million rays;
                   returning False ends the call with Error (Code.INTERRUPTED). It must not call ballot.
        times      a list that the Times of the call are appended to

        Returns HIT of shape (...): t, prim, u, v. t counts multiples of the direction, which need not be of unit
        length. On a miss prim is MISS, t infinity, u = v = 0. A ray is
        dead, and misses, if t_max <= t_min, if a number is NaN or infinite (but t_max), or if its direction is zero.

        Memory of results that were let go of is kept for the next ones: up to a 32nd of the machine's, at most 1 GiB.
        Other threads run meanwhile. Ctrl-C ends the call, as every call of ballot, within half a second; `out` is then
        half-written, perhaps for some time yet.
        Raises TypeError and ValueError for wrong arguments, before anything is written.
        """
        source = _sources.rays(rays, t, origins, directions)
        asked = _query.query(any, method, numeric, knobs, ray_class)
        hits = _arrays.out_array(out, source.shape, HIT, source[1:])
        results = _ballot.Results(hits=_arrays.flat(hits))
        spent = self._handle.trace(source, results, asked, _query.progress_function(progress))
        if times is not None:
            times.append(Times(*spent))
        return hits

    def trace_columns(
        self,
        rays: Any = None,
        columns: Sequence[str] = ("t", "prims", "mesh_ids", "uvs", "normals"),
        *,
        origins: Any = None,
        directions: Any = None,
        t: Any = None,
        out: Mapping[str, Any] | None = None,
        any: bool = False,
        method: str = "auto",
        numeric: str = "watertight",
        knobs: Mapping[str, Any] | None = None,
        ray_class: str | None = None,
        progress: Progress | None = None,
        times: list[Times] | None = None,
    ) -> dict[str, np.ndarray]:
        """Traces rays and returns an array for each column that is asked for. Arguments as trace(), and

        columns  "t"         (...) float32: distance; on a miss infinity
                 "prims"     (...) uint32: number of the triangle within its mesh; on a miss MISS
                 "mesh_ids"  (...) uint32: id of the mesh, or as load_scene(ids=) says; on a miss MISS
                 "uvs"       (..., 2) float32: weights of the vertices 1 and 2; on a miss 0
                 "normals"   (..., 3) float32: unit normal, by the right-hand rule over the vertices; on a miss 0
                 "occluded"  (...) bool: True for a hit
                 "instances" (...) uint32: number of the instance; on a miss MISS
        out      arrays for some of the columns, by name
        """
        source = _sources.rays(rays, t, origins, directions)
        asked = _query.query(any, method, numeric, knobs, ray_class)
        arrays = _arrays.columns(columns, _COLUMNS, source.shape, source[1:], out)
        results = _ballot.Results(**{name: _arrays.flat(array) for name, array in arrays.items()})
        spent = self._handle.trace(source, results, asked, _query.progress_function(progress))
        if times is not None:
            times.append(Times(*spent))
        return arrays

    def occluded(
        self,
        rays: Any = None,
        *,
        origins: Any = None,
        directions: Any = None,
        t: Any = None,
        out: Any = None,
        **query: Any,
    ) -> np.ndarray:
        """Returns True for each ray that hits something between its t_min and t_max: bool of shape (...).

        Arguments as trace(); `out` is bool or uint8. A query for some hit is often several times as fast as one for the
        nearest.
        """
        query.setdefault("any", True)
        given = None if out is None else {"occluded": out}
        return self.trace_columns(
            rays, ("occluded",), origins=origins, directions=directions, t=t, out=given, **query
        )["occluded"]

    def submit(
        self,
        rays: Any = None,
        *,
        origins: Any = None,
        directions: Any = None,
        t: Any = None,
        out: Any = None,
        any: bool = False,
        method: str = "auto",
        numeric: str = "watertight",
        knobs: Mapping[str, Any] | None = None,
        ray_class: str | None = None,
    ) -> Job:
        """Begins a trace in the background. Arguments as trace(). Jobs of a device run in the order of their
        submission.

        `rays` and `out` must not change until the job has ended. Wrong names of methods and knobs raise ValueError in
        Job.wait().
        """
        source = _sources.rays(rays, t, origins, directions)
        asked = _query.query(any, method, numeric, knobs, ray_class)
        hits = _arrays.out_array(out, source.shape, HIT, source[1:])
        numbers = _arrays.flat(hits)
        job = self._handle.submit(source, _ballot.Results(hits=numbers), asked, (source, numbers))
        return Job(job, hits)

    def trace_arrays(
        self,
        rays: Array,
        hits: Array,
        count: int | None = None,
        *,
        any: bool = False,
        method: str = "auto",
        numeric: str = "watertight",
        knobs: Mapping[str, Any] | None = None,
        ray_class: str | None = None,
    ) -> Times:
        """Traces the first `count` rays (None: all) of an array on the device and writes their hits to another.

        Returns Times once the hits are written; they are not counted. If another interface, such as CUDA, filled the
        rays, wait for its stream first. Raises ValueError if an array is of another device, of the wrong kind or too
        small.
        """
        for array, name in ((rays, "rays"), (hits, "hits")):
            if not isinstance(array, Array):
                raise TypeError(f"{name}: found {type(array).__name__}; expected a ballot.Array")
        number = len(rays) if count is None else _query.integer(count, "count", 0, 2**32 - 1)
        asked = _query.query(any, method, numeric, knobs, ray_class)
        return Times(*self._handle.trace_arrays(rays._handle, hits._handle, number, asked))

    def make_rays(self, view: Any = None, kind: str = "primary", width: int = 512, height: int = 512) -> np.ndarray:
        """Returns the rays of a kind for a view: (n, 8) float32, in the order that suits the device (tiles of pixels).

        view   None: the scene's first; a name; or a dict of eye and target, (3,), and perhaps up, yfov (full vertical
               angle in radians) and ymag (orthographic: half the height)
        kind   "primary", "shadow", "ao", ...: `ballot methods` lists them; each is made from primary hits
        """
        w, h = _query.integer(width, "width", 1, 16384), _query.integer(height, "height", 1, 16384)
        return self._handle.make_rays(_query.view(view), _query.text(kind, "kind"), w, h)

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
        self._open(*_pickles.source_of(state))
        _pickles.restore(self, state)
        self._time = state["time"]
        if self._time is not None:
            self._handle.set_time(*self._time)
