"""Writes meshes, materials and cameras as glTF 2.0: .gltf with embedded data, or .glb. Standard library only."""

import argparse
import array
import base64
import json
import math
import os
import struct
import sys
import tempfile


def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
    return (a[0] / length, a[1] / length, a[2] / length) if length > 1e-12 else (0.0, 1.0, 0.0)


class Mesh:
    """Triangles of one material; every vertex has a normal."""

    def __init__(self):
        self.positions = array.array("f")
        self.normals = array.array("f")
        self.indices = array.array("I")

    def vertex(self, position, normal):
        self.positions.extend(position)
        self.normals.extend(normal)
        return len(self.positions) // 3 - 1

    def at(self, vertex):
        return tuple(self.positions[3 * vertex:3 * vertex + 3])

    def triangle(self, a, b, c):
        """Adds a triangle, counter-clockwise as seen from the side that the normal of `a` points to."""
        p = self.at(a)
        n = cross(sub(self.at(b), p), sub(self.at(c), p))
        m = self.normals[3 * a:3 * a + 3]
        if n == (0.0, 0.0, 0.0):
            return  # at the poles of spheres and the tips of lathes
        self.indices.extend((a, c, b) if n[0] * m[0] + n[1] * m[1] + n[2] * m[2] < 0 else (a, b, c))

    def quad(self, a, b, c, d, normal=None):
        """Adds a flat quad. Without a normal, its corners are counter-clockwise as seen from the front."""
        normal = normal or unit(cross(sub(b, a), sub(d, a)))
        first = [self.vertex(p, normal) for p in (a, b, c, d)]
        self.triangle(first[0], first[1], first[2])
        self.triangle(first[0], first[2], first[3])

    def grid(self, point, normal, nu, nv):
        """Adds the surface point(u, v) with normal(u, v) for u, v in [0, 1], in nu x nv cells."""
        first = len(self.positions) // 3
        for j in range(nv + 1):
            for i in range(nu + 1):
                u, v = i / nu, j / nv
                self.vertex(point(u, v), normal(u, v))
        for j in range(nv):
            for i in range(nu):
                a = first + j * (nu + 1) + i
                c = a + nu + 1
                self.triangle(a, a + 1, c + 1)
                self.triangle(a, c + 1, c)

    def box(self, lo, hi, skip=""):
        """Adds an axis-parallel box. `skip` names faces to leave out: any of x X y Y z Z (lower case: the low side)."""
        (x, y, z), (p, q, r) = lo, hi
        faces = {
            "x": ((x, y, z), (x, y, r), (x, q, r), (x, q, z)),
            "X": ((p, y, r), (p, y, z), (p, q, z), (p, q, r)),
            "y": ((x, y, z), (p, y, z), (p, y, r), (x, y, r)),
            "Y": ((x, q, r), (p, q, r), (p, q, z), (x, q, z)),
            "z": ((p, y, z), (x, y, z), (x, q, z), (p, q, z)),
            "Z": ((x, y, r), (p, y, r), (p, q, r), (x, q, r)),
        }
        for name, corners in faces.items():
            if name not in skip:
                self.quad(*corners)

    def sphere(self, centre, radius, nu, nv):
        def normal(u, v):
            a, b = 2 * math.pi * u, math.pi * (v - 0.5)
            return (math.cos(b) * math.sin(a), math.sin(b), math.cos(b) * math.cos(a))

        def point(u, v):
            n = normal(u, v)
            return tuple(centre[k] + radius * n[k] for k in range(3))

        self.grid(point, normal, nu, nv)

    def lathe(self, centre, profile, segments, start=0.0, turn=2 * math.pi):
        """Adds a surface of revolution: a profile of (radius, height) pairs, bottom to top, turned about the y axis.

        The axis goes through `centre`. Edges are smooth, but sharp where the profile bends by more than about 40
        degrees."""
        parts, part = [], [profile[0]]
        for k in range(1, len(profile)):
            part.append(profile[k])
            if k + 1 < len(profile):
                d, e = _direction(profile[k - 1], profile[k]), _direction(profile[k], profile[k + 1])
                if d[0] * e[0] + d[1] * e[1] < 0.77:
                    parts.append(part)
                    part = [profile[k]]
        parts.append(part)
        for part in parts:
            self._lathe_part(centre, part, segments, start, turn)

    def _lathe_part(self, centre, part, segments, start, turn):
        n = len(part) - 1
        across = []
        for k in range(n + 1):
            d = _direction(part[max(k - 1, 0)], part[k]) if k else (0.0, 0.0)
            e = _direction(part[k], part[min(k + 1, n)]) if k < n else (0.0, 0.0)
            t = (d[0] + e[0], d[1] + e[1])
            length = math.hypot(*t) or 1.0
            across.append((t[1] / length, -t[0] / length))

        def angle(u):
            return start + turn * u

        def point(u, v):
            r, h = part[round(v * n)]
            return (centre[0] + r * math.sin(angle(u)), centre[1] + h, centre[2] + r * math.cos(angle(u)))

        def normal(u, v):
            out, up = across[round(v * n)]
            return (out * math.sin(angle(u)), up, out * math.cos(angle(u)))

        self.grid(point, normal, segments, n)


