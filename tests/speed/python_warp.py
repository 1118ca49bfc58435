#!/usr/bin/env python3
"""Compares kernels of users with the same programs in NVIDIA Warp, in turns in one process on one card.

Needs Ballot's package and `pip install warp-lang`, and a CUDA device that has Vulkan as well. The mesh is a bumpy
sphere. Each program runs once to warm up, then both take turns; times are those of whole calls, with the wait for the
device. Prints medians and what both found, which has to agree:

occlusion, a ray an index    cosine-distributed rays about points on the surface, each marks whether it is blocked
occlusion, a point an index  the same rays in a loop, the share that is open
sums                         nearest hits of rays that lie on the device, their powers added up by triangle
scans                        a scanner of 64 x 2048 at poses inside of the sphere and out: points on the host

    python3 tests/speed/python_warp.py --points 1000000
"""

import argparse
import statistics
import time

import numpy as np
import warp as wp
from python_compare import bumpy_sphere

import ballot

wp.config.quiet = True

GLSL_RAY = """
readonly buffer Points { vec3 points[]; };
readonly buffer Normals { vec3 normals[]; };
uniform float reach;
uint hash(uint x) {
  x = (x ^ x >> 16) * 0x21F0AAADu;
  x = (x ^ x >> 15) * 0x735A2D97u;
  return x ^ x >> 15;
}
Ray make_ray(uint point, uint i) {
  uint seed = hash(point * 64u + i);
  float r = sqrt(float(seed & 0xFFFFu) / 65536.0), phi = 6.2831853 * float(seed >> 16) / 65536.0;
  vec3 n = normals[point], x = normalize(abs(n.x) > 0.5 ? vec3(-n.y, n.x, 0.0) : vec3(0.0, -n.z, n.y));
  vec3 dir = x * (r * cos(phi)) + cross(n, x) * (r * sin(phi)) + n * sqrt(1.0 - r * r);
  return Ray(points[point] + 1e-4 * reach * n, 0.0, dir, reach);
}
"""
GLSL_BY_RAY = GLSL_RAY + """
buffer Found { uint found[]; };
void main(uint index) { found[index] = any(make_ray(index / 64u, index % 64u)) ? 1u : 0u; }
"""
GLSL_BY_POINT = GLSL_RAY + """
buffer Found { float found[]; };
void main(uint index) {
  uint blocked = 0u;
  for (uint i = 0u; i < 64u; ++i) blocked += uint(any(make_ray(index, i)));
  found[index] = float(blocked);
}
"""
GLSL_SCANS = """
readonly buffer Poses { vec4 poses[]; };  // three rows each
readonly buffer Beams { vec3 beams[]; };
buffer Points { vec3 points[]; };
buffer Number { uint number[]; };
uniform uint beams_each;
void main(uint index) {
  uint row = 3u * (index / beams_each);
  vec3 beam = beams[index % beams_each];
  vec3 origin = vec3(poses[row].w, poses[row + 1u].w, poses[row + 2u].w);
  vec3 dir = vec3(dot(poses[row].xyz, beam), dot(poses[row + 1u].xyz, beam), dot(poses[row + 2u].xyz, beam));
  Hit hit = nearest(Ray(origin, 0.0, dir, 100.0));
  if (hit.prim != NO_HIT) points[atomicAdd(number[0], 1u)] = origin + hit.t * dir;
}
"""


@wp.func
def hashed(x: wp.uint32):
    x = (x ^ (x >> wp.uint32(16))) * wp.uint32(0x21F0AAAD)
    x = (x ^ (x >> wp.uint32(15))) * wp.uint32(0x735A2D97)
    return x ^ (x >> wp.uint32(15))


@wp.func
def direction(n: wp.vec3, point: wp.int32, i: wp.int32):
    seed = hashed(wp.uint32(point) * wp.uint32(64) + wp.uint32(i))
    r = wp.sqrt(wp.float32(seed & wp.uint32(0xFFFF)) / 65536.0)
    phi = 6.2831853 * wp.float32(seed >> wp.uint32(16)) / 65536.0
    x = wp.vec3(0.0, -n[2], n[1])
    if wp.abs(n[0]) > 0.5:
        x = wp.vec3(-n[1], n[0], 0.0)
    x = wp.normalize(x)
    return x * (r * wp.cos(phi)) + wp.cross(n, x) * (r * wp.sin(phi)) + n * wp.sqrt(1.0 - r * r)


