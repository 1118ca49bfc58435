"""The plots: speeds of methods, error against speed, builders, origins, errors of pictures, slices of fields."""

import math
from pathlib import Path

import numpy
from accuracy import errors_of, verified
from figures import COLOURS, HATCHES, MARKERS, NUMBER, logarithmic, panels, plain, pyplot, save, style
from results import MODES, Entry, Failed, Platform, geometric_mean, groups, unique
from studies import build_s

BASE = "packet(any)"
MOST_BARS = 16  # in a group; if there are more, votes by sum are left out (the tables have them)
ZERO_BELOW = 0.8  # decades from the lowest rate on an axis down to the line of zero


def by_place(entries: list[Entry]) -> dict[tuple, dict[str, Entry]]:
    """Returns the entries of each scene and kind of rays by label."""
    return {place: {e.label: e for e in own} for place, own in groups(entries, lambda e: (e.scene, e.rays)).items()}


def bar_styles(entries: list[Entry]) -> dict[str, dict]:
    """Returns a colour for each method, and a hatch for each label of it."""
    methods = groups(entries, lambda e: e.first["method"])
    return {label: {"color": COLOURS[m % len(COLOURS)], "hatch": HATCHES[i % len(HATCHES)], "edgecolor": "white",
                    "linewidth": 0.3}
            for m, own in enumerate(methods.values()) for i, label in enumerate(sorted({e.label for e in own}))}


def plot_speed_up(entries: list[Entry], title: str, name: str, out: Path) -> list[str]:
    places, styles = by_place(entries), bar_styles(entries)
    labels = [label for label in styles if label != BASE]
    if len(labels) > MOST_BARS:
        by_sum = {e.label for e in entries if e.first["knobs"].get("vote") == "sum"}
        labels = [label for label in labels if label not in by_sum]
    kinds, scenes = unique(rays for _, rays in places), unique(scene for scene, _ in places)
    if not labels or not any(BASE in own for own in places.values()):
        return []
    figure, axes = panels(len(kinds), 1, 0.9 + len(scenes) * (0.4 + 0.11 * len(labels)), 2.3)
    handles = {}
    for axis, rays in zip(axes[:, 0], kinds):
        for i, label in enumerate(labels):
            for x, scene in enumerate(scenes):
                own = places.get((scene, rays), {})
                value = own[label].speed_up(own[BASE]) if label in own and BASE in own else None
                if value:
                    at = x + (i - (len(labels) - 1) / 2) * 0.86 / len(labels)
                    bar = axis.bar(at, 100 * (value - 1), 0.86 / len(labels), **styles[label])
                    handles.setdefault(label, bar)
        axis.axhline(0, color="black", linewidth=0.8)
        axis.set_xticks(range(len(scenes)), [plain(scene) for scene in scenes])
        axis.set_ylabel("speed-up in %")
        axis.set_title(plain(rays), fontsize=10, loc="left")
        axis.grid(axis="y", linewidth=0.3)
        axis.set_axisbelow(True)
    return [save(figure, name, f"Trace speed-up against {BASE}\n{title}", out,
                 (list(handles.values()), list(handles)))]


def plot_thresholds(swept: list[Entry], title: str, name: str, out: Path) -> list[str]:
    def family(e: Entry) -> str:
        return e.first["method"] + "".join(f", {k}={v}" for k, v in sorted(e.first["knobs"].items())
                                           if k != e.first["threshold"]["knob"])

    written = []
    for knob, own in groups([e for e in swept if "threshold" in e.first],
                            lambda e: e.first["threshold"]["knob"]).items():
        kinds, scenes = unique(e.rays for e in own), unique(e.scene for e in own)
        figure, axes = panels(len(kinds), len(scenes), 3.0, 2.2)
        lines = {}
        for (row, rays), (column, scene) in ((r, c) for r in enumerate(kinds) for c in enumerate(scenes)):
            axis = axes[row][column]
            for i, (label, some) in enumerate(groups(own, family).items()):
                points = sorted((e.first["threshold"]["value"], e.mrays) for e in some
                                if (e.scene, e.rays) == (scene, rays))
                if points:
                    lines[label], = axis.plot(*zip(*points), **style(i))
            axis.set_ylim(bottom=0)
            axis.set_title(plain(f"{scene}, {rays}"), fontsize=9)
            axis.set_xlabel(f"threshold {plain(knob)}")
            axis.set_ylabel("Mrays/s")
            axis.grid(linewidth=0.3)
        written.append(save(figure, f"{name}-{knob}", f"Trace speed by threshold\n{title}", out,
                            (list(lines.values()), list(lines))))
    return written


