#!/usr/bin/env python3
"""Compares `ballot render --shading path` with Mitsuba 3 on one scene: the error of each after the same time.

Both render the same triangles, camera, lights and materials: each material becomes Lambertian, a perfect mirror or
smooth glass, which both have, and paths end at the same depth. Errors are taken against the renderer's own picture of
many samples with another seed, and the two of these against each other.

  pip install mitsuba            # 3.9; its variant llvm_ad_rgb needs LLVM 17 or newer: DRJIT_LIBLLVM_PATH
  tools/examples/compare_mitsuba.py scenes/cornell.gltf --view view0 --size 256 --out out/cornell-mitsuba
"""

import argparse
import base64
import json
import math
import struct
import subprocess
import sys
import time
from pathlib import Path

import mitsuba as mi
import numpy as np

DEPTH = 16  # the last bounce
TYPES = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Gltf:
    """A glTF file without compression whose nodes have no parents with transforms of their own but the meshes' own."""

    def __init__(self, path):
        raw = Path(path).read_bytes()
        if raw[:4] == b"glTF":
            length = struct.unpack_from("<I", raw, 12)[0]
            self.json, self.data = json.loads(raw[20:20 + length]), raw[28 + length:]
        else:
            self.json = json.loads(raw)
            self.data = base64.b64decode(self.json["buffers"][0]["uri"].split(",", 1)[1])

    def array(self, number):
        accessor = self.json["accessors"][number]
        view = self.json["bufferViews"][accessor["bufferView"]]
        if "byteStride" in view or "sparse" in accessor:
            sys.exit("interleaved and sparse accessors are not read here")
        count = accessor["count"] * WIDTHS[accessor["type"]]
        first = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        values = np.frombuffer(self.data, TYPES[accessor["componentType"]], count, first)
        return values.reshape(accessor["count"], -1)

    def matrix(self, node):
        if "matrix" in node:
            return np.array(node["matrix"], float).reshape(4, 4).T
        x, y, z, w = node.get("rotation", (0, 0, 0, 1))
        turn = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                         [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                         [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
        made = np.eye(4)
        made[:3, :3] = turn * np.array(node.get("scale", (1, 1, 1)))
        made[:3, 3] = node.get("translation", (0, 0, 0))
        return made


def simple(material):
    """Returns (kind, colour, emission) of a material, and changes it to that: "diffuse", "mirror" or "glass"."""
    factors = material.setdefault("pbrMetallicRoughness", {})
    extensions = material.get("extensions", {})
    strength = extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
    emission = [strength * e for e in material.get("emissiveFactor", (0, 0, 0))]
    color = factors.get("baseColorFactor", (1, 1, 1, 1))[:3]
    smooth = factors.get("roughnessFactor", 1.0) < 0.05
    material["pbrMetallicRoughness"] = {"baseColorFactor": [*color, 1], "metallicFactor": 0.0, "roughnessFactor": 1.0}
    kept = {"KHR_materials_emissive_strength": extensions["KHR_materials_emissive_strength"]} if strength != 1 else {}
    kind = "diffuse"
    if smooth and factors.get("metallicFactor", 1.0) > 0.5:
        kind = "mirror"
        material["pbrMetallicRoughness"].update(metallicFactor=1.0, roughnessFactor=0.0)
    elif smooth and "KHR_materials_transmission" in extensions:
        kind = "glass"
        kept |= {k: extensions[k] for k in ("KHR_materials_transmission", "KHR_materials_ior") if k in extensions}
        material["pbrMetallicRoughness"].update(roughnessFactor=0.0, baseColorFactor=[1, 1, 1, 1])
    material.pop("extensions", None)
    if kept:
        material["extensions"] = kept
    return kind, color, emission, kept.get("KHR_materials_ior", {}).get("ior", 1.5)


def bsdf(kind, color, ior):
    if kind == "glass":
        return {"type": "dielectric", "int_ior": ior, "ext_ior": 1.0}
    if kind == "mirror":
        return {"type": "twosided", "bsdf": {"type": "conductor", "material": "none", "specular_reflectance":
                                             {"type": "rgb", "value": list(color)}}}
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(color)}}}


