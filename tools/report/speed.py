"""The tables of speeds: Mrays/s, frames per second, regret, votes, thresholds, counters."""

import shlex
import statistics

from results import Entry, Platform, geometric_mean, groups, unique
from text import figure, pivot, section, table

AUTO = "auto"


def runs_text(documents: list[dict]) -> str:
    text = ""
    for d in documents:
        names = [", ".join(unique(str(r[key]) for r in d["records"])) for key in ("scene", "rays", "numeric")]
        text += (f"- {d['device']}, driver {d['driver']}, subgroups of {d['subgroup_size']}, commit {d['commit']}, "
                 f"{d['date']}. Clock: {d['clock']}.\n  {d['size'][0]} x {d['size'][1]} pixels, {d['repeats']} repeats "
                 f"interleaved, {d['sweep_repeats']} in sweeps. Rays of kind ao: {d['ao_rays']} a hit, of length "
                 f"{d['ao_radius']:g} times the scene's diagonal. Offset policy: {d['offset']}.\n")
        if d["records"]:
            text += f"  Scenes: {names[0]}. Rays: {names[1]}. Numeric modes: {names[2]}.\n"
        if d["partial"]:
            text += "  **The run was interrupted: the missing records were not measured.**\n"
        environment = "".join(f"{name}={shlex.quote(value)} " for name, value in sorted(d["environment"].items()))
        text += f"\n  ```\n  {environment}{d['command']}\n  ```\n"
    return section("## What was measured", text + "\n")


def best_ms(entries: list[Entry]) -> dict[tuple, float]:
    """Returns the least time of each scene and kind of rays. `auto` is left out, as it runs one of the others, and so
    are entries that lack views."""
    return {key: min(e.ms for e in block) for key, block in groups(
        [e for e in entries if e.whole and e.first["method"] != AUTO], lambda e: (e.scene, e.rays)).items()}


def speeds(entries: list[Entry]) -> str:
    """Two tables for each kind of rays: Mrays/s with the time over the best method's and what auto ran, and frames per
    second."""
    text, best = "", best_ms(entries)

    def speed(e: Entry) -> str:
        least, notes = best.get((e.scene, e.rays)), unique(r.get("runs", AUTO) for r in e.views.values())
        if e.first["method"] != AUTO:
            notes = []
        if not e.whole:
            notes.insert(0, "lacks views")
        elif least:
            notes.insert(0, f"**{e.ms / least:.2f}**" if e.ms == least else f"{e.ms / least:.2f}")
        return f"{figure(e.mrays)} ({', '.join(notes)})" if notes else figure(e.mrays)

    for rays, some in groups(entries, lambda e: e.rays).items():
        text += pivot([f"Mrays/s (over the best), {rays}"], some, lambda e: (e.label,), lambda e: e.scene, speed)
        text += pivot([f"frames/s, {rays}"], [e for e in some if e.fps], lambda e: (e.label,), lambda e: e.scene,
                      lambda e: figure(e.fps))
    return text


def regret(entries: list[Entry]) -> str:
    """A row for each method: its time over the best one's, over all scenes and kinds of rays."""
    best, rows = best_ms(entries), []
    for label, own in groups([e for e in entries if e.whole and (e.scene, e.rays) in best], lambda e: e.label).items():
        values = [e.ms / best[e.scene, e.rays] for e in own]
        most = max(values)
        worst = own[values.index(most)]
        rows.append([label, f"{most:.2f}", f"{worst.scene}, {worst.rays}", f"{geometric_mean(values):.3f}",
                     f"{statistics.median(values):.3f}", len(own)])
    rows.sort(key=lambda row: (-row[-1], float(row[1])))
    return table(["time over the best method's", "at most", "where", "geometric mean", "median",
                  "scenes x ray kinds"], rows) if len(rows) > 1 else ""


def without_vote(e: Entry) -> str:
    """Returns the label without the vote: what entries share that differ in their vote alone."""
    name, _, inner = e.label.removesuffix(")").partition("(")
    parts = [part for part in inner.split(",") if part and part != e.first["knobs"]["vote"]]
    return f"{name}({','.join(parts)})" if parts else name


def votes(entries: list[Entry]) -> str:
    ratios: dict[tuple, list[float]] = {}
    voting = [e for e in entries if "vote" in e.first["knobs"]]
    for same in groups(voting, lambda e: (e.scene, e.rays, without_vote(e))).values():
        for a in same:
            for b in same:
                ratio = a.speed_up(b) if a is not b else None
                if ratio:
                    pair = f"{a.first['knobs']['vote']} / {b.first['knobs']['vote']}"
                    ratios.setdefault((without_vote(a), a.rays, pair), []).append(ratio)
    shown = [(key, r) for key, r in ratios.items() if key[2] in ("count / any", "sum / any", "count / sum")]
    return pivot(["speed by vote: mean (range over scenes)", "rays"], shown, lambda i: i[0][:2], lambda i: i[0][2],
                 lambda i: f"{geometric_mean(i[1]):.3f} ({min(i[1]):.2f} to {max(i[1]):.2f})")


def thresholds(entries: list[Entry]) -> str:
    def family(e: Entry) -> str:
        knob = e.first["threshold"]["knob"]
        rest = "".join(f", {name}={value}" for name, value in e.first["knobs"].items() if name != knob)
        return f"Mrays/s by {knob}: {e.first['method']}{rest}"

    swept = sorted((e for e in entries if "threshold" in e.first), key=lambda e: e.first["threshold"]["value"])
    return "".join(pivot([name, "rays"], own, lambda e: (f"{e.first['threshold']['value']:g}", e.rays),
                         lambda e: e.scene, lambda e: figure(e.mrays)) for name, own in groups(swept, family).items())


def counters(entries: list[Entry]) -> str:
    """Means a ray over all views. The shares are sums over sums: of active lanes in all, of packets' visits in all."""
    counted = [e for e in entries if all("counters" in r for r in e.views.values())]
    names = unique(name for e in counted for r in e.views.values() for name in sorted(r["counters"]))
    rows = []
    for e in counted:
        means = {}
        for name in names:
            values = [(r["counters"].get(name, 0), r["ray_count"]) for r in e.views.values()]
            means[name] = (max(v for v, _ in values) if name.endswith("_max")
                           else sum(v * n for v, n in values) / e.rays_traced)
        if means.get("steps"):
            useful = means.get("nodes_needed", 0) + means.get("leaves_needed", 0)
            means["active_share"] = useful / (means["steps"] * e.first["subgroup"])
        if means.get("nodes"):
            means["packet_share"] = means.get("packet_nodes", 0) / means["nodes"]
        rows.append([e.scene, e.rays, e.label, *(figure(means[name]) for name in names)])
    return table(["counters, means a ray", "rays", "method", *names], rows, 3)


def checks(entries: list[Entry]) -> str:
    checked = [r["check"] for e in entries for r in e.views.values() if "check" in r]
    errors = sum(c[name] for c in checked
                 for name in ("false_misses", "false_hits", "wrong_prims", "wrong_t", "unwritten"))
    return f"{sum(c['rays'] for c in checked)} hits held to the CPU oracle, {errors} errors.\n\n" if checked else ""


def speed_section(platform: Platform, numeric: str) -> str:
    own = [e for e in platform.entries if e.numeric == numeric]
    entries, swept = [e for e in own if e.role != "sweep"], [e for e in own if e.role == "sweep"]
    body = speeds(entries) + regret(entries) + votes(entries) + thresholds(swept) + counters(entries) + checks(entries)
    return section(f"## Speed: {platform.name}, {numeric}", body)
