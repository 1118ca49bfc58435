"""Reads the JSON of `ballot bench` and `ballot verify`, and groups the records of runs.

tools/bench/document.h describes the JSON."""

import json
import math
from dataclasses import dataclass, field
from pathlib import Path

MODES = ("fast", "plain", "watertight", "exact", "double")  # in this order in tables, and with these colours in plots
CONSERVATIVE = ("watertight", "exact", "double")
RUN = {"device": str, "driver": str, "subgroup_size": int, "clock": str, "commit": str, "command": str, "size": list,
       "repeats": int, "scenes": list, "records": list}
RECORD = {"scene": str, "view": str, "rays": str, "any": bool, "label": str, "role": str, "method": str,
          "numeric": str, "knobs": dict, "ray_count": int, "trace_ms": dict}
KINDS = ("methods", "builders", "frames", "queries", "origins", "errors")


class Failed(Exception):
    """The exception of failed work; its text says what failed."""


def wrong(file: Path, place: str, expected: str, found) -> Failed:
    return Failed(f"{file}: {place}: expected {expected}, found {str(found)[:40]}; give a file that `ballot bench "
                  "--json` or `ballot verify --json` wrote")


def check(file: Path, place: str, value, fields: dict) -> None:
    """Throws Failed unless the value is an object with fields of these types."""
    if not isinstance(value, dict):
        raise wrong(file, place, "an object", value)
    for name, kind in fields.items():
        if name not in value:
            raise wrong(file, place, f"an object with '{name}'", ", ".join(value) or "an empty one")
        if not isinstance(value[name], kind) or (kind is int and isinstance(value[name], bool)):
            raise wrong(file, f"{place}.{name}", f"a value of type {kind.__name__}", value[name])


def checked(document: dict, file: Path) -> dict:
    """Returns a document with the fields that older files lack. Throws Failed for what no command writes."""
    check(file, "top level", document, {"records": list})
    document.setdefault("kind", "methods")
    document["source"] = str(file)
    if document["kind"] not in KINDS:
        raise wrong(file, "kind", f"one of {', '.join(KINDS)}", document["kind"])
    if document["kind"] != "methods":
        return document
    check(file, "top level", document, RUN)
    for name, value in {"ao_rays": 8, "ao_radius": 0.05, "offset": "bounded", "partial": False, "environment": {},
                        "sweep_repeats": 0, "date": "", "cpu": "llvmpipe" in document["device"]}.items():
        document.setdefault(name, value)
    for i, record in enumerate(document["records"]):
        check(file, f"records[{i}]", record, RECORD)
        for place, value in (("trace_ms.median", record["trace_ms"].get("median")), ("ray_count", record["ray_count"])):
            if not isinstance(value, (int, float)) or not 0 < value < math.inf:
                raise wrong(file, f"records[{i}].{place}", "a number above 0", value)
    return document


def read(files: list[Path]) -> list[dict]:
    """Returns the documents of the files, each an object or several under "documents"."""
    documents = []
    for file in files:
        try:
            content = json.loads(file.read_text(encoding="utf-8"))
        except OSError as error:
            raise Failed(f"{file}: {error.strerror}") from None
        except (ValueError, RecursionError) as error:
            raise Failed(f"{file}: expected JSON, found something else: {error}") from None
        check(file, "top level", content, {})
        documents += [checked(document, file) for document in content.get("documents", [content])]
    return documents


def unique(items) -> list:
    return list(dict.fromkeys(items))


def groups(items, key) -> dict:
    """Returns the items by key, in the order of their first appearance."""
    found: dict = {}
    for item in items:
        found.setdefault(key(item), []).append(item)
    return found


def geometric_mean(values) -> float:
    return math.exp(math.fsum(map(math.log, values)) / len(values))


def rays_of(record: dict) -> str:
    return record["rays"] + (":any" if record["any"] and record["rays"].endswith(".npy") else "")


@dataclass
class Entry:
    """The records of a method with its knobs, in one numeric mode, for all views of a scene and ray kind."""
    scene: str
    rays: str
    numeric: str
    label: str
    role: str  # "method", "sweep" (one threshold of a sweep) or "best" (the best threshold of one)
    views: dict[str, dict] = field(default_factory=dict)
    whole: bool = True  # it has all views that other entries have, so that sums over views can be compared

    @property
    def first(self) -> dict:
        return next(iter(self.views.values()))

    @property
    def rays_traced(self) -> int:
        return sum(r["ray_count"] for r in self.views.values())

    @property
    def ms(self) -> float:
        return sum(r["trace_ms"]["median"] for r in self.views.values())

    @property
    def mrays(self) -> float:
        return self.rays_traced / self.ms * 1e-3

    @property
    def fps(self) -> float | None:
        """The mean over views; None without frames."""
        rates = [1000 / r["frame_ms"]["median"] for r in self.views.values() if "frame_ms" in r]
        return sum(rates) / len(rates) if rates else None

    def speed_up(self, other: "Entry") -> float | None:
        """Returns the speed over that of another, over the views that both have; None if there are none."""
        both = self.views.keys() & other.views.keys()
        own, others = (sum(e.views[v]["trace_ms"]["median"] for v in both) for e in (self, other))
        return others / own if both else None


@dataclass
class Platform:
    """The entries that may be compared: of one device, driver, clock, picture size, ao rays and offset policy."""
    name: str  # the device, and as much more as tells it from the others
    document: dict  # of its first record
    entries: list[Entry] = field(default_factory=list)

    @property
    def modes(self) -> list[str]:
        found = {entry.numeric for entry in self.entries}
        return [m for m in MODES if m in found] + sorted(found - set(MODES))


def platform_key(d: dict) -> tuple:
    return (d["device"], d["driver"], d["subgroup_size"], d["clock"], *d["size"], d["ao_rays"], d["ao_radius"],
            d["offset"])


def name_apart(platforms: list[Platform]) -> None:
    parts = (lambda d: d["driver"], lambda d: "{}x{}".format(*d["size"]),
             lambda d: f"subgroups of {d['subgroup_size']}", lambda d: d["clock"],
             lambda d: f"{d['ao_rays']} ao rays of {d['ao_radius']:g}", lambda d: f"offset {d['offset']}")
    for part in parts:
        names = [p.name for p in platforms]
        for p in platforms:
            if names.count(p.name) > 1:
                p.name += ", " + part(p.document)


def platforms_of(documents: list[dict]) -> list[Platform]:
    """Groups the records of runs of methods. Of two that measured the same, the later one counts."""
    platforms: dict[tuple, Platform] = {}
    entries: dict[tuple, Entry] = {}
    for document in documents:
        for r in document["records"]:
            at = platform_key(document)
            platform = platforms.setdefault(at, Platform(document["device"], document))
            key = (r["scene"], rays_of(r), r["numeric"], r["label"], r["role"])
            if (at, key) not in entries:
                entries[at, key] = Entry(*key)
                platform.entries.append(entries[at, key])
            entries[at, key].views[r["view"]] = r
    for platform in platforms.values():
        for block in groups(platform.entries, lambda e: (e.scene, e.rays, e.numeric)).values():
            views = {view for entry in block for view in entry.views}
            for entry in block:
                entry.whole = entry.views.keys() == views
    name_apart(list(platforms.values()))
    return list(platforms.values())