@wp.kernel
def warp_by_ray(
    mesh: wp.uint64, points: wp.array(dtype=wp.vec3), normals: wp.array(dtype=wp.vec3), reach: float,
    found: wp.array(dtype=wp.uint32),
):  # fmt: skip
    index = wp.tid()
    point = index // 64
    n = normals[point]
    hit = wp.mesh_query_ray_anyhit(mesh, points[point] + 1.0e-4 * reach * n, direction(n, point, index % 64), reach)
    found[index] = wp.where(hit, wp.uint32(1), wp.uint32(0))


@wp.kernel
def warp_by_point(
    mesh: wp.uint64, points: wp.array(dtype=wp.vec3), normals: wp.array(dtype=wp.vec3), reach: float,
    found: wp.array(dtype=wp.float32),
):  # fmt: skip
    point = wp.tid()
    n = normals[point]
    origin = points[point] + 1.0e-4 * reach * n
    blocked = float(0.0)
    for i in range(64):
        if wp.mesh_query_ray_anyhit(mesh, origin, direction(n, point, i), reach):
            blocked += 1.0
    found[point] = blocked


@wp.kernel
def warp_sums(
    mesh: wp.uint64, rays: wp.array2d(dtype=wp.float32), weights: wp.array(dtype=wp.float32),
    sums: wp.array(dtype=wp.float64),
):  # fmt: skip
    i = wp.tid()
    origin, along = wp.vec3(rays[i, 0], rays[i, 1], rays[i, 2]), wp.vec3(rays[i, 4], rays[i, 5], rays[i, 6])
    query = wp.mesh_query_ray(mesh, origin, along, rays[i, 7])
    if query.result:
        wp.atomic_add(sums, query.face, wp.float64(weights[i]))


