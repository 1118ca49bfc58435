#!/usr/bin/env python3
"""Checks the manuals: the files and headings that they link to exist, so do the paths in them, and none is too long."""

import re
import sys
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("engine", "shaders", "tools", "scenes", "tests")
SOURCES = {".h", ".cpp", ".comp", ".glsl", ".py", ".txt"}
MEASURED_KIB = 15  # the most of each file in tools/measured/: today's tables, and what was tried in vain
MOST_KIB = {
    "README.md": 10, "engine/README.md": 12, "engine/api/README.md": 10, "engine/api/python/README.md": 5,
    "scenes/README.md": 14, "shaders/README.md": 12, "tools/README.md": 15,
}  # fmt: skip
EXAMPLES = {"shaders/traverse/steps_first.comp"}  # files that a manual tells to write


def prose(text: str) -> str:
    """Returns a manual without its blocks of code."""
    return re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S)


def anchors(text: str) -> set[str]:
    """Returns the anchors of the headings, as GitHub makes them: headings of one name are numbered."""
    met: Counter[str] = Counter()
    found = set()
    for heading in re.findall(r"^#+ (.*)$", prose(text), re.M):
        words = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading).lower()
        anchor = re.sub(r"[^\w\- ]", "", words).replace(" ", "-")
        found.add(f"{anchor}-{met[anchor]}" if met[anchor] else anchor)
        met[anchor] += 1
    return found


def broken_links(manual: Path) -> list[str]:
    """Returns what is wrong with the links of a manual, and with the paths that it names."""
    text = manual.read_text(encoding="utf-8")
    wrong = []
    for link in re.findall(r"\]\(([^)\s]+)\)", prose(text)):
        if re.match(r"[a-z]+:", link):
            continue
        file, _, anchor = link.partition("#")
        target = manual.parent / file if file else manual
        if not target.exists():
            wrong.append(f"links to {link}, which does not exist")
        elif anchor and anchor not in anchors(target.read_text(encoding="utf-8")):
            wrong.append(f"links to {link}, but there is no such heading")
    for path in re.findall(rf"`((?:{'|'.join(FOLDERS)})/[\w./-]+\.\w+)[` ]", text):
        stands_for_any = re.search(r"/[A-Z]+\.\w+$", path)  # as engine/tree/formats/NAME.h does
        if not stands_for_any and path not in EXAMPLES and not (ROOT / path).exists():
            wrong.append(f"names {path}, which does not exist")
    return wrong


def length_of(manual: Path, name: str) -> list[str]:
    """Returns a fault if a manual is longer than it may be."""
    most = MOST_KIB.get(name, MEASURED_KIB if name.startswith("tools/measured/") else None)
    size = manual.stat().st_size
    if most is None or size <= most << 10:
        return []
    return [f"has {size} bytes; at most {most} KiB are allowed: keep what holds today, history is in git"]


def broken_mentions(source: Path) -> list[str]:
    """Returns the manuals that a source file names and that do not exist."""
    paths = re.findall(r"\b(?:\w+/)+\w+\.md\b", source.read_text(encoding="utf-8"))
    return [f"names {p}, which does not exist" for p in paths if p.startswith(FOLDERS) and not (ROOT / p).exists()]


def main() -> None:
    files = [file for folder in FOLDERS for file in sorted((ROOT / folder).rglob("*"))]
    faults = []
    for file in [ROOT / "README.md", *files]:
        name = file.relative_to(ROOT).as_posix()
        if file.suffix == ".md":
            faults += [f"{name}: {fault}" for fault in broken_links(file) + length_of(file, name)]
        elif file.suffix in SOURCES:
            faults += [f"{name}: {fault}" for fault in broken_mentions(file)]
    sys.exit("\n".join(faults) or 0)


if __name__ == "__main__":
    main()