def _direction(a, b):
    x, y = b[0] - a[0], b[1] - a[1]
    length = math.hypot(x, y) or 1.0
    return (x / length, y / length)


def material(name, color, metallic=0.0, roughness=0.9, emissive=None, strength=1.0, transmission=0.0, ior=None):
    made = {"name": name, "doubleSided": True,
            "pbrMetallicRoughness": {"baseColorFactor": [*color, 1], "metallicFactor": metallic,
                                     "roughnessFactor": roughness}}
    extensions = {}
    if emissive:
        made["emissiveFactor"] = list(emissive)
        extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
    if transmission:
        extensions["KHR_materials_transmission"] = {"transmissionFactor": transmission}
    if ior:
        extensions["KHR_materials_ior"] = {"ior": ior}
    if extensions:
        made["extensions"] = extensions
    return made


def looking(eye, target):
    """Returns the quaternion (x, y, z, w) that turns -z to the target and keeps +y up."""
    back = unit(sub(eye, target))
    right = unit(cross((0, 1, 0), back))
    up = cross(back, right)
    m = (right, up, back)  # columns
    trace = m[0][0] + m[1][1] + m[2][2]
    if trace > 0:
        s = 2 * math.sqrt(trace + 1)
        q = ((m[1][2] - m[2][1]) / s, (m[2][0] - m[0][2]) / s, (m[0][1] - m[1][0]) / s, s / 4)
    else:
        i = max(range(3), key=lambda k: m[k][k])
        j, k = (i + 1) % 3, (i + 2) % 3
        s = 2 * math.sqrt(max(1 + m[i][i] - m[j][j] - m[k][k], 1e-12))
        q = [0.0] * 4
        q[i] = s / 4
        q[j] = (m[j][i] + m[i][j]) / s
        q[k] = (m[k][i] + m[i][k]) / s
        q[3] = (m[j][k] - m[k][j]) / s
    return [round(c, 9) for c in q]