def shapes(gltf, looks):
    """Yields a Mitsuba mesh for each primitive that a node holds."""
    for node in gltf.json["nodes"]:
        if "mesh" not in node:
            continue
        place = gltf.matrix(node)
        for primitive in gltf.json["meshes"][node["mesh"]]["primitives"]:
            kind, color, emission, ior = looks[primitive["material"]]
            points = gltf.array(primitive["attributes"]["POSITION"]).astype(float) @ place[:3, :3].T + place[:3, 3]
            faces = gltf.array(primitive["indices"]).reshape(-1, 3)
            options = {"bsdf": bsdf(kind, color, ior), "face_normals": "NORMAL" not in primitive["attributes"]}
            if any(emission):
                options["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": emission}}
            properties = mi.Properties()
            for name, value in options.items():
                properties[name] = mi.load_dict(value) if isinstance(value, dict) else value
            mesh = mi.Mesh("part", len(points), len(faces), props=properties,
                           has_vertex_normals="NORMAL" in primitive["attributes"])
            parameters = mi.traverse(mesh)
            parameters["vertex_positions"] = np.ravel(points).astype(np.float32)
            if "NORMAL" in primitive["attributes"]:
                normals = gltf.array(primitive["attributes"]["NORMAL"]).astype(float) @ place[:3, :3].T
                parameters["vertex_normals"] = np.ravel(normals).astype(np.float32)
            parameters["faces"] = np.ravel(faces).astype(np.uint32)
            parameters.update()
            yield mesh


def view_of(gltf, name, size):
    for node in gltf.json["nodes"]:
        if "camera" in node and name in (node.get("name"), gltf.json["cameras"][node["camera"]].get("name")):
            place = gltf.matrix(node)
            camera = gltf.json["cameras"][node["camera"]]["perspective"]
            turned = place @ np.diag([-1.0, 1.0, -1.0, 1.0])  # Mitsuba looks along +z with +x to the left
            return {"type": "perspective", "fov_axis": "y", "fov": math.degrees(camera["yfov"]),
                    "near_clip": 1e-3, "to_world": mi.ScalarTransform4f(turned),
                    "film": {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"},
                             "component_format": "float32"}}
    sys.exit(f"there is no camera {name}")


def lights(gltf, sky, lamps):
    made = {}
    for number, node in enumerate(gltf.json["nodes"]):
        if "KHR_lights_punctual" not in node.get("extensions", {}):
            continue
        number_of = node["extensions"]["KHR_lights_punctual"]["light"]
        light = gltf.json["extensions"]["KHR_lights_punctual"]["lights"][number_of]
        if light["type"] != "directional":
            sys.exit("lights other than directional ones are not read here")
        value = [light.get("intensity", 1.0) * c for c in light.get("color", (1, 1, 1))]
        direction = -gltf.matrix(node)[:3, 2]
        made[f"sun{number}"] = {"type": "directional", "direction": list(direction),
                                "irradiance": {"type": "rgb", "value": value}}
    for number, (position, intensity) in enumerate(lamps):
        made[f"lamp{number}"] = {"type": "point", "position": position,
                                 "intensity": {"type": "rgb", "value": intensity}}
    if sky:
        made["sky"] = {"type": "constant", "radiance": {"type": "rgb", "value": sky}}
    return made


class Mitsuba:
    name = "Mitsuba"

    def __init__(self, gltf, looks, options):
        parts = {f"part{i}": mesh for i, mesh in enumerate(shapes(gltf, looks))}
        integrator = {"type": "path", "max_depth": DEPTH + 1, "rr_depth": 4}
        self.scene = mi.load_dict({"type": "scene", "integrator": integrator,
                                   "sensor": view_of(gltf, options.view, options.size), **parts,
                                   **lights(gltf, options.sky, options.lamps)})

    def picture(self, samples, seed):
        start = time.perf_counter()
        image = np.array(mi.render(self.scene, spp=samples, seed=seed))
        return image[..., :3], time.perf_counter() - start


