"""The gallery: five pictures of the generated scenes, which `tools/dev.py render` makes in about half a minute."""

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path

import dev_scenes
from dev_build import ROOT

OUT = ROOT / "out" / "gallery"
EVENING = "gradient:0.14,0.25,0.55:1,0.6,0.38:1,0.6,0.38"
MORNING = "gradient:0.18,0.36,0.85:1,0.9,0.8:0.4,0.4,0.3"


@dataclass
class Picture:
    name: str
    shows: str  # in a few words
    scene: str  # a name that dev_scenes.scene_file() knows
    options: dict[str, str]  # of `ballot render`


WIDE = "800x450"
COURT = {"--view": "view1", "--size": WIDE}
PICTURES = (
    Picture("court", "ambient occlusion of the atrium", "atrium", COURT | {"--shading": "ao", "--spp": "16"}),
    Picture("work", "the same view: nodes that each ray visits, most in yellow", "atrium",
            COURT | {"--shading": "heat", "--method": "while-while", "--spp": "4"}),
    Picture("bay", "evening sun, sky and water, by path tracing", "bay",
            {"--view": "view1", "--size": WIDE, "--shading": "path", "--spp": "24", "--sky": EVENING}),
    Picture("meadow", "973236 triangles of seven meshes, and pinwheels that turn, by path tracing", "meadow",
            {"--views-file": str(ROOT / "scenes" / "meadow-views.json"), "--view": "grass", "--size": WIDE,
             "--shading": "path", "--spp": "12", "--sky": MORNING, "--time": "0.2"}),
    Picture("cornell", "a mirror, glass and the light that it gathers, by path tracing", "cornell",
            {"--view": "view0", "--size": "400x400", "--shading": "path", "--spp": "36", "--clamp": "3",
             "--exposure": "0.6"}),
)


def make(binary: Path, rest: list[str], given) -> tuple[int, list[Path]]:
    """Renders the pictures to out/gallery/. `rest` are further options of `ballot render`; given(name) tells whether
    they hold one. Returns the exit code of the first that failed, or 0, and the JSON files of those that did not."""
    OUT.mkdir(parents=True, exist_ok=True)
    reports = []
    for picture in PICTURES:
        report = OUT / f"{picture.name}.json"
        options = picture.options | {"--out": str(OUT / f"{picture.name}.exr"), "--json": str(report)}
        command = [str(binary), "render", str(dev_scenes.scene_file(picture.scene)), "--png", *rest]
        for name, value in options.items():
            if not given(name):
                command += [name, value]
        result = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False)
        if result.returncode != 0:  # ballot has printed the reason to standard error
            print(result.stdout, end="")
            return max(result.returncode, 1), reports
        seconds = json.loads(report.read_text(encoding="utf-8"))["records"][0]["seconds"]
        print(f"{seconds:6.1f} s  {(OUT / picture.name).relative_to(ROOT)}.png: {picture.shows}", flush=True)
        reports.append(report)
    return 0, reports
