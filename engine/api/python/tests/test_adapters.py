"""Meshes of other libraries, at every door that takes a mesh: stand-ins with their members, and the libraries' own
where they are installed."""

import pickle
import types
import unittest

import ballot
import numpy as np
import reference as ref

try:
    import meshio
except ImportError:
    meshio = None
try:
    import trimesh
except ImportError:
    trimesh = None

V, T = ref.CUBE_VERTICES, ref.CUBE_TRIANGLES
QUADS = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [3, 7, 6, 2], [1, 2, 6, 5], [0, 4, 7, 3]])


class PolyData:
    """A surface as PyVista has it: faces are numbers of corners, each before its corners."""

    def __init__(self, points, faces, n_strips=0, lines=()):
        self.points, self.n_strips, self.lines, self.verts = points, n_strips, np.array(lines, int), np.array([], int)
        self.faces = np.concatenate([[len(f), *f] for f in faces]) if len(faces) else np.array([], int)
        self.given = faces

    def triangulate(self):
        fans = [[f[0], b, c] for f in self.given for b, c in zip(f[1:], f[2:])]
        return PolyData(self.points, fans)


def cells(*blocks):
    """Returns a mesh as meshio has it."""
    return types.SimpleNamespace(points=V, cells=[types.SimpleNamespace(type=t, data=np.array(d)) for t, d in blocks])


def node_scene(*nodes):
    """Returns a scene as trimesh has it, of (matrix, vertices, faces)."""
    geometry = {str(k): types.SimpleNamespace(vertices=v, faces=f) for k, (_, v, f) in enumerate(nodes)}

    class Graph(dict):
        nodes_geometry = list(geometry)

    return types.SimpleNamespace(geometry=geometry, graph=Graph({str(k): (n[0], str(k)) for k, n in enumerate(nodes)}))


MESHES = {
    "trimesh": types.SimpleNamespace(vertices=V.astype(float), faces=T.astype(np.int64)),
    "Open3D": types.SimpleNamespace(vertices=V.astype(float), triangles=T.astype(np.int32)),
    "Open3D, t": types.SimpleNamespace(
        vertex=types.SimpleNamespace(positions=V), triangle=types.SimpleNamespace(indices=T)
    ),
    "PyVista": PolyData(V, T),
    "PyVista, quadrilaterals": PolyData(V, QUADS),
    "PyVista, both": PolyData(V, [*T[:10].tolist(), [0, 4, 7, 3]]),
    "meshio": cells(("triangle", T)),
    "meshio, quadrilaterals": cells(("quad", QUADS)),
    "meshio, both": cells(("triangle", T[:10]), ("quad", [[0, 4, 7, 3]])),
    "trimesh.Scene": node_scene((np.eye(4), V, T[:7]), (np.eye(4), V, T[7:])),
    "a pair": (V, T),
}


