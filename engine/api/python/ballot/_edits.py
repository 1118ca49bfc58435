"""Edits of scenes: meshes and instances that come, go and move, all at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from . import _arrays, _attributes, _ballot, _errors, _mesh, _query, _scene_arguments
from ._array import Array, there
from ._device import Device
from ._door import InstanceInfo, MeshInfo, SceneInfo
from ._mesh import Mesh

_MOST = 2**32 - 2
_ORIGIN = SceneInfo._fields.index("origin")


class Edits:
    """The part of a Scene that edits it.

    Edits gather until commit() makes all of them true at once. Until then answers are those of the scene as it was.
    Meshes and instances are named by their numbers, which stay; a number is given once. A call that raises adds nothing
    to the edits. Scenes with animations refuse edits: set_time() moves them.
    """

    _handle: _ballot.Scene
    _device: Device | None
    _own: dict[int, Mesh | None]  # what meshes were made of, by number; None: a file
    _moved: set[int]  # the meshes of a file that have moved
    _next: list[int]  # the numbers of meshes and instances that come next
    _edited: bool  # it may differ from what it was made of
    _changed: dict[int, Mesh | None]  # what edits make of meshes; None: nothing
    _held: dict[int | str, np.ndarray | Array]  # what commit() reads
    _boxes: dict[int, np.ndarray] | None  # middle and half the size of meshes, by number; None: not known yet
    _origins: dict[int, tuple[float, float, float]]  # of these meshes
    _places: np.ndarray | None  # number and mesh of each instance; None: not known yet

    def _begin(self, own: dict[int, Mesh | None], instances: int) -> None:
        """Takes what the scene was made of."""
        self._own, self._moved, self._next, self._edited = own, set(), [len(own), instances], False
        self._changed, self._held, self._boxes, self._places = {}, {}, None, None

    @property
    def meshes(self) -> list[MeshInfo]:
        """The meshes, in the order of their numbers and of their triangles."""
        return [MeshInfo(*mesh) for mesh in self._handle.meshes()]

    @property
    def instances(self) -> list[InstanceInfo]:
        """The instances of the meshes, in the order of their numbers."""
        return [InstanceInfo(*instance) for instance in self._handle.instances()]

    @property
    def attributes(self) -> dict[str, int]:
        """The attributes that meshes have, by name: how many numbers a value has."""
        return _attributes.components(self._handle)

    def attribute(self, mesh: int, name: str) -> np.ndarray:
        """Returns the values of an attribute of a mesh, in their order: (n,) float32, or (n, c) of c numbers."""
        number = _query.integer(mesh, "mesh", 0, _MOST)
        for of, found, _, width, _, place in self._handle.attributes():
            if of == number and found == name:
                values = self._handle.attribute_values(number, place)
                return values if width == 1 else values.reshape(-1, width)
        raise ValueError(f"mesh {number} has no attribute {_query.shown(name)}")

    def find_meshes(self, name: str) -> list[int]:
        """Returns the numbers of the meshes of this name, in ascending order.

        >>> scene = ballot.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], names="roof")
        >>> scene.find_meshes("roof"), scene.meshes[0].name
        ([0], 'roof')
        """
        return list(self._handle.find_meshes(_query.text(name, "name")))

    def add_mesh(
        self, vertices: Any, triangles: Any = None, *, soup: bool = False, id: int | None = None, normals: Any = None,
        attributes: Mapping[str, Any] | None = None, name: str | None = None,
    ) -> int:
        """Adds a mesh and returns its number. It has no instance yet: add_instances() places it.

        Arguments as Scene; id None: the number; name None: "mesh N"
        """
        mesh = self._read(vertices, triangles, soup, 0xFFFFFFFF if id is None else id, normals, attributes, "mesh")
        mesh = mesh._replace(name=None if name is None else _query.text(name, "mesh: name"))
        number = self._handle.add_mesh(_mesh.passed(mesh))
        self._edited = True
        self._next[0] = number + 1
        self._change(number, mesh if id is not None else mesh._replace(id=number), normals)
        return number

    def replace_mesh(
        self, mesh: int, vertices: Any, triangles: Any = None, *, soup: bool = False, normals: Any = None,
        attributes: Mapping[str, Any] | None = None,
    ) -> None:
        """Gives a mesh other triangles, any number of them, and attributes. It keeps its instances, name and id."""
        number = _query.integer(mesh, "mesh", 0, _MOST)
        made = self._read(vertices, triangles, soup, 0, normals, attributes, f"mesh {number}")
        self._handle.replace_mesh(number, _mesh.passed(made))
        self._edited = True
        before = self._changed.get(number) or self._own.get(number)
        kept = made._replace(id=before.id if before else 0, name=before.name if before else None)
        self._change(number, kept, normals)
        self._held.pop(number, None)

    def remove_mesh(self, mesh: int) -> None:
        """Removes a mesh and its instances."""
        number = _query.integer(mesh, "mesh", 0, _MOST)
        self._handle.remove_mesh(number)
        self._edited = True
        self._changed[number] = None
        self._held.pop(number, None)

    def set_vertices(self, mesh: int, vertices: Any) -> None:
        """Moves the vertices of a mesh, in its own space.

        mesh      its number
        vertices  (n, 3) float32 or float64, as many as before; of a mesh from a file, or without triangles, its corners
                  (m, 3, 3) or (3 m, 3). Contiguous float32 is read in place, by commit(): leave it as it is until then.
                  float64 is counted from the mesh's origin, which stays.
                  Or an Array of "vertices", which commit() reads on the device: trees that lie there follow without the
                  host; wait for your own stream before

        The scene's `updates` says how the tree follows; one that a triangle gains or loses its area in is always built
        anew. commit() raises ValueError if a coordinate is not finite.
        """
        number = _query.integer(mesh, "mesh", 0, _MOST)
        if on := there(vertices, "vertices", self._device):
            self._handle.set_vertex_array(number, on._handle)
            self._edited = True
            self._held[number] = on
            return
        known = self._changed.get(number) or self._own.get(number)
        corners = known is None or (known.indices is None and known.kind is None)
        positions = _mesh.positions(vertices, f"mesh {number}: vertices", corners)
        self._handle.set_vertices(number, positions)
        self._edited = True
        self._held[number] = positions

    def set_heights(self, mesh: int, heights: Any) -> None:
        """Moves a mesh of heights, as set_vertices() moves others.

        mesh     its number
        heights  (rows, columns), as many as before, as in heights(); read at once. Where others are NaN than before the
                 tree is built anew
        """
        number = _query.integer(mesh, "mesh", 0, _MOST)
        raster = _mesh.raster(heights, f"mesh {number}: heights")
        columns = self._columns(number)
        if columns not in (0, raster.shape[1]):
            raise ValueError(f"mesh {number}: heights: shape is {raster.shape}; expected {columns} columns, as before")
        self._handle.set_heights(number, raster.reshape(-1))
        self._edited = True
        self._held[number] = raster

    def heights(self, mesh: int) -> np.ndarray:
        """Returns the heights of a mesh of these, as they were committed last: (rows, columns) float32."""
        number = _query.integer(mesh, "mesh", 0, _MOST)
        found: np.ndarray = self._handle.heights(number)
        return found.reshape(-1, self._columns(number))

    def set_attribute(self, mesh: int, name: str, values: Any) -> None:
        """Gives a mesh an attribute, in the place of one of this name that it has. No tree changes.

        values  an Attribute, or numbers of vertices as one has them; read at once

        Raises ValueError if there are not as many as what they are of, or another mesh has an attribute of this name
        with another number of components.

        >>> scene = ballot.Scene([[0, 0, 0], [4, 0, 0], [0, 4, 0]], [[0, 1, 2]])
        >>> scene.set_attribute(0, "label", ballot.Attribute(7, "mesh"))
        >>> scene.commit()
        >>> scene.trace_columns([[1, 2, 5, 0, 0, -1]], ("label",))["label"].tolist()
        [7.0]
        """
        number = _query.integer(mesh, "mesh", 0, _MOST)
        read = _attributes.read(name, values, f"mesh {number}", self._device)
        self._handle.set_attribute(number, _attributes.passed(read))
        self._edited = True

    def add_instances(self, instances: Any, meshes: Any = None, masks: Any = None, groups: Any = None) -> np.ndarray:
        """Adds instances of meshes and returns their numbers: (k,) uint32.

        instances  (k, 3, 4) or (k, 4, 4) float32 or float64: a matrix for each, as in Scene
        meshes     the number of one mesh, or (k,) integers; None: 0
        masks      as in set_masks(); None: all bits
        groups     as in set_groups(); None: SHARED
        """
        matrices = _arrays.as_numpy(instances, "instances")
        if meshes is not None and np.ndim(meshes) == 0:
            meshes = np.full(len(matrices), _query.integer(meshes, "meshes", 0, _MOST), np.uint32)
        given = _mesh.instances(matrices, meshes, masks, groups)
        self._warn_of_places(given[0], given[1])
        numbers = self._handle.add_instances(given)
        self._edited = True
        self._next[1] = max([self._next[1], *(int(n) + 1 for n in numbers[-1:])])
        return numbers

    def remove_instances(self, instances: Any) -> None:
        """Removes instances: one number, or (k,) integers."""
        self._handle.remove_instances(_mesh.numbers(instances, "instances"))
        self._edited = True

    def set_transforms(self, transforms: Any, instances: Any = None) -> None:
        """Moves instances.

        transforms  (k, 3, 4) or (k, 4, 4) float32 or float64, a matrix for each; of one instance its matrix. For all
                    also an Array of "transforms", which commit() reads on a GPU if there are 1024 or more; then no
                    other edits but of vertices
        instances   their numbers; None: all, in the order of their numbers

        A mesh that lay in one tree with others gets its own. The trees of the meshes stay, the one over the instances
        moves. commit() raises ValueError if a matrix is refused.
        """
        if on := there(transforms, "transforms", self._device):
            if instances is not None:
                raise TypeError("instances: found beside an Array of transforms, which are of all; expected None")
            self._handle.set_transform_array(on._handle)
            self._edited = True
            self._held["transforms"] = on
            return
        which = None if instances is None else _mesh.numbers(instances, "instances")
        if instances is not None and np.ndim(instances) == 0:
            transforms = [transforms]
        matrices = _mesh.transforms(transforms)
        if which is not None and len(which) != len(matrices):
            raise ValueError(f"transforms: found {len(matrices)}; expected {len(which)}, one for each instance")
        self._warn_of_places(matrices, None if matrices.dtype != np.float64 else self._meshes_of(which))
        self._handle.set_transforms(matrices, which)
        self._edited = True
        if which is None:
            self._held["transforms"] = matrices

    def set_masks(self, instances: Any, masks: Any) -> None:
        """Sets the masks of instances.

        instances  their numbers; None: all, in the order of their numbers
        masks      whole numbers below 2^32, one for each. Of all also an Array of "uint32", or an array of CUDA's,
                   which commit() reads

        An instance of mask 0 is met by nothing. A ray leaves out an instance whose mask shares no bit with its own
        (trace()'s masks).
        """
        if on := there(masks, "uint32", self._device):
            if instances is not None:
                raise TypeError("instances: found beside an Array of masks, which are of all; expected None")
            self._handle.set_mask_array(on._handle)
            self._edited = True
            self._held["masks"] = on
            return
        which = self._numbers(instances)
        self._handle.set_masks(which, _mesh.words(masks, "masks", len(which)))
        self._edited = True

    def set_groups(self, instances: Any, groups: Any) -> None:
        """Sets the groups of instances.

        instances  their numbers; None: all, in the order of their numbers
        groups     whole numbers below 2^32, one for each; SHARED: questions of all groups meet the instance

        Rays and points of a group (trace()'s groups) meet its instances and the shared ones alone: each copy of an
        environment is one. Thousands of copies may lie in one place; a ray passes by the others at once.
        """
        which = self._numbers(instances)
        self._handle.set_groups(which, _mesh.words(groups, "groups", len(which)))
        self._edited = True

    def commit(self) -> None:
        """Makes the edits true at once, or raises: then the scene is as it was. The edits are gone either way.

        Trees of meshes that have not changed stay. Raises ValueError, which names mesh and vertex, or the instance, if
        something cannot be; Error if the device fails. After Ctrl-C it may have happened.
        """
        changed, held = self._changed, self._held
        self._changed, self._held = {}, {}
        self._handle.commit(list(held.values()))
        for number, mesh in changed.items():
            self._moved.discard(number)
            if mesh is None:
                self._own.pop(number, None)
            else:
                self._own[number] = mesh
        for key, at in held.items():
            own = self._own.get(key) if isinstance(key, int) else None
            is_told = own is None or not own.kind or own.grid is not None  # else nobody else can tell its vertices
            if isinstance(key, int) and own is not None and not is_told:
                self._own[key] = own._replace(vertices=at.copy() if isinstance(at, np.ndarray) else at.read())
        self._moved.update(n for n in held if isinstance(n, int) and self._own.get(n) is None)
        self._boxes = self._places = None
        moved = {n: f"mesh {n}: vertices" for n, v in held.items() if isinstance(n, int) and _mesh.is_moved(v)}
        if moved:
            _mesh.warn_of_rounding(self.meshes, moved)

    def discard(self) -> None:
        """Drops the edits."""
        self._handle.discard()
        self._changed, self._held = {}, {}

    def _columns(self, mesh: int) -> int:
        """Returns the columns of a mesh of heights; 0 of others."""
        known = self._changed.get(mesh) or self._own.get(mesh)
        if known is not None:
            return known.grid[0] if known.grid else 0
        return {m.mesh: m.columns for m in self.meshes}.get(mesh, 0)

    def _numbers(self, instances: Any) -> np.ndarray:
        """Returns the numbers of instances; None: of all."""
        return _mesh.numbers([i.instance for i in self.instances] if instances is None else instances, "instances")

    def _read(
        self, vertices: Any, triangles: Any, soup: bool, mesh_id: Any, normals: Any, attributes: Any, where: str
    ) -> Mesh:
        ((v, t),) = _scene_arguments.pairs(vertices, triangles, None)
        made = _mesh.make(v, t, mesh_id, normals, where, bool(soup), self._device)
        return made._replace(attributes=_attributes.read_all(attributes, where, self._device))

    def _change(self, number: int, mesh: Mesh, normals: Any) -> None:
        if self._boxes is not None:
            known = not isinstance(mesh.vertices, np.ndarray) or mesh.vertices.dtype == np.float32  # else about what?
            self._boxes[number] = _mesh.box(mesh) if known else np.full((2, 3), np.nan)
        self._changed[number] = _mesh.kept(mesh, normals)

    def _warn_of_places(self, matrices: np.ndarray, meshes: np.ndarray | None) -> None:
        """Warns if float32 moves an instance of a mesh, by its number, by too much."""
        if meshes is None or matrices.dtype != np.float64:
            return
        boxes = self._boxes_of(meshes)
        if boxes is None or len(boxes) != len(matrices):
            return
        origins = np.array([self._origins.get(int(m), (0, 0, 0)) for m in meshes], np.float64).reshape(-1, 3)
        scene = np.asarray(self._handle.info()[_ORIGIN], np.float64)
        if text := _mesh.moved_place(_mesh.places(matrices, origins, scene), boxes):
            _errors.warn(text)

    def _boxes_of(self, meshes: np.ndarray) -> np.ndarray | None:
        """Returns the middle and half the size of the bounds of meshes, by their numbers: (k, 2, 3); None: there is no
        such mesh."""
        if self._boxes is None:
            self._boxes = {m.mesh: _mesh.box_of(m.lo, m.hi) for m in self.meshes}
            self._origins = {m.mesh: m.origin for m in self.meshes}
        known, inverse = np.unique(meshes, return_inverse=True)
        if not all(int(m) in self._boxes for m in known):
            return None
        return np.array([self._boxes[int(m)] for m in known]).reshape(-1, 2, 3)[inverse]

    def _meshes_of(self, instances: np.ndarray | None) -> np.ndarray:
        """Returns the numbers of the meshes of instances; those that an edit adds are left out."""
        if self._places is None:
            self._places = np.array([(i.instance, i.mesh) for i in self.instances], np.uint32).reshape(-1, 2)
        if instances is None:
            return self._places[:, 1]
        if len(self._places) == 0:
            return self._places[:, 1]
        at = np.minimum(np.searchsorted(self._places[:, 0], instances), len(self._places) - 1)
        known: np.ndarray = self._places[at]
        found: np.ndarray = known[known[:, 0] == instances, 1]
        return found
