"""The tables of verified runs: what numeric modes cost, how often they err, and on which hard cases."""

import statistics

from results import CONSERVATIVE, MODES, Entry, Platform, groups
from text import figure, percent, pivot, rate, section, table

WRONG = ("false_misses", "false_hits", "wrong_prims")
COUNTS = (*WRONG, "ties", "wrong_values", "beyond_bound", "self_hits", "beyond_range", "unwritten")
LEGEND = """\
Every answer is checked against an oracle that decides exactly for float32 input. Wrong answers are false misses, false
hits and wrong prims; those "beyond bound" are not explained by the proved bound of the mode's rounding errors. A tie
names another triangle at exactly the same t. A wrong value is a t, u or v beyond the bound. "t ulp" is the error of t
in units in the last place of float32 at the exact t, the largest of all views. A self hit is a hit of the triangle that
the ray started from. Image RMSE is the error of a picture whose shade is the cosine between ray and geometric normal.

"""
HARD = "For each mode, the method with the most wrong answers. Bold marks what the mode promises not to give.\n\n"
LISTED = 4  # wrong answers of an entry with their reasons


class Errors:
    """The sums over verified records."""

    def __init__(self, records: list[dict]):
        self.rays = sum(r["verified_rays"] for r in records)
        self.counts = {name: sum(r.get(name, 0) for r in records) for name in COUNTS}
        self.ulp = {name: max((r["t_ulp"][name] for r in records if r["t_ulp"][name] is not None), default=0)
                    for name in ("median", "p99", "max")}
        self.wrong = sum(self.counts[name] for name in WRONG)

    def per_million(self, count: int) -> float:
        return 1e6 * count / self.rays if self.rays else 0

    def rate(self, count: int) -> str:
        return rate(self.per_million(count))


def is_verified(document: dict) -> bool:
    return bool(document.get("hard")) or any("verified_rays" in r for r in document["records"])


def verified(platform: Platform) -> list[Entry]:
    return [e for e in platform.entries if all("verified_rays" in r for r in e.views.values())]


def errors_of(entry: Entry) -> Errors:
    return Errors(list(entry.views.values()))


def costs(entries: list[Entry], numeric: str, base: str) -> list[tuple[float, Entry]]:
    """Returns the time in a mode over that in another, of each entry that has both."""
    others = {(e.scene, e.rays, e.label): e for e in entries if e.numeric == base}
    pairs = [(others[key].speed_up(e), e) for e in entries if e.numeric == numeric
             for key in [(e.scene, e.rays, e.label)] if key in others]
    return [pair for pair in pairs if pair[0]]


def mode_table(platforms: list[Platform]) -> str:
    rows = []
    for platform in platforms:
        entries = verified(platform)
        modes = [m for m in platform.modes if any(e.numeric == m for e in entries)]
        for mode in modes:
            total = Errors([r for e in entries if e.numeric == mode for r in e.views.values()])
            ratios = costs(entries, mode, modes[0])
            cost = ["base" if mode == modes[0] else "", ""]
            if ratios and mode != modes[0]:
                most, worst = max(ratios, key=lambda pair: pair[0])
                cost = [percent(statistics.median(ratio for ratio, _ in ratios)),
                        f"{percent(most)} ({worst.scene}, {worst.rays}, {worst.label})"]
            counts = [total.counts[name] for name in ("beyond_bound", "ties", "self_hits")]
            rates = map(total.rate, (total.wrong, *counts))
            rows.append([mode, platform.name, *cost, total.rays, *rates, rate(total.ulp["p99"]),
                         rate(total.ulp["max"]), total.counts["unwritten"]])
    return table(["mode", "device", "time, median", "time, worst", "answers", "wrong per million",
                  "of these beyond bound", "ties per million", "self hits per million", "t ulp: p99", "max",
                  "unwritten"], rows, 2)


def rate_table(platforms: list[Platform]) -> str:
    """The rate of the method that errs most, and in brackets that of answers beyond the bound."""
    cells = []
    for platform in platforms:
        for key, own in groups(verified(platform), lambda e: (e.scene, e.rays, e.numeric)).items():
            worst = max(map(errors_of, own), key=lambda e: e.per_million(e.wrong))
            beyond = worst.counts["beyond_bound"]
            cells.append((key[:2], f"{platform.name}: {key[2]}" if len(platforms) > 1 else key[2],
                          worst.rate(worst.wrong) + (f" ({worst.rate(beyond)})" if beyond else "")))
    return pivot(["wrong per million: the worst method's", "rays"], cells, lambda c: c[0], lambda c: c[1],
                 lambda c: c[2])