def coherence(entry: Entry | None) -> float | None:
    """Returns the share of the packet's node visits that a ray needs; None if it was not counted."""
    counted = [r for r in entry.views.values() if r.get("counters", {}).get("nodes")] if entry else []
    needed, visited = (sum(r["counters"].get(name, 0) * r["ray_count"] for r in counted)
                       for name in ("nodes_needed", "nodes"))
    return needed / visited if needed else None


def plot_coherence(entries: list[Entry], title: str, name: str, out: Path) -> list[str]:
    """Draws the fastest variant of each method, over the places that it has."""
    places = by_place(entries)
    share = {place: 100 * value for place, own in places.items() if (value := coherence(own.get(BASE)))}
    if not share:
        return []
    def rank(own: list[Entry]) -> tuple:
        return len(own), geometric_mean([e.mrays for e in own])

    fastest = [max(groups(own, lambda e: e.label).values(), key=rank)
               for own in groups(entries, lambda e: e.first["method"]).values()]
    scenes = unique(scene for scene, _ in share)
    columns = min(2, len(scenes))
    figure, axes = panels(math.ceil(len(scenes) / columns), columns, 5.0, 3.4)
    for axis in axes.flat[len(scenes):]:
        axis.set_visible(False)
    lines = {}
    for axis, scene in zip(axes.flat, scenes):
        for i, own in enumerate(fastest):
            points = sorted((share[e.scene, e.rays], e.mrays) for e in own
                            if e.scene == scene and (e.scene, e.rays) in share)
            if points:
                lines[own[0].label], = axis.plot(*zip(*points), **style(i))
        axis.set_yscale("log")
        axis.yaxis.set_major_formatter(NUMBER)
        axis.yaxis.set_minor_formatter(NUMBER)
        top = axis.get_ylim()[1] * 1.6
        axis.set_ylim(top=top)
        for (_, rays), x in ((place, x) for place, x in share.items() if place[0] == scene):
            axis.annotate(plain(rays), (x, top), rotation=90, fontsize=6, va="top", ha="right", color="#555555")
            axis.axvline(x, color="#DDDDDD", linewidth=0.6, zorder=0)
        axis.set_title(plain(scene), fontsize=10)
        axis.set_xlabel("share of the packet's node visits that a ray needs, %")
        axis.set_ylabel("Mrays/s")
        axis.grid(axis="y", linewidth=0.3)
    return [save(figure, name, f"Trace speed by coherence, the fastest variant of each method\n{title}", out,
                 (list(lines.values()), list(lines)))]


class Point:
    """An entry in one numeric mode: its speed and its rate of wrong answers."""

    def __init__(self, entry: Entry):
        errors = errors_of(entry)
        self.label, self.mode, self.mrays = entry.label, entry.numeric, entry.mrays
        self.rate, self.least = errors.per_million(errors.wrong), errors.per_million(1)


def height(rate: float, low: int) -> float:
    return math.log10(rate) if rate > 0 else low - ZERO_BELOW


def draw_front(axis, points: list[Point], low: int) -> None:
    """Draws the Pareto front, the points that no other beats in both speed and error, as steps from each point to the
    next, open towards slower and towards worse."""
    best: list[Point] = []
    for point in sorted(points, key=lambda p: (-p.mrays, p.rate)):
        if not best or point.rate < best[-1].rate:
            best.append(point)
    left, right = axis.get_xlim()
    xs, ys = [best[0].mrays], [axis.get_ylim()[1]]
    for point in best:
        xs += [point.mrays, point.mrays]
        ys += [ys[-1], height(point.rate, low)]
    axis.plot([*xs, left], [*ys, ys[-1]], color="#888888", linewidth=1, zorder=1)
    axis.set_xlim(left, right)


