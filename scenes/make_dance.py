#!/usr/bin/env python3
"""Makes scenes/dance.gltf: a skinned worm, a blob with morph targets, turning boxes, and a lamp and a camera that move.

Metres, +y up. Animation "dance" lasts 4 s and ends as it begins; "nod" moves the worm's head alone, for 1 s."""

import array
import math
import os

from gltf_writer import Mesh, Scene, cross, looking, material, run, sub, unit

BONES, BONE = 4, 0.3  # the joints of the worm, and the metres from one to the next


def turn(axis, degrees):
    """Returns the quaternion (x, y, z, w) of a turn about an axis: 0, 1 or 2."""
    half = math.radians(degrees) / 2
    q = [0.0, 0.0, 0.0, math.cos(half)]
    q[axis] = math.sin(half)
    return [round(c, 7) for c in q]


def smooth_normals(positions, indices):
    """Returns the unit normal of each vertex from its triangles; vertices at one place share theirs."""
    at = [tuple(round(c, 6) for c in positions[3 * v:3 * v + 3]) for v in range(len(positions) // 3)]
    sums = {}
    for k in range(0, len(indices), 3):
        a, b, c = (at[v] for v in indices[k:k + 3])
        face = cross(sub(b, a), sub(c, a))
        for place in (a, b, c):
            sums[place] = tuple(s + f for s, f in zip(sums.get(place, (0, 0, 0)), face))
    return [c for place in at for c in unit(sums[place])]


def without_slivers(mesh):
    """Leaves out the triangles at the poles of a sphere that have no area: with one that gains some in a move, or loses
    it, the tree is built anew."""
    at = [tuple(round(c, 6) for c in mesh.at(v)) for v in range(len(mesh.positions) // 3)]
    mesh.positions = array.array("f", [c for place in at for c in place])
    kept = [mesh.indices[k:k + 3] for k in range(0, len(mesh.indices), 3)]
    mesh.indices = array.array("I", [v for t in kept if len({at[v] for v in t}) == 3 for v in t])


class MovingScene(Scene):
    """Adds to a Scene nodes with meshes of their own, skins, morph targets and animations."""

    def __init__(self):
        super().__init__()
        self.built = None

    def triangle_count(self):
        if not self.built:
            return super().triangle_count()
        count = [sum(self.built["accessors"][p["indices"]]["count"] for p in mesh["primitives"]) // 3
                 for mesh in self.built["meshes"]]
        return sum(count[node["mesh"]] for node in self.built["nodes"] if "mesh" in node)

    def document(self):
        self.built, self.data = super().document()
        self.data = bytearray(self.data)
        self.add_motion()
        self.built["buffers"] = [{"byteLength": len(self.data)}]
        return self.built, bytes(self.data)

    def accessor(self, values, kind, typecode="f"):
        raw = array.array(typecode, values)
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[kind]
        while len(self.data) % 4:
            self.data.append(0)
        self.built["bufferViews"].append({"buffer": 0, "byteOffset": len(self.data),
                                          "byteLength": len(raw) * raw.itemsize})
        self.data.extend(raw.tobytes())
        made = {"bufferView": len(self.built["bufferViews"]) - 1, "count": len(values) // width, "type": kind,
                "componentType": {"f": 5126, "B": 5121, "H": 5123}[typecode]}
        if typecode == "f" and width in (1, 3):
            made["min"] = [min(raw[k::width]) for k in range(width)]
            made["max"] = [max(raw[k::width]) for k in range(width)]
        self.built["accessors"].append(made)
        return len(self.built["accessors"]) - 1

    def mesh(self, name, mesh, color, **options):
        """Adds a mesh of one primitive and its material. Returns its number and the primitive."""
        self.built["materials"].append(material(name, color, **options))
        primitive = {"attributes": {"POSITION": self.accessor(mesh.positions, "VEC3"),
                                    "NORMAL": self.accessor(mesh.normals, "VEC3")},
                     "indices": self.accessor(mesh.indices, "SCALAR", "H"),
                     "material": len(self.built["materials"]) - 1}
        self.built["meshes"].append({"name": name, "primitives": [primitive]})
        return len(self.built["meshes"]) - 1, primitive

    def node(self, name, parent=None, **content):
        self.built["nodes"].append({"name": name, **content})
        number = len(self.built["nodes"]) - 1
        owner = self.built["scenes"][0]["nodes"] if parent is None else \
            self.built["nodes"][parent].setdefault("children", [])
        owner.append(number)
        return number

    def animation(self, name):
        self.built.setdefault("animations", []).append({"name": name, "channels": [], "samplers": []})

    def channel(self, node, path, times, values, interpolation="LINEAR"):
        """Adds a channel to the last animation. `values` has a list for each key frame."""
        flat = [c for value in values for c in value]
        kind = {"rotation": "VEC4", "weights": "SCALAR"}.get(path, "VEC3")
        animation = self.built["animations"][-1]
        animation["samplers"].append({"input": self.accessor(times, "SCALAR"), "output": self.accessor(flat, kind),
                                      "interpolation": interpolation})
        animation["channels"].append({"sampler": len(animation["samplers"]) - 1,
                                      "target": {"node": node, "path": path}})

    def add_worm(self):
        """Adds a tapered tube that stands up, skinned to a chain of joints. Returns the joints."""
        tube, height = Mesh(), BONES * BONE
        tube.lathe((0, 0, 0), [(0.11 * math.sqrt(max(1 - v * v, 0)) + 0.02 * (1 - v), height * v)
                               for v in (k / 32 for k in range(33))], 20)
        number, primitive = self.mesh("worm", tube, (0.75, 0.3, 0.12), roughness=0.5)
        joints, weights = [], []
        for y in tube.positions[1::3]:
            along = min(max(y / BONE - 0.5, 0), BONES - 1)
            low = min(int(along), BONES - 2)
            joints += [low, low + 1, 0, 0]
            weights += [1 - (along - low), along - low, 0, 0]
        primitive["attributes"]["JOINTS_0"] = self.accessor(joints, "VEC4", "B")
        primitive["attributes"]["WEIGHTS_0"] = self.accessor(weights, "VEC4")
        bones, bind = [], []
        for k in range(BONES):
            place = [-0.8, 0, 0] if k == 0 else [0, BONE, 0]
            bones.append(self.node(f"bone{k}", bones[-1] if bones else None, translation=place))
            bind += [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -k * BONE, 0, 1]
        self.built["skins"] = [{"name": "worm", "joints": bones, "inverseBindMatrices": self.accessor(bind, "MAT4")}]
        self.node("worm", mesh=number, skin=0)
        return bones

    def add_blob(self):
        """Adds a sphere with two morph targets: flat, and with bumps. Returns its node."""
        ball = Mesh()
        ball.sphere((0, 0, 0), 0.35, 32, 20)
        without_slivers(ball)
        number, primitive = self.mesh("blob", ball, (0.12, 0.35, 0.7), roughness=0.35)
        flat, bumps = [], []
        for x, y, z in zip(*(ball.normals[k::3] for k in range(3))):
            flat += [0.12 * x, -0.2 * y, 0.12 * z]
            rise = 0.14 * math.sin(5 * math.atan2(x, z)) * math.hypot(x, z) ** 2
            bumps += [rise * x, rise * y, rise * z]
        primitive["targets"] = []
        for deltas in (flat, bumps):
            normals = smooth_normals([p + d for p, d in zip(ball.positions, deltas)], ball.indices)
            turns = [round(a - b, 6) for a, b in zip(normals, ball.normals)]
            primitive["targets"].append({"POSITION": self.accessor(deltas, "VEC3"),
                                         "NORMAL": self.accessor(turns, "VEC3")})
        self.built["meshes"][number]["weights"] = [0, 0]
        return self.node("blob", mesh=number, translation=[0, 0.4, 0.1])

    def add_boxes(self):
        """Adds a box and a smaller one that hangs on it. Returns both nodes."""
        box = Mesh()
        box.box((-0.2, -0.2, -0.2), (0.2, 0.2, 0.2))
        number, _ = self.mesh("box", box, (0.2, 0.5, 0.2), roughness=0.7)
        large = self.node("box", mesh=number, translation=[0.9, 0.6, 0])
        return large, self.node("moon", large, mesh=number, translation=[0.45, 0, 0], scale=[0.4, 0.4, 0.4])

    def add_lamp_and_camera(self):
        self.built["extensionsUsed"] = sorted({*self.built["extensionsUsed"], "KHR_lights_punctual"})
        self.built.setdefault("extensions", {})["KHR_lights_punctual"] = {
            "lights": [{"type": "point", "color": [1, 0.9, 0.75], "intensity": 9}]}
        lamp = self.node("lamp", translation=[-0.8, 1.9, 1.2], extensions={"KHR_lights_punctual": {"light": 0}})
        self.built["cameras"].append({"type": "perspective", "name": "ride",
                                      "perspective": {"yfov": 0.8, "znear": 0.01, "aspectRatio": 1}})
        pivot = self.node("pivot", translation=[0, 0.5, 0])
        self.node("ride", pivot, camera=len(self.built["cameras"]) - 1, translation=[0, 0.9, 3.2],
                  rotation=looking((0, 0.9, 3.2), (0, 0, 0)))
        return lamp, pivot

    def add_motion(self):
        bones = self.add_worm()
        blob = self.add_blob()
        box, moon = self.add_boxes()
        lamp, pivot = self.add_lamp_and_camera()
        beats = [0, 1, 2, 3, 4]
        self.animation("dance")
        for k, bone in enumerate(bones):
            lean = 10 if k == 0 else 28
            self.channel(bone, "rotation", beats, [turn(2, lean * s) for s in (0, 1, 0, -1, 0)])
        self.channel(blob, "weights", beats, [(0, 0), (1, 0), (0, 1), (0.6, 0.6), (0, 0)])
        rise = 0.5  # of the blob in its jumps: tangents for CUBICSPLINE are metres a second
        self.channel(blob, "translation", [0, 2, 4], [
            (0, 0, 0), (0, 0.4, 0.1), (0, rise, 0), (0, 0, 0), (0, 0.7, 0.1), (0, 0, 0),
            (0, -rise, 0), (0, 0.4, 0.1), (0, 0, 0)], "CUBICSPLINE")
        self.channel(box, "rotation", beats, [turn(1, a) for a in (0, 90, 180, 270, 360)])
        self.channel(moon, "scale", [0, 2, 4], [[0.4] * 3, [0.7] * 3, [0.4] * 3], "STEP")
        self.channel(lamp, "translation", [0, 2, 4], [(-0.8, 1.9, 1.2), (0.8, 1.9, 1.2), (-0.8, 1.9, 1.2)])
        self.channel(pivot, "rotation", beats, [turn(1, a) for a in (0, 30, 0, -30, 0)])
        self.animation("nod")
        self.channel(bones[-1], "rotation", [0, 0.5, 1], [turn(0, a) for a in (0, 50, 0)])


def make():
    scene = MovingScene()
    floor = scene.add_material("floor", (0.7, 0.7, 0.68))
    floor.quad((-4, 0, 2.5), (4, 0, 2.5), (4, 0, -1.2), (-4, 0, -1.2))
    floor.quad((-4, 0, -1.2), (4, 0, -1.2), (4, 4, -1.2), (-4, 4, -1.2))
    scene.add_view((0, 1.2, 4.4), (0, 0.65, 0), 42)
    return scene


if __name__ == "__main__":
    run(make, __doc__, os.path.join(os.path.dirname(os.path.abspath(__file__)), "dance.gltf"))