def entry_table(platform: Platform) -> str:
    rows = []
    for e in sorted(verified(platform), key=lambda e: (e.scene, e.rays, e.label, MODES.index(e.numeric)
                                                       if e.numeric in MODES else len(MODES))):
        errors = errors_of(e)
        squares = [r["image_rmse"] ** 2 * r["verified_rays"] for r in e.views.values() if "image_rmse" in r]
        rows.append([e.scene, e.rays, e.label, e.numeric, figure(e.mrays), errors.rays, *errors.counts.values(),
                     *map(rate, errors.ulp.values()), rate((sum(squares) / errors.rays) ** 0.5) if squares else ""])
    return table(["scene", "rays", "method", "mode", "Mrays/s", "answers", *(n.replace("_", " ") for n in COUNTS),
                  "t ulp: median", "p99", "max", "image RMSE"], rows, 4)


def hard_table(document: dict) -> str:
    """Returns cases by modes."""
    def badness(records: list[dict]) -> tuple[bool, int, str]:
        sums = {name: sum(r.get(name, 0) for r in records) for name in (*COUNTS, "leaks", "unlike_known", "differing")}
        wrong = sum(sums[name] for name in (*WRONG, "wrong_values"))
        mode = records[0]["numeric"]
        broken = sums["unlike_known"] + (sums["unwritten"] if mode not in CONSERVATIVE else sums["beyond_bound"]
                                         + sums["wrong_values"] + sums["leaks"] + sums["differing"])
        if mode == "exact":
            broken += wrong + sums["ties"]
        shown = {"leaks": "leaks", "beyond_bound": "beyond", "differing": "differ", "unlike_known": "unlike known"}
        parts = [f"{wrong} wrong"] * (wrong > 0) + [f"{sums[n]} {word}" for n, word in shown.items() if sums[n]]
        text = ", ".join(parts) or "0"
        return broken > 0, wrong + sum(sums[n] for n in shown), f"**{text}**" if broken else text

    cells = []
    for (case, origin, mode), own in groups(document.get("hard", []), lambda r: (r["case"], r["from"],
                                                                                 r["numeric"])).items():
        failed = next((r["failed"] for r in own if "failed" in r), None)
        worst = max(map(badness, groups(own, lambda r: r["label"]).values()))
        cells.append((case, origin, mode, f"failed: {failed}" if failed else worst[2]))
    return pivot(["hard case", "from"], cells, lambda c: c[:2], lambda c: c[2], lambda c: c[3])


def case_list(platform: Platform) -> str:
    """Wrong answers with their reasons: of the method that errs most, by place and mode."""
    text = ""
    for (scene, rays, mode), own in groups(verified(platform), lambda e: (e.scene, e.rays, e.numeric)).items():
        worst = max(own, key=lambda e: errors_of(e).wrong)
        cases = sorted((c for r in worst.views.values() for c in r["cases"]), key=lambda c: c["within_bound"])
        text += f"- {platform.name}, {scene}, {rays}, {mode}, {worst.label}\n" if cases else ""
        for c in cases[:LISTED]:
            bound = "within the bound" if c["within_bound"] else "**beyond the bound**"
            text += (f"  - {c['kind']}, {bound}: {c['reason']}. Ray {c['index']}: {c['ray']}; answer {c['answer']}, "
                     f"truth {c['truth']}.\n")
    return text


def accuracy_sections(platforms: list[Platform], documents: list[dict]) -> str:
    tables = mode_table(platforms) + rate_table(platforms)
    text = section("## What a numeric mode costs, and how often it errs", tables, LEGEND)
    for d in documents:
        text += section(f"## Hard cases: {d['device']}", hard_table(d), HARD)
    for platform in platforms:
        text += section(f"## Speed against error: {platform.name}", entry_table(platform))
    cases = "".join(map(case_list, platforms))
    return text + section("## Wrong answers and their reasons", cases + "\n" if cases else "")
