"""The scenes that Ballot ships or makes, and the manifest, which also lists those that it is only measured on."""

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

from dev_build import ROOT
from dev_packages import Failed

SOURCES = ROOT / "scenes"
GENERATED = ROOT / "build" / "scenes"
MANIFEST = SOURCES / "manifest.json"


def generated(name: str) -> Path:
    """Makes a scene with scenes/make_NAME.py, unless its file is at least as new as all of scenes/*.py. Returns the
    file. Throws Failed."""
    file, program = GENERATED / f"{name}.glb", SOURCES / f"make_{name}.py"
    newest = max(source.stat().st_mtime for source in SOURCES.glob("*.py"))
    if file.exists() and file.stat().st_mtime >= newest:
        return file
    file.parent.mkdir(parents=True, exist_ok=True)
    temporary = file.with_name(f".{os.getpid()}-{file.name}")
    print(f"generating {file.relative_to(ROOT)} ...", flush=True)
    result = subprocess.run([sys.executable, "-B", str(program), str(temporary)], capture_output=True, text=True,
                            check=False)
    if result.returncode != 0 or not temporary.is_file():
        temporary.unlink(missing_ok=True)
        raise Failed(f"{program.name} failed:\n{(result.stdout + result.stderr).strip()}")
    temporary.replace(file)
    return file


def scene_file(name: str) -> Path:
    """Returns the file of one of our own scenes, and generates it if it is not in the checkout. Throws Failed."""
    file = SOURCES / f"{name}.gltf"
    if file.is_file():
        return file
    if not (SOURCES / f"make_{name}.py").is_file():
        raise Failed(f"there is neither {file} nor a program that makes it: the checkout is incomplete")
    return generated(name)


def shipped_scenes() -> list[Path]:
    """Returns the scene files that `tools/dev.py bundle` puts into its folder."""
    return [scene_file("cornell"), scene_file("atrium")]


def read_manifest() -> list[dict]:
    """Returns the manifest's entries. The file holds an object with "scenes" or a plain list; entries without a name
    are left out."""
    if not MANIFEST.exists():
        return []
    try:
        document = json.loads(MANIFEST.read_text(encoding="utf-8"))
    except ValueError as error:
        raise Failed(f"{MANIFEST}: {error}") from None
    entries = document.get("scenes", []) if isinstance(document, dict) else document
    if isinstance(entries, dict):
        entries = [{"name": name, **entry} for name, entry in entries.items()]
    return [entry for entry in entries if isinstance(entry, dict) and entry.get("name")]


def sha256_of(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def file_of(entry: dict, folder: Path | None) -> Path | None:
    """Returns the scene's file in the checkout, among the generated ones or in the user's folder; None if absent."""
    file_name = entry.get("file") or entry["name"]
    names = [file_name] if Path(file_name).suffix else [file_name + suffix for suffix in (".gltf", ".glb", ".obj")]
    places = [ROOT, SOURCES, GENERATED] + ([folder] if folder else [])
    return next((place / name for place in places for name in names if (place / name).is_file()), None)


def state_of(entry: dict, path: Path | None) -> str:
    if path is None:
        return "absent"
    expected = entry.get("sha256")
    if not expected:
        return "present, no checksum"
    return "verified" if sha256_of(path) == expected else "DIFFERS"


def print_scenes(folder: Path | None) -> int:
    """Prints the manifest with the state of every file. Returns 1 if a file differs from its checksum, else 0."""
    if folder and not folder.is_dir():
        raise Failed(f"there is no folder {folder}")
    entries = read_manifest()
    for entry in entries:
        if str(entry.get("file")).startswith("build/"):
            generated(entry["name"])
    rows, absent, differs = [("scene", "triangles", "state", "file", "licence")], [], []
    for entry in entries:
        path = file_of(entry, folder)
        state = state_of(entry, path)
        if state == "absent":
            absent.append(entry)
        if state == "DIFFERS":
            differs.append(path)
        rows.append((entry["name"], str(entry.get("triangles") or "-"), state, str(path or ""),
                     str(entry.get("licence", ""))))
    widths = [max(len(row[i]) for row in rows) for i in range(4)]
    for row in rows:
        print("  ".join([f"{cell:{width}}" for cell, width in zip(row, widths)] + [row[4]]).rstrip())
    if absent:
        print("\nThe absent scenes are not shipped because of their size or licence. Put the files into one folder and "
              "name it with\n--dir or BALLOT_SCENES. Sources:")
        for entry in absent:
            print(f"  {entry['name']}: {entry.get('page') or 'no page recorded'}; "
                  f"to convert: {entry.get('convert', '-')}")
    for path in differs:
        print(f"error: {path}: its SHA-256 differs from the manifest's, so it is another file", file=sys.stderr)
    return 1 if differs else 0