def draw_errors(axis, points: list[Point], span: tuple[int, int], colour: dict, marker: dict) -> None:
    low, high = span
    zero = low - ZERO_BELOW
    axis.axhline(zero, color="black", linewidth=0.8, zorder=0)
    axis.axhspan(zero - 0.5, low - ZERO_BELOW / 2, color="#F2F2F2", zorder=-1)
    least = math.log10(min(p.least for p in points))
    axis.axhline(least, color="#BBBBBB", linewidth=0.8, linestyle=":", zorder=0)
    for p in points:
        axis.scatter(p.mrays, height(p.rate, low), s=38, color=colour[p.mode], marker=marker[p.label],
                     edgecolors="white", linewidths=0.5, zorder=3, clip_on=False)
    axis.set_ylim(zero - 0.5, high + 0.3)
    powers = range(low, high + 1, max(1, math.ceil((high - low) / 6)))
    axis.set_yticks([zero, *powers], ["0", *(f"{10.0 ** p:g}" for p in powers)])
    axis.margins(x=0.12)
    axis.grid(axis="x", linewidth=0.3)
    axis.set_axisbelow(True)
    draw_front(axis, points, low)
    axis.annotate("one wrong answer", (0, least), xycoords=("axes fraction", "data"), ha="left", va="bottom",
                  fontsize=6, color="#777777", xytext=(2, 1), textcoords="offset points")


def decades(points: list[Point]) -> tuple[int, int]:
    """Returns the range of powers of ten that contains all rates above zero and the rate of one wrong answer."""
    rates = [p.rate for p in points if p.rate > 0] + [min(p.least for p in points)]
    low, high = math.floor(math.log10(min(rates))), math.ceil(math.log10(max(rates)))
    return low, max(high, low + 1)


def plot_accuracy(entries: list[Entry], title: str, name: str, out: Path) -> list[str]:
    places = {place: [Point(e) for e in own]
              for place, own in groups(entries, lambda e: (e.scene, e.rays)).items()}
    if not places:
        return []
    scenes, kinds = unique(scene for scene, _ in places), unique(rays for _, rays in places)
    modes, labels = unique([m for m in MODES if any(e.numeric == m for e in entries)]
                           + [e.numeric for e in entries]), unique(e.label for e in entries)
    colour = {m: COLOURS[i % len(COLOURS)] for i, m in enumerate(unique([*MODES, *modes]))}
    marker = {label: MARKERS[i % len(MARKERS)] for i, label in enumerate(labels)}
    figure, axes = panels(len(scenes), len(kinds), 3.1, 2.5)
    for row, scene in enumerate(scenes):
        span = decades([p for (s, _), points in places.items() if s == scene for p in points])
        for axis, rays in zip(axes[row], kinds):
            if (scene, rays) not in places:
                axis.set_visible(False)
                continue
            draw_errors(axis, places[scene, rays], span, colour, marker)
            axis.set_title(plain(f"{scene}, {rays}"), fontsize=9)
            axis.set_ylabel("wrong per million rays")
            axis.set_xlabel("Mrays/s")
    handles = [pyplot.Rectangle((0, 0), 1, 1, color=colour[mode]) for mode in modes]
    handles += [pyplot.Line2D([], [], marker=marker[label], linestyle="", color="#555555") for label in labels]
    return [save(figure, name, f"Wrong answers against trace speed; the lines are the Pareto fronts\n{title}", out,
                 (handles, modes + labels))]


def plot_platform(platform: Platform, number: int, out: Path) -> list[str]:
    title = "{}, {} x {}".format(platform.name, *platform.document["size"])
    written = plot_accuracy(verified(platform), title, f"accuracy-{number}", out)
    for mode in platform.modes:
        own, place = [e for e in platform.entries if e.numeric == mode], f"{number}-{mode}"
        entries, swept = [e for e in own if e.role != "sweep"], [e for e in own if e.role == "sweep"]
        written += plot_speed_up(entries, f"{title}, {mode}", f"speedup-{place}", out)
        written += plot_thresholds(swept, f"{title}, {mode}", f"threshold-{place}", out)
        written += plot_coherence(entries, f"{title}, {mode}", f"coherence-{place}", out)
    return written


