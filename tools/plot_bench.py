#!/usr/bin/env python3
"""Draws results of `ballot bench`: speed-up against packet, speed against threshold, speed against coherence."""

import json
import math
import sys
from pathlib import Path

from plot_common import COLOURS, HATCHES, MARKERS, Failed, panels, plain, pyplot, rays_of, run, save, ticker, unique

BASE = "packet(any)"
FORMAT = ticker.FuncFormatter(lambda value, _: f"{value:g}")
MOST_BARS = 16  # in a group; if there are more, votes by sum are left out (the tables have them)


class Setting:
    """The records that may be compared: those of one device and driver, clock, picture size and numeric mode."""

    def __init__(self, document: dict, numeric: str):
        self.title = (f"{document['device']}, {numeric}, {document['size'][0]} x {document['size'][1]}, "
                      f"subgroups of {document['subgroup_size']}")
        self.records: dict[tuple, dict] = {}  # the last record of each place, as in the tables

    def add(self, record: dict) -> None:
        swept = record["role"] == "sweep"
        self.records[record["scene"], rays_of(record), record["label"], record["view"], swept] = record

    def groups(self, swept: bool = False) -> dict[tuple, list[dict]]:
        """Returns a dictionary from (scene, rays, label) to the records of its views."""
        groups: dict[tuple, list[dict]] = {}
        for (scene, rays, label, _, is_sweep), record in self.records.items():
            if is_sweep == swept:
                groups.setdefault((scene, rays, label), []).append(record)
        return groups


def read_settings(files: list[Path]) -> list[Setting]:
    settings: dict[tuple, Setting] = {}
    for file in files:
        try:
            content = json.loads(file.read_text(encoding="utf-8"))
            for document in content.get("documents", [content]):
                for record in document["records"]:
                    key = (document["device"], document["driver"], document["subgroup_size"], document["clock"],
                           *document["size"], record["numeric"])
                    if key not in settings:
                        settings[key] = Setting(document, record["numeric"])
                    settings[key].add(record)
        except OSError as error:
            raise Failed(f"cannot read {file}: {error.strerror}") from None
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise Failed(f"{file}: expected JSON of 'ballot bench' or 'ballot report'; {error!r}") from None
    return list(settings.values())


def mrays(records: list[dict]) -> float:
    return sum(r["ray_count"] for r in records) / sum(r["trace_ms"]["median"] for r in records) * 1e-3


def speed_up(records: list[dict], base: list[dict]) -> float | None:
    """Returns the speed divided by that of `base`, over the views that both have; None if there are none."""
    base_ms = {r["view"]: r["trace_ms"]["median"] for r in base}
    pairs = [(base_ms[r["view"]], r["trace_ms"]["median"]) for r in records if r["view"] in base_ms]
    return sum(b for b, _ in pairs) / sum(t for _, t in pairs) if pairs else None


def styles(groups: dict[tuple, list[dict]]) -> dict[str, tuple[str, str]]:
    """Returns a dictionary from label to (colour, hatch): a colour per method, a hatch per variant of it."""
    method_of = {label: records[0]["method"] for (_, _, label), records in groups.items()}
    methods = unique(method_of.values())
    style = {}
    for method in methods:
        for i, label in enumerate(sorted(label for label in method_of if method_of[label] == method)):
            style[label] = (COLOURS[methods.index(method) % len(COLOURS)], HATCHES[i % len(HATCHES)])
    return style


def shown_labels(groups: dict[tuple, list[dict]], style: dict) -> list[str]:
    """Returns the labels that get bars: all, or without votes by sum if there are too many to distinguish."""
    labels = [label for label in style if label != BASE]
    if len(labels) <= MOST_BARS:
        return labels
    by_sum = {label for (_, _, label), records in groups.items() if records[0]["knobs"].get("vote") == "sum"}
    return [label for label in labels if label not in by_sum]


def plot_speed_up(setting: Setting, name: str, out: Path, written: list[str]) -> None:
    groups = setting.groups()
    kinds, scenes = unique(rays for _, rays, _ in groups), unique(scene for scene, _, _ in groups)
    style = styles(groups)
    labels = shown_labels(groups, style)
    if not labels or not any(label == BASE for _, _, label in groups):
        return
    width = 0.9 + len(scenes) * (0.4 + 0.11 * len(labels))
    figure, axes = panels(len(kinds), 1, width, 2.3)
    handles = {}
    for axis, rays in zip(axes[:, 0], kinds):
        for i, label in enumerate(labels):
            for x, scene in enumerate(scenes):
                own, base = groups.get((scene, rays, label)), groups.get((scene, rays, BASE))
                value = speed_up(own, base) if own and base else None
                if value is not None:
                    bar = axis.bar(x + (i - (len(labels) - 1) / 2) * 0.86 / len(labels), 100 * (value - 1),
                                   0.86 / len(labels), color=style[label][0], hatch=style[label][1],
                                   edgecolor="white", linewidth=0.3)
                    handles.setdefault(label, bar)
        axis.axhline(0, color="black", linewidth=0.8)
        axis.set_xticks(range(len(scenes)), [plain(scene) for scene in scenes])
        axis.set_ylabel("speed-up in %")
        axis.set_title(plain(rays), fontsize=10, loc="left")
        axis.grid(axis="y", linewidth=0.3)
        axis.set_axisbelow(True)
    shown = [label for label in labels if label in handles]
    if shown:
        some = "" if len(labels) + 1 == len(style) else "; votes by sum are in the tables"
        save(figure, name, f"Trace speed-up against {BASE}{some}\n{setting.title}", out,
             ([handles[label] for label in shown], shown), written)


