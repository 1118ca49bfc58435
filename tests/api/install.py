#!/usr/bin/env python3
"""Installs the library to an empty prefix and uses it from there: by CMake in C and C++, and by pkg-config. The samples
of the guide are built in the latter way.

BALLOT_PRELOAD names what programs have to load before a library with address sanitizer: the sanitizer's runtime.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent


def run(command: list, **options) -> str:
    result = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                            text=True, check=False, timeout=120, **options)
    if result.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}\nexit code {result.returncode}\n{result.stdout}")
    return result.stdout


def expect(what: str, found, expected) -> None:
    if found != expected:
        sys.exit(f"{what}: found {found}, expected {expected}")


def check_subdirectory(folder: Path) -> None:
    """Configures a project that adds Ballot's source tree: what it compiles gets the path of the headers alone."""
    project, build = folder / "outer", folder / "outer" / "build"
    project.mkdir(parents=True)
    (project / "CMakeLists.txt").write_text(f"""cmake_minimum_required(VERSION 3.16)
project(outer C CXX)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
add_subdirectory({HERE.parent.parent} ballot)
add_executable(outer {HERE}/consumer/consumer.c)
target_link_libraries(outer PRIVATE Ballot::ballot)
""", encoding="utf-8")
    run(["cmake", "-G", "Ninja", "-S", project, "-B", build])
    commands = json.loads((build / "compile_commands.json").read_text(encoding="utf-8"))
    words = next(entry["command"].split() for entry in commands if entry["file"].endswith("consumer.c"))
    options = [word for word in words[1:] if word.startswith("-") and word not in ("-o", "-c")]
    expect("options of a project that adds Ballot", options, [f"-I{build}/ballot/include"])
    expect("files of CPack", [path.name for path in build.glob("CPack*")], [])
    targets = run(["ninja", "-C", build, "-t", "targets", "all"])
    ours = re.findall(r"^ballot/\S*tests\S*: phony|^ballot/ballot: ", targets, re.M)
    expect("programs and tests of Ballot in it", ours, [])


def check_foreign(program: Path, environment: dict[str, str]) -> None:
    """Runs the program with Vulkan of its own under validation: it compares hits itself, this looks at its picture."""
    picture = program.parent / "foreign.ppm"
    checks = {"VK_INSTANCE_LAYERS": "VK_LAYER_KHRONOS_validation",
              "VK_LAYER_ENABLES": "VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT"}
    said = run([program, picture], env={**environment, **checks})
    if len(said.splitlines()) != 1:
        sys.exit(f"{program.name}: expected one line, of what was drawn; found\n{said}")
    print(said, end="")
    header, pixels = picture.read_bytes().split(b"\n", 1)
    expect("header of the picture", header, b"P6 640 360 255")
    colors = [pixels[i : i + 3] for i in range(0, len(pixels), 3)]
    for what, grey in (("lit", 204), ("shadowed", 110)):
        share = sum(color == bytes([grey] * 3) for color in colors) / len(colors)
        if not 0.02 < share < 0.7:
            sys.exit(f"{picture}: {share:.3f} of the pixels are {what} ground, {grey} of 255; expected 0.02 to 0.7")


def main() -> None:
    build, folder = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    shutil.rmtree(folder, ignore_errors=True)
    prefix, programs = folder / "prefix", folder / "build"
    run(["cmake", "--install", build, "--prefix", prefix, "--component", "runtime"])
    runtime = sorted(path.name for path in prefix.rglob("*") if not path.is_dir())
    expect("files of the component runtime", runtime, ["LICENSE", "NOTICE", "libballot.so.1", "libballot.so.1.0.0"])
    run(["cmake", "--install", build, "--prefix", prefix, "--component", "development"])
    headers = sorted(path.name for path in (prefix / "include" / "ballot").iterdir())
    expect("headers", headers,
           ["ballot.h", "ballot_c.h", "ballot_c_answers.h", "ballot_c_kernels.h", "ballot_c_points.h",
            "ballot_c_scenes.h", "ballot_c_vulkan.h", "ballot_device.h", "ballot_kernel.h", "ballot_scene_facts.h",
            "ballot_types.h", "ballot_views.h", "ballot_vulkan.h"])

    library = next(prefix.rglob("libballot.so"))
    symbols = run(["nm", "-D", "--defined-only", library]).split("\n")
    names = [line.split()[-1].split("@")[0] for line in symbols if line]
    others = [name for name in names if not re.fullmatch(r"ballot_\w+|BALLOT_1", name)]
    expect("visible symbols other than ballot_*", others, [])
    api = HERE / "../../engine/api"
    headers = ("ballot_c.h", "ballot_c_answers.h", "ballot_c_points.h", "ballot_c_kernels.h", "ballot_c_scenes.h",
               "ballot_c_vulkan.h")
    texts = [(api / name).read_text(encoding="utf-8") for name in headers]
    declared = set(re.findall(r"\b(ballot_\w+)\(", "".join(texts)))
    declared -= {"ballot_init", "ballot_rays", "ballot_rays_of_six", "ballot_points", "ballot_boxes"}  # in the headers
    expect("functions of ballot_c.h that the library lacks", sorted(declared - set(names)), [])

    check_subdirectory(folder)
    environment = {**os.environ, "LD_LIBRARY_PATH": str(library.parent), "XDG_CACHE_HOME": str(folder / "cache")}
    environment.pop("BALLOT_SHADERS", None)
    if preload := os.environ.get("BALLOT_PRELOAD"):
        environment["LD_PRELOAD"] = preload
    run(["cmake", "-S", HERE / "consumer", "-B", programs, f"-DCMAKE_PREFIX_PATH={prefix}"])
    run(["cmake", "--build", programs])
    for name in ("consumer_c", "consumer_cpp", "consumer_audio", "consumer_lidar"):
        print(run([programs / name], env=environment), end="")
    check_foreign(programs / "consumer_foreign", environment)

    package = next(prefix.rglob("ballot.pc")).parent
    found = {**environment, "PKG_CONFIG_PATH": str(package)}
    flags = run(["pkg-config", "--cflags", "--libs", "ballot"], env=found).split()
    run(["cc", HERE / "consumer" / "consumer.c", *flags, "-o", folder / "by_pkg_config"])
    print(run([folder / "by_pkg_config"], env=environment), end="")
    guide = [sys.executable, HERE / "guide.py", api / "README.md"]
    warnings = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    run([*guide, "c", "cc", "-std=c99", *warnings, *flags, "-lm"], env=environment)
    run([*guide, "cpp", "c++", "-std=c++20", *warnings, *flags], env=environment)
    version = run(["pkg-config", "--modversion", "ballot"], env=found).strip()
    if version not in run([folder / "by_pkg_config"], env=environment):
        sys.exit(f"ballot.pc says {version}, the library another version")


if __name__ == "__main__":
    main()
