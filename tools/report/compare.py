"""Compares two runs: is the second one slower than noise explains?

Records match if scene, view, rays, numeric mode and label are equal, and the platform too if there are several. Sweeps
are left out. The verdicts are on groups, geometric means over views."""

import math
from dataclasses import asdict, dataclass
from random import Random
from statistics import NormalDist, stdev

from results import Failed, geometric_mean, groups, platform_key, rays_of
from text import table

LEAST_SAMPLES = 6  # of a record, for a verdict
DRAWS = 1000  # of the bootstrap
NAMED = 10  # records that a long list names


@dataclass
class Change:
    """The median time per ray in B over that in A, with an interval; `samples` is the least of its records."""
    setting: str
    scene: str
    rays: str
    numeric: str
    label: str
    view: str
    ratio: float
    low: float
    high: float
    samples: int

    @property
    def judged(self) -> bool:
        return self.samples >= LEAST_SAMPLES

    def verdict(self, tolerance: float) -> str:
        if not self.judged:
            return "too few samples"
        return "SLOWER" if self.low > 1 + tolerance else "faster" if self.high < 1 / (1 + tolerance) else ""

    def row(self, tolerance: float) -> list[str]:
        interval = f"{self.low:.3f} to {self.high:.3f}" if self.samples > 1 else "-"
        where = [self.setting, self.scene, self.view, self.rays, self.numeric, self.label]
        return [", ".join(filter(None, where)), f"{self.ratio:.3f}", interval, self.verdict(tolerance)]


def by_key(documents: list[dict], one: bool) -> dict[tuple, dict]:
    """Returns the records by setting, scene, rays, mode, label, view; `one`: each side has one setting, left out."""
    found = {}
    for d in documents:
        setting = "" if one else ", ".join(map(str, platform_key(d)))
        for r in d["records"]:
            if r["role"] != "sweep":
                found[setting, r["scene"], rays_of(r), r["numeric"], r["label"], r["view"]] = r
    return found


def warnings_of(a: list[dict], b: list[dict], one: bool) -> list[str]:
    parts = ("device", "driver", "subgroup_size", "clock", "size", "ao_rays", "ao_radius", "offset")
    found = [f"{part} differs: {a[0][part]} and {b[0][part]}" for part in parts if one and a[0][part] != b[0][part]]
    found += [f"{side} ({d['source']}, {d['device']}) is partial: that run was interrupted, and its missing records "
              "are not compared" for side, documents in (("A", a), ("B", b)) for d in documents if d["partial"]]
    if any(d["cpu"] for d in a + b):
        found.append("on a CPU device the speed of a kernel can differ by up to 40 % between two compiles of it, and "
                     "no interval covers that; compare several runs")
    return found


def drawn_medians(samples: list[float], random: Random) -> list[float]:
    """Returns medians of bootstrap samples, drawn with replacement. What is drawn of n uniform numbers is the middle
    ones alone: number k of n in order is Beta(k, n - k + 1), and the largest of k below u is u times a root."""
    ordered, n, half = sorted(samples), len(samples), len(samples) // 2
    medians = []
    for _ in range(DRAWS):
        upper = random.betavariate(half + 1, n - half)
        lower = upper if n % 2 else upper * random.random() ** (1 / half)
        medians.append((ordered[min(int(lower * n), n - 1)] + ordered[min(int(upper * n), n - 1)]) / 2)
    return medians


def interval(log_ratio: float, logs: list[float], confidence: float) -> tuple[float, float]:
    """Returns an interval of the ratio. Each end is the further out of the bootstrap's quantile and of the end by the
    bootstrap's standard error, which stands for tails that the draws are too few to show."""
    tail, ordered = (1 - confidence) / 2, sorted(logs)
    reach = NormalDist().inv_cdf(1 - tail) * stdev(logs)
    cut = int(tail * (DRAWS - 1))
    return math.exp(min(ordered[cut], log_ratio - reach)), math.exp(max(ordered[-1 - cut], log_ratio + reach))