@wp.kernel
def warp_scans(
    mesh: wp.uint64, poses: wp.array(dtype=wp.vec4), beams: wp.array(dtype=wp.vec3), beams_each: int,
    points: wp.array(dtype=wp.vec3), count: wp.array(dtype=wp.int32),
):  # fmt: skip
    index = wp.tid()
    row, beam = 3 * (index // beams_each), beams[index % beams_each]
    a, b, c = poses[row], poses[row + 1], poses[row + 2]
    origin = wp.vec3(a[3], b[3], c[3])
    along = wp.vec3(
        a[0] * beam[0] + a[1] * beam[1] + a[2] * beam[2],
        b[0] * beam[0] + b[1] * beam[1] + b[2] * beam[2],
        c[0] * beam[0] + c[1] * beam[1] + c[2] * beam[2],
    )
    query = wp.mesh_query_ray(mesh, origin, along, 100.0)
    if query.result:
        points[wp.atomic_add(count, 0, 1)] = origin + query.t * along


def there(record, array):
    on = ballot.Array(record, array.size // {"vec3": 3, "rays": 8}.get(record, 1))
    on.write(array.reshape(-1, 8) if record == "rays" else array)
    return on


class Both:
    """The mesh and what the programs work on, for both."""

    def __init__(self, args):
        vertices, faces = bumpy_sphere(args.triangles)
        corners = vertices[faces]
        self.scene = ballot.Scene(vertices, faces)
        self.mesh = wp.Mesh(
            wp.array(vertices, dtype=wp.vec3), wp.array(faces.reshape(-1).astype(np.int32)), bvh_constructor=args.tree
        )
        random = np.random.default_rng(1)
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        at = corners[np.sort(random.choice(len(faces), args.points, p=areas / areas.sum()))]
        u, v = np.sqrt(random.random(args.points)), random.random(args.points)
        weights = np.stack([1 - u, u * (1 - v), u * v], -1)
        self.points = np.einsum("nk,nki->ni", weights, at).astype(np.float32)
        normals = np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
        normals *= np.sign(np.einsum("ni,ni->n", normals, self.points))[:, None]
        self.normals = (normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)).astype(np.float32)

    def occlusion(self, text, kernel, each, dtype):
        count = len(self.points) * each
        record = "uint32" if dtype == np.uint32 else "float32"
        user, found = ballot.Kernel(text), ballot.Array(record, count)
        buffers = {"points": there("float32", self.points), "normals": there("float32", self.normals), "found": found}
        points, normals = wp.array(self.points, dtype=wp.vec3), wp.array(self.normals, dtype=wp.vec3)
        other = wp.zeros(count, dtype=wp.uint32 if dtype == np.uint32 else wp.float32)
        return (
            lambda: user(self.scene, count, buffers, reach=0.2),
            lambda: wp.launch(kernel, count, [self.mesh.id, points, normals, 0.2, other]),
            lambda: (float(found.read().sum(dtype=np.float64)), float(other.numpy().sum(dtype=np.float64))),
        )

    def sums(self, count):
        random = np.random.default_rng(2)
        origins = random.normal(size=(count, 3))
        origins *= 2 / np.linalg.norm(origins, axis=1, keepdims=True)
        rays = np.zeros((count, 8), np.float32)
        rays[:, :3], rays[:, 4:7] = origins, random.uniform(-0.8, 0.8, size=(count, 3)) - origins
        rays[:, 7] = 1e30
        powers = random.random(count).astype(np.float32)
        here, weights, sums = there("rays", rays), there("float32", powers), []
        wp_rays, wp_weights = wp.array(rays, dtype=wp.float32), wp.array(powers, dtype=wp.float32)
        other = wp.zeros(self.scene.info.triangles, dtype=wp.float64)

        def by_ballot():
            sums[:] = [self.scene.sums(here, weights)]

        def by_warp():
            other.zero_()
            wp.launch(warp_sums, count, [self.mesh.id, wp_rays, wp_weights, other])

        return by_ballot, by_warp, lambda: (float(sums[0].read()[:-1].sum()), float(other.numpy().sum()))

    def scans(self, poses):
        beams = ballot.lidar(
            np.deg2rad(np.linspace(-25, 15, 64)), np.linspace(0, 2 * np.pi, 2048, endpoint=False)
        ).directions.reshape(-1, 3)
        places = np.random.default_rng(3).normal(size=(poses, 3))
        places *= (np.linspace(0.2, 3, poses) / np.linalg.norm(places, axis=1))[:, None]
        at = ballot.frames([[0, 0, 1]], places).astype(np.float32)
        count, user = poses * len(beams), ballot.Kernel(GLSL_SCANS)
        points, number = ballot.Array("float32", 3 * count), ballot.Array("uint32", 1)
        buffers = {"poses": there("float32", at), "beams": there("float32", beams), "points": points, "number": number}
        wp_at, wp_beams = wp.array(at.reshape(-1, 4), dtype=wp.vec4), wp.array(beams, dtype=wp.vec3)
        wp_points, wp_number = wp.zeros(count, dtype=wp.vec3), wp.zeros(1, dtype=wp.int32)
        found = {}

        def by_ballot():
            number.write(np.zeros(1, np.uint32))
            user(self.scene, count, buffers, beams_each=len(beams))
            found["ballot"] = points.read(count=3 * int(number.read()[0])).reshape(-1, 3)

        def by_warp():
            wp_number.zero_()
            wp.launch(warp_scans, count, [self.mesh.id, wp_at, wp_beams, len(beams), wp_points, wp_number])
            found["warp"] = wp_points[: int(wp_number.numpy()[0])].numpy()

        return by_ballot, by_warp, lambda: (len(found["ballot"]), len(found["warp"]))


def timed(run):
    start = time.perf_counter()
    run()
    wp.synchronize()
    return (time.perf_counter() - start) * 1e3


def row(what, programs, repeats):
    by_ballot, by_warp, found = programs
    ms = {by_ballot: [], by_warp: []}
    for i in range(repeats + 2):
        for run in ms:
            spent = timed(run)
            if i >= 2:
                ms[run].append(spent)
    here, other = (statistics.median(ms[run]) for run in (by_ballot, by_warp))
    spread = " ".join(f"{min(m):.2f}..{max(m):.2f}" for m in ms.values())
    a, b = found()
    print(f"| {what} | {here:.2f} | {other:.2f} | {other / here:.2f} | {spread} | {a:.10g}, {b:.10g} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--triangles", type=int, default=200_000)
    parser.add_argument("--points", type=int, default=1_000_000, help="of occlusion, 64 rays each")
    parser.add_argument("--rays", type=int, default=16_000_000, help="of sums")
    parser.add_argument("--poses", type=int, default=100, help="of the scanner")
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--tree", default="sah", help="of Warp: sah, median or lbvh")
    args = parser.parse_args()
    wp.init()
    info = ballot.default_device().info
    print(f"{info.name}, {info.driver}; Warp {wp.__version__}, {args.tree}; medians of {args.repeats}, ms")
    print("| program | Ballot | Warp | ratio | fastest and slowest | found |\n| --- | ---: | ---: | ---: | --- | --- |")
    both = Both(args)
    row("occlusion, a ray an index", both.occlusion(GLSL_BY_RAY, warp_by_ray, 64, np.uint32), args.repeats)
    row("occlusion, a point an index", both.occlusion(GLSL_BY_POINT, warp_by_point, 1, np.float32), args.repeats)
    row("sums", both.sums(args.rays), args.repeats)
    row("scans", both.scans(args.poses), args.repeats)


if __name__ == "__main__":
    main()
