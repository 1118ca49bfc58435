"""The tables of `bench --builders` and `verify --origins`, and a plain one of every other kind of document."""

import statistics

from results import groups, unique
from text import figure, flat, pivot, rate, section, table


def build_s(record: dict) -> float:
    return statistics.median(record["build_s"])


def pays_from(record: dict, quickest: dict, kind: str) -> str:
    """Returns the rays from which on a builder is done sooner than the one that builds fastest."""
    own, other = record["mrays_per_s"][kind], quickest["mrays_per_s"][kind]
    if not own > other > 0:
        return "never"
    return f"{max(0, build_s(record) - build_s(quickest)) / (1 / other - 1 / own) * 1e6:.2g}"


def builders_text(document: dict) -> str:
    text = ""
    for scene, records in groups(document["records"], lambda r: r["scene"]).items():
        quickest, kinds = min(records, key=build_s), unique(kind for r in records for kind in r["mrays_per_s"])
        rows = [[r["builder"], figure(1e3 * build_s(r)), figure(r["triangles"] / build_s(r) * 1e-6),
                 "-" if r["peak_mib"] is None else figure(r["peak_mib"]), r["nodes"], figure(r["sah"]),
                 *(cell for kind in kinds for cell in (figure(r["mrays_per_s"][kind]),
                                                       "" if r is quickest else pays_from(r, quickest, kind)))]
                for r in records]
        text += table([scene, "build ms", "Mtris/s", "peak MiB", "nodes", "SAH cost",
                       *(title for kind in kinds for title in (f"{kind} Mrays/s", "pays from rays"))], rows)
    return text


def origins_text(document: dict) -> str:
    """Rates and offsets by size and distance, over the scenes."""
    text = ""
    for title, cell in (("self hits per million", lambda own: per_million(own, "self_hits")),
                        ("lost contacts per million", lambda own: per_million(own, "lost_contacts")),
                        ("offset / size, largest median", lambda own: f"{max(r['offset_share'] for r in own):.1e}"),
                        ("offset in ulp, largest median", lambda own: f"{max(r['offset_ulps'] for r in own):.3g}")):
        places = groups(document["records"], lambda r: (r["scene_size"], r["distance"], r["policy"]))
        text += pivot([f"size; {title}", "distance / size"], places.items(), lambda i: (f"{i[0][0]:g}", f"{i[0][1]:g}"),
                      lambda i: i[0][2], lambda i, cell=cell: cell(i[1]))
    return text


def per_million(records: list[dict], count: str) -> str:
    rays = sum(r["rays"] for r in records)
    return rate(1e6 * sum(r[count] for r in records) / rays) if rays else "-"


def records_text(document: dict) -> str:
    rows = [flat(record) for record in document["records"]]
    names = unique(name for row in rows for name in row)
    return table(names, [[figure(v) if isinstance(v := row.get(name, ""), float) else v for name in names]
                         for row in rows])


def study_section(document: dict) -> str:
    text = {"builders": builders_text, "origins": origins_text}.get(document["kind"], records_text)(document)
    about = [document[name] for name in ("device", "driver", "commit") if name in document]
    return section(f"## {document['kind'].capitalize()}", text, ", ".join(about) + "\n\n")
