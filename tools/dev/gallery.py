"""Pictures: the gallery, which `tools/dev.py render` makes in about half a minute, or the views of a scene."""

import subprocess
from pathlib import Path

from dev import ROOT, scene_file

OUT = ROOT / "out" / "gallery"
EVENING = "gradient:0.14,0.25,0.55:1,0.6,0.38:1,0.6,0.38"
MORNING = "gradient:0.18,0.36,0.85:1,0.9,0.8:0.4,0.4,0.3"
PICTURES = {  # name: (scene, options of `ballot render`)
    "court": ("atrium", "--view view1 --size 800x450 --shading ao --spp 16"),
    # the same view: nodes that each ray visits, most in yellow
    "work": ("atrium", "--view view1 --size 800x450 --shading heat --method while-while --spp 4"),
    "bay": ("bay", f"--view view1 --size 800x450 --shading path --spp 24 --sky {EVENING}"),
    "meadow": ("meadow", f"--views-file {ROOT}/scenes/meadow-views.json --view grass --size 800x450 --shading path "
                         f"--spp 12 --sky {MORNING} --time 0.2"),
    "cornell": ("cornell", "--view view0 --size 400x400 --shading path --spp 36 --clamp 3 --exposure 0.6"),
}


def render(ballot: Path, scene: Path, own: list[str], given: list[str]) -> int:
    """Runs `ballot render` with the given options, and those of its own that are not given. Returns its exit code."""
    words = [str(ballot), "render", str(scene), *given]
    for name, value in zip(own[::2], own[1::2]):
        if not any(word.split("=")[0] == name for word in given):
            words += [name, value]
    return subprocess.run(words if "--png" in given else [*words, "--png"], check=False).returncode


def render_gallery(ballot: Path, given: list[str]) -> int:
    """Makes the pictures in out/gallery/. Returns the exit code of the first that failed, or 0."""
    OUT.mkdir(parents=True, exist_ok=True)
    for name, (scene, options) in PICTURES.items():
        own = [*options.split(), "--out", str(OUT / f"{name}.exr")]
        if code := render(ballot, scene_file(scene), own, given):
            return code
    return 0


def render_scene(ballot: Path, scene: Path, given: list[str]) -> int:
    out = ROOT / "out" / scene.stem
    out.mkdir(parents=True, exist_ok=True)
    return render(ballot, scene, ["--view", "all", "--size", "512x512", "--out", f"{out}/"], given)