class Scene:
    """Collects one mesh per material and the views view0, view1, ... in the order in which they are added."""

    def __init__(self):
        self.materials, self.meshes, self.views, self.suns = [], [], [], []

    def add_material(self, name, color, **options):
        """Adds a material. Returns the mesh for its triangles."""
        self.materials.append(material(name, color, **options))
        self.meshes.append(Mesh())
        return self.meshes[-1]

    def add_view(self, eye, target, yfov_degrees=60):
        self.views.append((eye, target, math.radians(yfov_degrees)))

    def add_sun(self, direction, color, irradiance):
        """Adds parallel light that travels along the direction."""
        self.suns.append((direction, color, irradiance))

    def triangle_count(self):
        return sum(len(mesh.indices) for mesh in self.meshes) // 3

    def document(self):
        """Returns the glTF object, without the uri of the buffer, and the bytes of the buffer."""
        data, views, accessors, primitives = bytearray(), [], [], []

        def accessor(values, kind, component, target, bounds=None):
            raw = array.array(values.typecode, values)
            if sys.byteorder != "little":
                raw.byteswap()
            while len(data) % 4:
                data.append(0)
            views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(raw) * raw.itemsize,
                          "target": target})
            data.extend(raw.tobytes())
            made = {"bufferView": len(views) - 1, "componentType": component,
                    "count": len(values) // (3 if kind == "VEC3" else 1), "type": kind}
            made.update(bounds or {})
            accessors.append(made)
            return len(accessors) - 1

        for number, mesh in enumerate(self.meshes):
            if not mesh.indices:
                continue
            lo = [min(mesh.positions[k::3]) for k in range(3)]
            hi = [max(mesh.positions[k::3]) for k in range(3)]
            small = len(mesh.positions) // 3 < 65535
            indices = array.array("H", mesh.indices) if small else mesh.indices
            primitives.append({
                "attributes": {"POSITION": accessor(mesh.positions, "VEC3", 5126, 34962, {"min": lo, "max": hi}),
                               "NORMAL": accessor(mesh.normals, "VEC3", 5126, 34962)},
                "indices": accessor(indices, "SCALAR", 5123 if small else 5125, 34963), "material": number})
        used = sorted({name for m in self.materials for name in m.get("extensions", {})})
        nodes = [{"name": "scene", "mesh": 0}]
        for number, (eye, target, _) in enumerate(self.views):
            nodes.append({"name": f"view{number}", "camera": number, "translation": list(eye),
                          "rotation": looking(eye, target)})
        for number, (direction, _, _) in enumerate(self.suns):
            nodes.append({"name": f"sun{number}", "rotation": looking((0, 0, 0), direction),
                          "extensions": {"KHR_lights_punctual": {"light": number}}})
        document = {
            "asset": {"version": "2.0", "generator": "Ballot, " + os.path.basename(sys.argv[0])},
            "extensionsUsed": used, "scene": 0, "scenes": [{"nodes": list(range(len(nodes)))}], "nodes": nodes,
            "cameras": [{"type": "perspective", "name": f"view{n}",
                         "perspective": {"yfov": round(yfov, 9), "znear": 0.01, "aspectRatio": 1}}
                        for n, (_, _, yfov) in enumerate(self.views)],
            "meshes": [{"name": "scene", "primitives": primitives}], "materials": self.materials,
            "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(data)}]}
        if self.suns:
            document["extensionsUsed"] = sorted([*used, "KHR_lights_punctual"])
            document["extensions"] = {"KHR_lights_punctual": {"lights": [
                {"type": "directional", "color": list(color), "intensity": irradiance}
                for _, color, irradiance in self.suns]}}
        return document, bytes(data)

    def write(self, path):
        """Writes .gltf (text, one file) or .glb, by the extension. Writes the whole file or none."""
        document, data = self.document()
        if path.endswith(".gltf"):
            document["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
            write_atomically(path, (json.dumps(document, separators=(",", ":")) + "\n").encode())
            return
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        data += b"\0" * (-len(data) % 4)
        write_atomically(path, struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data)) +
                         struct.pack("<I4s", len(text), b"JSON") + text +
                         struct.pack("<I4s", len(data), b"BIN\0") + data)


def write_atomically(path, content):
    folder = os.path.dirname(os.path.abspath(path))
    os.makedirs(folder, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=folder)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def run(make, description, default):
    """Runs the command line of a scene's program: writes the Scene that make() returns."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("out", nargs="?", default=default,
                        help=f".glb or .gltf to write (default: {os.path.relpath(default)})")
    out = parser.parse_args().out
    if not out.endswith((".glb", ".gltf")):
        parser.error(f"'{out}': expected a name that ends in .glb or .gltf")
    scene = make()
    scene.write(out)
    print(f"{out}: {scene.triangle_count()} triangles, {len(scene.materials)} materials, {len(scene.views)} views")