class Adapters(unittest.TestCase):
    def is_the_cube(self, mesh):
        """Every door takes the mesh, which is a closed cube from -1 to 1, wound outwards."""
        at = np.float32([[0.2, 0.3, 0.5], [0.2, 0.3, 1.5]])
        scenes = [ballot.Scene(meshes=[mesh])]
        if not isinstance(mesh, tuple):
            scenes.append(ballot.Scene(mesh))
        for scene in scenes:
            self.assertEqual(scene.info.triangles, 12)
            got = scene.nearest(at, ("signed_distances", "normals"), sign="pseudonormal")
            np.testing.assert_allclose(got["signed_distances"], [-0.5, 0.5], atol=1e-6)
            np.testing.assert_allclose(got["normals"], [[0, 0, 1]] * 2, atol=1e-6)
        open3d = ballot.RaycastingScene()
        open3d.add_triangles(mesh)
        self.assertEqual(open3d.compute_occupancy(at).tolist(), [1, 0])
        self.assertEqual(ballot.trimesh_ray.RayMeshIntersector(mesh).contains_points(at).tolist(), [True, False])

    def test_every_door(self):
        for name, mesh in MESHES.items():
            with self.subTest(name):
                self.is_the_cube(mesh)

    def test_mirrored_and_moved_nodes(self):
        mirror = np.diag([-0.5, 1, 1, 1.0])  # half a cube, mirrored to the other half
        mirror[0, 3] = -0.5
        half = np.diag([0.5, 1, 1, 1.0])
        half[0, 3] = 0.5
        open_half = np.delete(T, [10, 11], axis=0)  # without its side at x = -1, where the halves meet
        scene = node_scene((half, V, open_half), (mirror, V, open_half))
        for made in (ballot.Scene(scene), ballot.Scene(meshes=[scene])):
            self.assertEqual(made.info.instance_triangles, 20)
            at = [[-0.9, 0.1, 0.2], [0.9, 0.1, 0.2]]
            got = made.nearest(at, ("signed_distances", "normals"), sign="pseudonormal")
            np.testing.assert_allclose(got["signed_distances"], [-0.1, -0.1], atol=1e-6)
            np.testing.assert_allclose(got["normals"], [[-1, 0, 0], [1, 0, 0]], atol=1e-6)
        if trimesh is not None:
            own = trimesh.Scene()
            for k, matrix in enumerate((half, mirror)):
                own.add_geometry(trimesh.Trimesh(V, open_half, process=False), str(k), transform=matrix)
            np.testing.assert_allclose(ballot.Scene(meshes=[own]).triangles(), made.triangles())
            np.testing.assert_allclose(ballot.Scene(meshes=[own]).triangles(), own.to_mesh().triangles)

    def test_nodes_are_instances(self):
        scene = node_scene((np.eye(4), V, T), (np.eye(4), V, T[:4]))
        far, mirrored = np.eye(4), np.diag([1, 1, -1.0, 1])
        far[:3, 3], mirrored[:3, 3] = (10, 0, 0), (20, 0, 0)
        graph = scene.graph
        graph.update({"again": (far, "0"), "mirrored": (mirrored, "0")})
        graph.nodes_geometry = list(graph)
        made = ballot.Scene(scene)
        self.assertEqual([m.name for m in made.meshes], ["0", "1", "0"])
        self.assertEqual([m.triangles for m in made.meshes], [12, 4, 12])
        self.assertEqual([i.mesh for i in made.instances], [0, 1, 0, 2])
        np.testing.assert_array_equal(made.instances[2].transform, far[:3])
        at = np.float32([[0, 0, 5], [10, 0, 5], [20, 0, 5]])
        found = made.trace_columns(np.c_[at, np.tile([0, 0, -1.0], (3, 1))], ("t", "instances", "front", "mesh_ids"))
        self.assertEqual(found["t"].tolist(), [4, 4, 4])
        self.assertEqual((found["instances"].tolist()[1:], found["front"].tolist()), ([2, 3], [True] * 3))
        self.assertEqual(ballot.Scene(scene, names=["a", "b", "c"], ids=[4, 5, 6]).find_meshes("c"), [2])
        one = ballot.Scene(scene, instances=[far])
        self.assertEqual((len(one.meshes), one.info.instance_triangles), (1, 40))
        edited = ballot.Scene(V, T)
        number = edited.add_mesh(scene)
        edited.add_instances([far], number)
        edited.commit()
        self.assertEqual(edited.info.triangles, 52)
        np.testing.assert_array_equal(pickle.loads(pickle.dumps(made)).trace(np.c_[at, at * 0 - [0, 0, 1.0]]),
                                      made.trace(np.c_[at, at * 0 - [0, 0, 1.0]]))  # fmt: skip

    def test_a_quadrilateral_with_a_corner_that_points_inwards(self):
        points = np.array([[0, 0, 0], [4, 0, 0], [1, 1, 0], [0, 4, 0.0]])  # area 4: corner 2 points inwards
        for quad in ([0, 1, 2, 3], [1, 2, 3, 0], [2, 3, 0, 1], [3, 0, 1, 2]):
            block = types.SimpleNamespace(type="quad", data=np.array([quad]))
            corners = ballot.Scene(types.SimpleNamespace(points=points, cells=[block])).triangles()
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            self.assertTrue((normals[:, 2] > 0).all(), quad)
            self.assertEqual(normals[:, 2].sum() / 2, 4)

    def test_refused(self):
        class Map:  # as Open3D's
            def __getattr__(self, name):
                raise KeyError(name)

        empty = types.SimpleNamespace(vertex=Map(), triangle=Map())
        path = types.SimpleNamespace(vertices=V, entities=[])
        paths = node_scene((np.eye(4), V, T))
        paths.geometry["0"] = path
        grid = types.SimpleNamespace(points=V, cells=np.arange(9), extract_surface=None)
        for error, text, mesh in (
            (ValueError, "cells of type 'tetra'.*cells_dict", cells(("triangle", T), ("tetra", [[0, 1, 2, 3]]))),
            (ValueError, "no triangles; leave empty meshes out", cells()),
            (ValueError, "no triangles; leave empty meshes out", PolyData(V, [])),
            (ValueError, "it has lines besides its faces; pass PolyData", PolyData(V, T, lines=[2, 0, 1])),
            (ValueError, "leave empty meshes out", empty),
            (ValueError, "geometry '0' is a SimpleNamespace; expected meshes; pass to_mesh", paths),
            (ValueError, "leave empty meshes out", node_scene()),
            (ValueError, r"pass its extract_surface\(\)", grid),
            (TypeError, "found SimpleNamespace; expected", path),
        ):
            doors = (
                ballot.Scene,
                lambda m: ballot.Scene(meshes=[m]),
                ballot.RaycastingScene().add_triangles,
                lambda m: ballot.trimesh_ray.RayMeshIntersector(m).contains_points([[0, 0, 0]]),
            )
            for door in doors:
                with self.subTest(text), self.assertRaisesRegex(error, text) as caught:
                    door(mesh)
                self.assertNotIn("\n", str(caught.exception))

    @unittest.skipIf(meshio is None, "meshio is not installed")
    def test_meshio(self):
        self.is_the_cube(meshio.Mesh(V, [("triangle", T[:10]), ("quad", [[0, 4, 7, 3]])]))

    @unittest.skipIf(trimesh is None, "trimesh is not installed")
    def test_trimesh(self):
        self.is_the_cube(trimesh.creation.box([2, 2, 2]))
        self.is_the_cube(trimesh.Scene(trimesh.creation.box([2, 2, 2])))


if __name__ == "__main__":
    unittest.main()