def family_of(record: dict) -> str:
    knob = record["threshold"]["knob"]
    rest = "".join(f", {name}={value}" for name, value in sorted(record["knobs"].items()) if name != knob)
    return record["method"] + rest


def plot_thresholds(setting: Setting, name: str, out: Path, written: list[str]) -> None:
    sweeps = setting.groups(swept=True)
    sweeps = {key: records for key, records in sweeps.items() if "threshold" in records[0]}
    for knob in unique(records[0]["threshold"]["knob"] for records in sweeps.values()):
        own = {key: records for key, records in sweeps.items() if records[0]["threshold"]["knob"] == knob}
        families = unique(family_of(records[0]) for records in own.values())
        kinds, scenes = unique(rays for _, rays, _ in own), unique(scene for scene, _, _ in own)
        figure, axes = panels(len(kinds), len(scenes), 3.0, 2.2)
        lines = {}
        for row, rays in enumerate(kinds):
            for column, scene in enumerate(scenes):
                axis = axes[row][column]
                for i, family in enumerate(families):
                    points = sorted((records[0]["threshold"]["value"], mrays(records))
                                    for (s, r, _), records in own.items()
                                    if (s, r) == (scene, rays) and family_of(records[0]) == family)
                    if points:
                        lines[family], = axis.plot(*zip(*points), color=COLOURS[i % len(COLOURS)],
                                                   marker=MARKERS[i % len(MARKERS)], markersize=4, linewidth=1.2)
                axis.set_ylim(bottom=0)
                axis.set_title(plain(f"{scene}, {rays}"), fontsize=9)
                axis.grid(linewidth=0.3)
                if column == 0:
                    axis.set_ylabel("Mrays/s")
                if row == len(kinds) - 1:
                    axis.set_xlabel(f"threshold {plain(knob)}")
        save(figure, f"{name}-{knob}", f"Trace speed by threshold\n{setting.title}", out,
             (list(lines.values()), list(lines)), written)


def coherence(records: list[dict]) -> float | None:
    """Returns the share of the packet's node visits that a ray needs; None if it was not counted."""
    needed = visited = 0.0
    for record in records:
        counters = record.get("counters", {})
        if counters.get("nodes") and "nodes_needed" in counters:
            needed += counters["nodes_needed"] * record["ray_count"]
            visited += counters["nodes"] * record["ray_count"]
    return needed / visited if visited else None


def fastest_labels(groups: dict[tuple, list[dict]]) -> list[str]:
    """Returns for each method its fastest label, by the geometric mean over all places that have it."""
    speeds: dict[str, dict[str, list[float]]] = {}
    for (_, _, label), records in groups.items():
        speeds.setdefault(records[0]["method"], {}).setdefault(label, []).append(math.log(mrays(records)))
    return [max(labels, key=lambda label: (len(labels[label]), sum(labels[label]) / len(labels[label])))
            for labels in speeds.values()]


def plot_coherence(setting: Setting, name: str, out: Path, written: list[str]) -> None:
    groups = setting.groups()
    share = {(scene, rays): coherence(records) for (scene, rays, label), records in groups.items() if label == BASE}
    share = {place: value for place, value in share.items() if value is not None}
    if not share:
        return
    scenes, labels = unique(scene for scene, _ in share), fastest_labels(groups)
    columns = min(2, len(scenes))
    figure, axes = panels(math.ceil(len(scenes) / columns), columns, 5.0, 3.4)
    for axis in axes.flat[len(scenes):]:
        axis.set_visible(False)
    lines = {}
    for axis, scene in zip(axes.flat, scenes):
        for i, label in enumerate(labels):
            points = sorted((100 * share[s, rays], mrays(groups[s, rays, label])) for s, rays in share
                            if s == scene and (s, rays, label) in groups)
            if points:
                lines[label], = axis.plot(*zip(*points), color=COLOURS[i % len(COLOURS)],
                                          marker=MARKERS[i % len(MARKERS)], markersize=4, linewidth=1)
        axis.set_yscale("log")
        axis.yaxis.set_major_formatter(FORMAT)
        axis.yaxis.set_minor_formatter(FORMAT)
        top = axis.get_ylim()[1] * 1.6
        axis.set_ylim(top=top)
        for (s, rays), x in share.items():
            if s == scene:
                axis.annotate(plain(rays), (100 * x, top), rotation=90, fontsize=6, va="top", ha="right",
                              color="#555555")
                axis.axvline(100 * x, color="#DDDDDD", linewidth=0.6, zorder=0)
        axis.set_title(plain(scene), fontsize=10)
        axis.set_xlabel("share of the packet's node visits that a ray needs, %")
        axis.set_ylabel("Mrays/s")
        axis.grid(axis="y", linewidth=0.3)
    save(figure, name, f"Trace speed by coherence, the fastest variant of each method\n{setting.title}", out,
         (list(lines.values()), list(lines)), written)


def draw(files: list[Path], out: Path, written: list[str]) -> None:
    for i, setting in enumerate(read_settings(files), 1):
        plot_speed_up(setting, f"speedup-{i}", out, written)
        plot_thresholds(setting, f"threshold-{i}", out, written)
        plot_coherence(setting, f"coherence-{i}", out, written)


if __name__ == "__main__":
    sys.exit(run(__doc__, "RESULTS.json", draw))