class Ballot:
    name = "Ballot"

    def __init__(self, gltf_file, options):
        self.out = options.out / "ballot"
        self.command = [options.ballot, "render", str(gltf_file), "--view", options.view, "--shading", "path", "--size",
                        f"{options.size}x{options.size}", "--bounces", str(DEPTH), "--clamp", "0", "--out",
                        f"{self.out}.exr", "--json", f"{self.out}.json", "--aov", "color"]
        self.command += ["--sky", ",".join(map(str, options.sky)) if options.sky else "none"]
        for position, intensity in options.lamps:
            self.command += ["--lamp", f"{','.join(map(str, position))}:{','.join(map(str, intensity))}"]

    def picture(self, samples, seed):
        subprocess.run([*self.command, "--spp", str(samples), "--seed", str(seed)], check=True, capture_output=True)
        record = json.loads(Path(f"{self.out}.json").read_text(encoding="utf-8"))["records"][0]
        image = np.array(mi.Bitmap(f"{self.out}.exr").convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
        return image, record["seconds"]


def errors(image, reference):
    """Returns RMSE, and relative MSE: the squared difference over the reference's squared luminance plus 0.01."""
    square = (image - reference) ** 2
    weight = reference.mean(axis=2, keepdims=True) ** 2 + 0.01
    return float(np.sqrt(square.mean())), float((square / weight).mean())


def reference_of(renderer, options):
    """Returns the mean of eight pictures of other seeds; keeps it in a file for the next call."""
    file = options.out / f"{renderer.name}-{options.size}-{options.reference}.npy"
    if not file.exists():
        parts = (renderer.picture(options.reference // 8, 1000 + part)[0].astype(float) for part in range(8))
        np.save(file, sum(parts) / 8)
    return np.load(file)


def measure(renderer, options):
    """Returns the reference, and (samples, seconds, RMSE, relative MSE) of each number of samples."""
    reference = reference_of(renderer, options)
    rows, samples = [], 1
    renderer.picture(1, 5)  # compiles
    while samples <= options.most:
        renderer.picture(samples, 6)  # and what depends on the number
        image, seconds = renderer.picture(samples, 7)
        rows.append((samples, seconds, *errors(image, reference)))
        samples *= 4
    return reference, rows


def at_time(rows, seconds, column):
    """Returns the error after a time, by a straight line in logarithms."""
    logs = np.log([[row[1], row[column]] for row in rows])
    return float(np.exp(np.interp(math.log(seconds), logs[:, 0], logs[:, 1])))


def numbers(text):
    return [float(part) for part in text.split(",")]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("--view", default="view0")
    parser.add_argument("--size", type=int, default=256, help="pixels of each side [%(default)s]")
    parser.add_argument("--sky", type=numbers, help="R,G,B: an even sky [none]")
    parser.add_argument("--lamp", action="append", default=[], help="X,Y,Z:R,G,B: a point light; may be repeated")
    parser.add_argument("--most", type=int, default=256, help="most samples of a pixel that are timed [%(default)s]")
    parser.add_argument("--reference", type=int, default=4096, help="samples of the references [%(default)s]")
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("--ballot", default="build/release/ballot")
    parser.add_argument("--out", type=Path, default=Path("out/mitsuba"))
    options = parser.parse_args()
    options.lamps = [tuple(map(numbers, lamp.split(":"))) for lamp in options.lamp]
    options.out.mkdir(parents=True, exist_ok=True)
    mi.set_variant(options.variant)
    gltf = Gltf(options.scene)
    looks = [simple(material) for material in gltf.json["materials"]]
    simpler = options.out / "simpler.gltf"
    gltf.json["buffers"] = [{"byteLength": len(gltf.data), "uri": "data:application/octet-stream;base64," +
                             base64.b64encode(gltf.data).decode()}]
    gltf.json["extensionsUsed"] = sorted({name for m in gltf.json["materials"] for name in m.get("extensions", {})} |
                                         set(gltf.json.get("extensions", {})))
    simpler.write_text(json.dumps(gltf.json), encoding="utf-8")
    results = {r.name: measure(r, options) for r in (Ballot(simpler, options), Mitsuba(gltf, looks, options))}
    a, b = (results[name][0] for name in ("Ballot", "Mitsuba"))
    print(f"references: means {a.mean():.4f} and {b.mean():.4f}, RMSE between them {errors(a, b)[0]:.4f}")
    print("| renderer | samples | s | RMSE | relative MSE |\n| --- | ---: | ---: | ---: | ---: |")
    for name, (_, rows) in results.items():
        for samples, seconds, rmse, relative in rows:
            print(f"| {name} | {samples} | {seconds:.3f} | {rmse:.4f} | {relative:.4f} |")
    print("| s | RMSE Ballot | Mitsuba | relative MSE Ballot | Mitsuba |\n| ---: | ---: | ---: | ---: | ---: |")
    most = min(rows[-1][1] for _, rows in results.values())
    for seconds in (0.5, 1, 2, 4, 8):
        if seconds <= most:
            cells = [at_time(results[name][1], seconds, column) for column in (2, 3) for name in ("Ballot", "Mitsuba")]
            print(f"| {seconds} | " + " | ".join(f"{cell:.4f}" for cell in cells) + " |")


if __name__ == "__main__":
    main()