def changes(a: dict[tuple, dict], b: dict[tuple, dict]) -> tuple[list[Change], list[Change], float]:
    """Returns groups, single views, and the confidence of a group's interval: raised with the number of verdicts
    (Bonferroni), so that all hold together with 95 %. The seed is fixed."""
    random, measured = Random(1), []
    for key in (key for key in a if key in b):
        times = [r["trace_ms"] for r in (a[key], b[key])]
        per_ray = math.log(a[key]["ray_count"] / b[key]["ray_count"])
        log_ratio = math.log(times[1]["median"] / times[0]["median"]) + per_ray
        samples = [t.get("samples", []) for t in times]
        fewest = min(map(len, samples))
        logs = [log_ratio] * DRAWS
        if fewest > 1:
            logs = [math.log(after / before) + per_ray
                    for before, after in zip(*(drawn_medians(s, random) for s in samples))]
        measured.append((key, log_ratio, logs, fewest))
    views = [Change(*key, math.exp(log_ratio), *interval(log_ratio, logs, 0.95), fewest)
             for key, log_ratio, logs, fewest in measured]
    places = groups(measured, lambda m: m[0][:-1])
    judged = sum(min(m[3] for m in own) >= LEAST_SAMPLES for own in places.values())
    confidence = 1 - 0.05 / max(judged, 1)
    found = []
    for place, own in places.items():
        log_ratio = sum(m[1] for m in own) / len(own)
        logs = [sum(draws) / len(own) for draws in zip(*(m[2] for m in own))]
        found.append(Change(*place, "", math.exp(log_ratio), *interval(log_ratio, logs, confidence),
                            min(m[3] for m in own)))
    return found, views, confidence


def named(title: str, lines: list[str]) -> str:
    more = [f"and {len(lines) - NAMED} more"] if len(lines) > NAMED else []
    return f"{title}: {len(lines) or 'none'}\n" + "".join(f"  {line}\n" for line in lines[:NAMED] + more)


def compare(a: list[dict], b: list[dict], tolerance: float) -> tuple[str, dict, bool]:
    """Returns the comparison as text and as JSON, and whether a group is slower by more than the tolerance."""
    if not 0 <= tolerance <= 10:
        raise Failed(f"--tolerance: {tolerance} is not a share from 0 to 10, such as 0.02")
    for d in a + b:
        if d["kind"] != "methods":
            raise Failed(f"{d['source']}: found a run of {d['kind']}, expected one of methods")
    one = all(len({platform_key(d) for d in side}) == 1 for side in (a, b))
    in_a, in_b = by_key(a, one), by_key(b, one)
    if not in_a.keys() & in_b.keys():
        raise Failed(f"{a[0]['source']} and {b[0]['source']} have no record in common: found {len(in_a)} and "
                     f"{len(in_b)} records, expected some of equal {'' if one else 'device, driver, size, '}scene, "
                     "view, rays, label and numeric mode")
    found, views, confidence = changes(in_a, in_b)
    missing = {side: [", ".join(filter(None, key)) for key in own if key not in other]
               for side, own, other in (("A", in_a, in_b), ("B", in_b, in_a))}
    judged = [c for c in found if c.judged]
    warnings, text = warnings_of(a, b, one), ""
    text += "".join(f"warning: {warning}\n" for warning in warnings)
    text += ("B / A: traversal time per ray in B over that in A, geometric mean over views; below 1, B is faster.\n"
             f"Each interval has a confidence of {100 * confidence:.4g} %, so that all {len(judged)} hold together "
             "with 95 %.\n\n")
    text += table(["", "B / A", "interval", "beyond noise"], [c.row(tolerance) for c in found])
    text += f"geometric mean of all {len(found)}: {geometric_mean([c.ratio for c in found]):.3f}\n"
    text += "".join(named(f"only in {side}", keys) for side, keys in missing.items() if keys)
    if len(judged) < len(found):
        text += (f"{len(found) - len(judged)} have too few samples and were not judged: a record has fewer than "
                 f"{LEAST_SAMPLES}\n")
    for word in ("faster", "SLOWER"):
        for title, some in ((f"single views {word.lower()}", [c for c in views if len(views) > len(found)]),
                            (word.lower(), found)):
            changed = sorted((c for c in some if c.verdict(tolerance) == word), key=lambda c: abs(math.log(c.ratio)),
                             reverse=True)
            text += named(f"{title} by more than {100 * tolerance:g} %",
                          [" ".join(c.row(tolerance)[:2]) for c in changed])
    slower = any(c.verdict(tolerance) == "SLOWER" for c in found)
    data = {"tolerance": tolerance, "confidence": confidence, "warnings": warnings, "only_in": missing,
            "groups": [asdict(c) | {"verdict": c.verdict(tolerance)} for c in found],
            "views": [asdict(c) | {"verdict": c.verdict(tolerance)} for c in views]}
    return text, data, slower
