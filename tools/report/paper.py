"""The published figures beside ours: M. Vinkler, "Traversal methods for GPU ray tracing", Tables 1 and 2.

They were measured on an NVIDIA GTX 280 at 1024 x 1024, as means of five viewpoints, for frames with ray generation and
shading."""

from results import Platform, unique
from text import figure, percent, section, table

# Scene: stems of the files that stand for it, then triangles, split triangles and nodes as Table 1 rounds them. The
# paper's Fairy scene was not available; the stand-in is a model made to resemble it.
SCENES = {"Conference": (("conference",), "283k", "424k", "190k"),
          "Fairy": (("fairyforest-standin", "fairyforest", "fairy"), "174k", "261k", "117k"),
          "Sibenik": (("sibenik",), "80k", "121k", "56k"),
          "Sponza": (("sponza",), "76k", "114k", "52k")}
NOTE = ("Paper: M. Vinkler, *Traversal methods for GPU ray tracing*; NVIDIA GTX 280, 1024 x 1024, five viewpoints. Its "
        "packet votes by\n`any`, its cut by a reduction in shared memory, as `sum` does. Where that vote was not "
        "measured, the label of what stands in\nfollows the figure. A scene named stand-in only resembles the "
        "paper's.\n\n")

# The halves of Table 2, by kind of rays: the paper's name of a row, our labels, the first measured of which is shown,
# then frames per second and gain over packet by scene.
TABLE_2 = {
    "primary": [
        ("packet", ("packet(any)",), ("68.12", "0%"), ("60.44", "0%"), ("49.48", "0%"), ("47.46", "0%")),
        ("if-if", ("if-if",), ("54.80", "-19.55%"), ("54.54", "-9.76%"), ("49.48", "0%"), ("47.80", "+0.72%")),
        ("stack-max(11)", ("stack-max(11)", "stack-max(11,count)"), ("67.44", "-1.00%"), ("60.64", "+0.33%"),
         ("49.93", "+0.91%"), ("47.40", "-0.13%")),
        ("stack-max(best)", ("stack-max(best)", "stack-max(best,count)"), ("67.92", "-0.29%"), ("61.20", "+1.26%"),
         ("49.94", "+0.93%"), ("47.56", "+0.21%")),
        ("cut", ("cut(sum)", "cut"), ("61.98", "-9.01%"), ("53.04", "-12.24%"), ("44.96", "-9.14%"),
         ("42.28", "-10.91%"))],
    "secondary": [
        ("packet", ("packet(any)",), ("21.22", "0%"), ("18.84", "0%"), ("14.94", "0%"), ("15.26", "0%")),
        ("if-if", ("if-if",), ("21.80", "+2.73%"), ("19.50", "+3.50%"), ("16.80", "+12.45%"), ("19.18", "+25.69%")),
        ("stack-max(7)", ("stack-max(7)", "stack-max(7,count)"), ("21.72", "+2.36%"), ("19.98", "+6.05%"),
         ("15.40", "+3.08%"), ("16.26", "+6.55%")),
        ("stack-max(best)", ("stack-max(best)", "stack-max(best,count)"), ("21.78", "+2.64%"), ("20.04", "+6.37%"),
         ("15.80", "+5.76%"), ("17.32", "+13.50%")),
        ("cut", ("cut(sum)", "cut"), ("21.66", "+2.07%"), ("18.30", "-2.87%"), ("13.82", "-7.50%"),
         ("15.00", "-1.70%"))]}


def paper_name(scene: str) -> str | None:
    return next((name for name, (files, *_) in SCENES.items() if scene in files), None)


def title(scene: str) -> str:
    return f"{paper_name(scene) or scene}{' (stand-in)' if scene.endswith('-standin') else ''}"


def scenes_section(documents: list[dict]) -> str:
    rows = []
    for s in (s for d in documents for s in d["scenes"]):
        paper = SCENES[paper_name(s["name"])][1:] if paper_name(s["name"]) else ("", "", "")
        rows.append((title(s["name"]), paper[0], s["triangles"], paper[1], s["references"], paper[2], s["nodes"],
                     s["depth"], f"{s['sah']:.1f}", f"{s['bytes'] / 2**20:.1f}"))
    return section("## Table 1: the scenes", table(["scene", "triangles, paper", "here", "split triangles, paper",
                                                    "here", "nodes, paper", "here", "depth", "SAH cost", "MiB"],
                                                   unique(rows)))


def half(platforms: list[Platform], rays: str) -> str:
    """Returns a half of Table 2: the paper's columns, each followed by those of the platforms and modes."""
    columns = [(name, platform, numeric, {e.label: e for e in platform.entries if e.role != "sweep" and e.fps
                                          and (e.rays, e.numeric, paper_name(e.scene)) == (rays, numeric, name)})
               for name in SCENES for platform in platforms for numeric in platform.modes]
    columns = [column for column in columns if column[3]]
    header, rows = [f"{rays} rays"], []
    for i, (name, platform, numeric, own) in enumerate(columns):
        if i == 0 or columns[i - 1][0] != name:
            header.append(f"{name}, paper")
        header.append(f"{title(next(iter(own.values())).scene)}, {platform.name}, {numeric}")
    for row, labels, *printed in TABLE_2[rays] if columns else ():
        cells = [row]
        for i, (name, _, _, own) in enumerate(columns):
            if i == 0 or columns[i - 1][0] != name:
                cells.append("{} ({})".format(*printed[list(SCENES).index(name)]))
            shown = next((own[label] for label in labels if label in own), None)
            base = own.get("packet(any)")
            gain = f" ({percent(shown.fps / base.fps)})" if shown and base else ""
            name_of = f", {shown.label}" if shown and shown.label != labels[0] else ""
            cells.append(f"{figure(shown.fps)}{gain}{name_of}" if shown else "-")
        rows.append(cells)
    return table(header, rows)


def paper_section(platforms: list[Platform]) -> str:
    return section("## Table 2: frames per second, and gain over packet", "".join(half(platforms, r) for r in TABLE_2),
                   NOTE)