def plot_builders(document: dict, name: str, out: Path) -> list[str]:
    """Draws time, memory and speed against triangles, and for each scene the time of building and tracing."""
    records = document["records"]
    kinds = unique(kind for r in records for kind in r["mrays_per_s"])

    def lines(value) -> dict[str, list]:
        return {builder: [(r["triangles"], value(r)) for r in own]
                for builder, own in groups(records, lambda r: r["builder"]).items()}

    figure, (axes,) = panels(1, 2 + len(kinds), 4.0, 3.7)
    logarithmic(axes[0], lines(lambda r: 1e3 * build_s(r)), "build, milliseconds", "triangles")
    logarithmic(axes[1], lines(lambda r: r["peak_mib"]), "peak memory of the build, MiB", "triangles")
    for axis, kind in zip(axes[2:], kinds):
        logarithmic(axis, lines(lambda r, kind=kind: r["mrays_per_s"][kind]), f"{kind} rays, Mrays/s", "triangles")
    written = [save(figure, name, f"Builders of trees\n{document['device']}, {document['driver']}", out)]
    counts = [10 ** (k / 4) for k in range(16, 41)]
    for scene, own in groups(records, lambda r: r["scene"]).items():
        figure, (axes,) = panels(1, len(kinds), 4.0, 3.7)
        for axis, kind in zip(axes, kinds):
            logarithmic(axis, {r["builder"]: [(n, build_s(r) + n * 1e-6 / r["mrays_per_s"][kind]) for n in counts]
                               for r in own if r["mrays_per_s"][kind] > 0}, f"{kind} rays: build and trace, seconds",
                        "rays")
        title = f"{scene}, {own[0]['triangles']} triangles\n{document['device']}"
        written.append(save(figure, f"{name}-{scene.replace('/', '_')}", title, out))
    return written


def plot_origins(document: dict, name: str, out: Path) -> list[str]:
    figure, (axes,) = panels(1, 2, 5.25, 3.8)
    for axis, at, count, title, label in (
            (axes[0], "distance", "self_hits", "Self hits, all sizes together", "distance from the origin / size"),
            (axes[1], "scene_size", "lost_contacts", "Lost contacts, all distances together", "size of the scene")):
        for i, (policy, own) in enumerate(groups(document["records"], lambda r: r["policy"]).items()):
            points = sorted((x, 1e6 * sum(r[count] for r in some) / max(1, sum(r["rays"] for r in some)))
                            for x, some in groups(own, lambda r, at=at: r[at]).items())
            axis.plot(*zip(*points), label=policy, clip_on=False, **style(i))
        axis.set_xscale("symlog", linthresh=min((r[at] for r in document["records"] if r[at] > 0), default=1))
        axis.set_yscale("symlog", linthresh=0.3, linscale=0.3)  # 0 can be drawn on it
        axis.set_ylim(0, 1e6)
        axis.set_title(title, fontsize=10)
        axis.set_xlabel(label)
        axis.grid(True, color="#dddddd", linewidth=0.6)
    axes[0].set_ylabel("per million rays")
    return [save(figure, name, "Origins of secondary rays: the ray hits its own triangle, or misses a near surface",
                 out, axes[0].get_legend_handles_labels())]


def plot_errors(document: dict, name: str, out: Path) -> list[str]:
    """Draws the error of a picture over the time of rendering (`ballot render --reference`)."""
    figure, (axes,) = panels(1, 3, 3.6, 3.2)
    for axis, (key, title) in zip(axes, (("rmse", "RMSE"), ("relmse", "relative MSE"),
                                         ("flip", "FLIP, 67 pixels per degree"))):
        logarithmic(axis, {title: [(r["seconds"], r[key]) for r in document["records"] if r["seconds"] > 0]}, title,
                    "seconds of rendering")
    return [save(figure, name, f"Error of {document['picture']} over time", out)]


def plot_field(file: Path, out: Path) -> list[str]:
    """Draws the middle slice of a distance field (`ballot distance --grid N --signed`), .npy or .raw."""
    try:
        field = numpy.load(file, mmap_mode="r") if file.suffix == ".npy" else numpy.memmap(file, "<f4", "r")
    except (OSError, ValueError) as error:
        raise Failed(f"{file}: {error}") from None
    side = round(field.size ** (1 / 3))
    if field.ndim == 1 and side**3 == field.size:
        field = field.reshape(side, side, side)
    if field.ndim != 3:
        raise Failed(f"{file}: its shape is {field.shape}; expected a volume of --grid")
    middle = numpy.asarray(field[len(field) // 2])
    size = float(numpy.abs(middle[numpy.isfinite(middle)]).max(initial=0))
    figure, ((axes,),) = panels(1, 1, 5, 5)
    axes.imshow(middle, origin="lower", cmap="RdBu", vmin=-size, vmax=size, interpolation="nearest")
    axes.contour(middle, levels=[0], colors="black", linewidths=1)
    axes.contour(middle, levels=12, colors="black", linewidths=0.3, linestyles="solid")
    axes.set_axis_off()
    return [save(figure, file.stem, f"Slice z = {len(field) // 2} of {file.name}", out)]


STUDIES = {"builders": plot_builders, "origins": plot_origins, "errors": plot_errors}
