"""The tables and plots of `tools/dev.py scaling`."""

import os
import subprocess
import sys
from pathlib import Path

from dev_packages import Failed
from dev_scaling_inputs import KINDS

METHODS = ("auto", "while-while")
BATCH = 10 ** 6  # rays of each kind that are traced through every scene
NO_MATPLOTLIB = 4  # exit code of plot_scaling.py


def spaced(number: int) -> str:
    return f"{number:,}".replace(",", " ")


def number_text(value: float | None) -> str:
    if value is None:
        return "failed"
    return spaced(round(value)) if value >= 100 else f"{value:.3g}"


def table(heads: list[str], rows: list[list[str]]) -> str:
    lines = [heads, ["---:"] * len(heads), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def triangle_table(document: dict) -> str:
    heads = ["triangles", "load s", "build s", "build's share", "MiB on device", "MiB per million triangles",
             "peak MiB, load and build", "peak MiB, tracing",
             *(f"{kind} Mrays/s, {method}" for kind in KINDS for method in METHODS)]
    rows = []
    for row in document["triangles"]:
        share, on_device = row.get("build_share"), row.get("device_mib")
        rows.append([spaced(row["triangles"]), number_text(row.get("load_s")), number_text(row.get("build_s")),
                     "failed" if share is None else f"{100 * share:.0f} %", number_text(on_device),
                     number_text(on_device and on_device / row["triangles"] * 1e6),
                     number_text(row.get("build_peak_mib")), number_text(row.get("trace_peak_mib")),
                     *(number_text(row["mrays_per_s"].get(kind, {}).get(method))
                       for kind in KINDS for method in METHODS)])
    return table(heads, rows)


def ray_table(document: dict) -> str:
    rows = []
    for row in document["rays"]:
        chosen = f" ({row['variant'].split('.')[0]})" if row["method"] == "auto" and "variant" in row else ""
        hits = f"{100 * row['hits'] / row['rays']:.0f} %" if "hits" in row else "failed"
        rows.append([spaced(row["rays"]), row["kind"], row["method"] + chosen, *(
            number_text(row.get(name)) for name in ("trace_ms", "mrays_per_s", "wall_s", "peak_mib")), hits])
    return table(["rays", "kind", "method", "trace ms", "Mrays/s", "wall s", "peak MiB", "hits"], rows)


def markdown(document: dict) -> str:
    knobs = "".join(f", --knob {knob}" for knob in document["knobs"])
    loads = [row["load_average"] for row in document["triangles"] + document["rays"]] or [0]
    text = (f"{document.get('device', '?')}, {document.get('driver', '?')}, subgroups of "
            f"{document.get('subgroup_size', '?')}, {document['processors']} processors, load average "
            f"{min(loads):.1f} to {max(loads):.1f}{knobs}; {document['date']}, commit {document.get('commit', '?')}.\n")
    if document["triangles"]:
        text += f"\n{spaced(BATCH)} rays of each kind, by triangles:\n\n" + triangle_table(document)
    if document["rays"]:
        text += f"\nThrough {spaced(document['ray_scene_triangles'])} triangles, by rays:\n\n" + ray_table(document)
    text += "\nFailed steps:\n\n" if document["failures"] else "\nNo step failed.\n"
    return text + "".join(f"- {f['place']}, {f['step']}: `{f['error']}`\n" for f in document["failures"])


def draw(results: Path) -> None:
    """Draws the plots by the interpreter in BALLOT_PYTHON, else by this one or the system's own, which sees Debian's
    packages."""
    wanted = os.environ.get("BALLOT_PYTHON")
    script = Path(__file__).resolve().with_name("plot_scaling.py")
    for python in [wanted] if wanted else [sys.executable, "/usr/bin/python3"]:
        try:
            done = subprocess.run([python, "-B", str(script), str(results), "--out", str(results.parent)],
                                  capture_output=True, text=True, check=False)
        except FileNotFoundError:
            continue
        if done.returncode == 0:
            print(done.stdout, end="")
            return
        if done.returncode != NO_MATPLOTLIB:
            raise Failed(f"{script.name} failed: {(done.stderr.strip() or 'it printed no message').splitlines()[-1]}")
    print("no plots: no Python with matplotlib was found; install python3-matplotlib (Debian), then: "
          f"python3 {script} {results} --out {results.parent}")
