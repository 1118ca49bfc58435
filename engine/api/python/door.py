#!/usr/bin/env python3
"""Reads the C interface, which is the table of options, columns, infos and error codes, and writes what the other doors
are made of:

    door.py FOLDER --rows OUT.h      rows for the library, the program and the extension of Python
    door.py FOLDER --python OUT.py   types and texts for Python

FOLDER holds ballot_c.h. A member of a struct is a row: its name, its type, and its comment as the text. "Of hits and
crossings: " at the beginning of a text says which kinds of answers, or of scenes, the row is for; "3 each: " how many
numbers a column has of each question.
"""

from __future__ import annotations

import argparse
import re
import textwrap
from dataclasses import dataclass
from pathlib import Path

HEADERS = ("ballot_c.h", "ballot_c_scenes.h", "ballot_c_answers.h", "ballot_c_points.h",
           "ballot_c_kernels.h", "ballot_c_vulkan.h")
KINDS = ("hits", "crossings", "points", "within", "files")
ROWS = {"BallotQuery": "kQueryRows", "BallotSceneOptions": "kSceneRows", "BallotHits": "kHitRows",
        "BallotNearest": "kNearestRows", "BallotClearance": "kClearanceRows", "BallotSceneInfo": "kSceneInfoRows",
        "BallotMeshInfo": "kMeshInfoRows", "BallotInstanceInfo": "kInstanceInfoRows",
        "BallotAnimationInfo": "kAnimationInfoRows", "BallotDeviceInfo": "kDeviceInfoRows",
        "BallotInputInfo": "kInputInfoRows", "BallotTimes": "kTimesRows"}  # fmt: skip
TYPES = {"BallotText": "Text", "BallotBool": "Bool", "uint32_t": "UInt32", "uint64_t": "UInt64", "float": "Float32",
         "double": "Float64", "char": "Chars", "float*": "Floats", "uint32_t*": "UInt32s", "uint8_t*": "Bools",
         "double*": "Doubles", "BallotSums": "Sums", "BallotHit*": "Hits",
         "BallotNearestPoint*": "Nearests"}  # fmt: skip
NAMES = {"ballot_trace": "trace", "ballot_list_crossings": "crossings", "ballot_query_points": "nearest",
         "ballot_list_within": "within", "BallotHits": "trace_columns()"}  # fmt: skip


#: what stands among the options of Python, and in C among columns of questions and arrays on the device
FILTERS = {"excluded": "whole numbers, as masks: of each ray or point the triangle to leave out, as HIT's prim counts, "
                       "such as the one that it leaves; MISS: none",
           "groups": "whole numbers, as masks: instances of other groups are left out, but for shared ones "
                     "(set_groups()); None: none is"}  # fmt: skip


@dataclass
class Row:
    """A member of a struct."""

    name: str
    type: str  # one of TYPES
    count: int  # numbers of an array, or of a column for each question
    kinds: tuple[str, ...]  # that it is for; empty: all
    text: str


def members(body: str) -> list[tuple[str, str]]:
    """Returns the declarations of a struct and their comments: the one before a declaration, or behind it."""
    found, before = [], ""
    for comment, code in re.findall(r"/\*(.*?)\*/|([^;/]+;)", body, flags=re.S):
        words = " ".join(re.sub(r"\n\s*\* ?", " ", comment).split()).rstrip(".")
        if code:
            found.append((" ".join(code.replace("BALLOT_ZERO", "").rstrip(";").split()), before))
            before = ""
        elif found and not found[-1][1] and "\n" not in body[: body.index(comment)].rsplit(";", 1)[-1]:
            found[-1] = (found[-1][0], words)
        else:
            before = words
    return found


def row(code: str, text: str) -> Row | None:
    """Returns the row of a member; None for functions, what is given to them, and the size."""
    made = re.fullmatch(r"(.*?)\s*(\w+)(?:\[(\d+)\])?", code)
    if "(" in code or not made or made[1] not in TYPES:
        return None
    count = int(made[3] or 1)
    if width := re.match(r"(\d) each: ", text):
        count, text = int(width[1]), text[width.end() :]
    kinds: tuple[str, ...] = ()
    if (of := re.match(r"Of ([\w, ]+): ", text)) and all(k in KINDS for k in re.split(r", | and ", of[1])):
        kinds, text = tuple(re.split(r", | and ", of[1])), text[of.end() :]
    return Row(made[2], TYPES[made[1]], count, kinds, text)


class Door:
    """The C interface."""

    def __init__(self, folder: Path):
        text = "\n".join((folder / name).read_text() for name in HEADERS)
        found = re.findall(r"/\*((?:(?!\*/).)*)\*/\ntypedef struct (\w+) \{\n(.*?)\n\} \2;", text, flags=re.S)
        self.texts = {name: " ".join(re.sub(r"\n \* ?", " ", comment).split()) for comment, name, _ in found}
        self.rows = {n: [r for m in members(body) if (r := row(*m))] for _, n, body in found if n in ROWS}
        (body,) = re.findall(r"typedef enum BallotStatus \{(.*?)\}", text, flags=re.S)
        self.codes = re.findall(r"BALLOT_ERROR_(\w+) = (\d+),\s*/\* (.*?) \*/", body)
        if missing := [n for n in ROWS if not self.rows.get(n)] or (not self.codes and ["BallotStatus"]):
            raise SystemExit(f"door.py: {folder}: no rows of {', '.join(missing)} were found in {', '.join(HEADERS)}")


def c_rows(door: Door) -> str:
    """Returns the header with the rows."""
    lines = ["// Made by engine/api/door.py of the C interface: its members as rows.", "#pragma once", "",
             "#include <cstddef>", "", "namespace ballot::door {", "",
             "/// What a member is; in the plural a column: a pointer to an entry for each question.",
             f"enum class Type {{ {', '.join(TYPES.values())} }};",
             "/// The kinds of answers and scenes that a row is for, as bits.",
             "enum Kinds : unsigned { " + ", ".join(f"k{k.title()} = {1 << i}" for i, k in enumerate(KINDS))
             + f", kAll = {(1 << len(KINDS)) - 1} }};",
             "/// A member of a struct. `count`: numbers of an array, or of a column for each question.",
             "struct Row {", "  const char* name;", "  Type type;", "  unsigned count, kinds;", "  std::size_t offset;",
             "  const char* text;", "};", ""]  # fmt: skip
    for struct, name in ROWS.items():
        lines.append(f"inline constexpr Row {name}[] = {{")
        for r in door.rows[struct]:
            kinds = " | ".join(f"k{k.title()}" for k in r.kinds) or "kAll"
            text = r.text.replace("\\", "\\\\").replace('"', '\\"')
            offset = f"offsetof({struct}, {r.name})"
            lines.append(f'    {{"{r.name}", Type::{r.type}, {r.count}, {kinds}, {offset}, "{text}"}},')
        lines.append("};")
    return "\n".join([*lines, "", "}  // namespace ballot::door", ""])


def words_of_python(text: str, is_bool: bool = False) -> str:
    """Returns a text of C with the names and values of Python."""
    text = text.replace("NULL", "None").replace("BALLOT_MISS", "MISS")
    text = re.sub(r"Ballot(?:Query|SceneOptions|Mesh|Rays|Points|Instances)::(\w+)", r"\1", text)
    text = re.sub(r"\bBallotHits\b", NAMES["BallotHits"], text)
    text = re.sub(r"ballot_(\w+)\(\)", lambda m: NAMES.get(m[0][:-2], re.sub("^scene_", "", m[1])) + "()", text)
    return re.sub(r"\b1: ", "True: ", re.sub(r"\b0: ", "False: ", text)) if is_bool else text


def most_of(r: Row) -> int:
    """Returns the largest number that an option takes, as its text says."""
    most = re.search(r"\b1 to (\d+)\b", r.text)
    return int(most[1]) if most else 2**32 - 2


def python_type(r: Row) -> str:
    one = {"Text": "str | None", "Bool": "bool", "UInt32": "int", "UInt64": "int", "Float32": "float",
           "Float64": "float", "Chars": "str"}[r.type]  # fmt: skip
    if r.name == "knobs":
        return "Mapping[str, object] | str | None"
    if r.count == 1 or r.type == "Chars":
        return one
    return "np.ndarray" if r.count > 3 else f"tuple[{', '.join([one] * r.count)}]"


def text_of(r: Row) -> str:
    return words_of_python(r.text, r.type in ("Bool", "Bools"))


def field(declared: str, text: str) -> list[str]:
    """Returns a field of a class with its text."""
    return [*(f"    #: {line}" for line in textwrap.wrap(text, 113)), f"    {declared}"]


def fields(name: str, kind: str, text: str, rows: list[Row]) -> list[str]:
    """Returns a class whose fields are rows."""
    lines = [f"class {name}({kind}):", f'    """{text}"""', ""]
    for r in rows:
        lines += field(f"{r.name}: {python_type(r)}", text_of(r))
    return lines


def table(rows: list[tuple[str, str]]) -> str:
    """Returns names with their texts, for a docstring."""
    width = max(len(name) for name, _ in rows) + 2
    room = 112 - width
    lines = []
    for name, text in rows:
        first, *rest = textwrap.wrap(text, room, break_on_hyphens=False)
        lines += [f"{name:{width}}{first}", *(" " * width + line for line in rest)]
    return "\n".join(lines)


def python(door: Door) -> str:
    """Returns the module of Python."""
    of = {kind: [r for r in door.rows["BallotQuery"] if not r.kinds or kind in r.kinds] for kind in KINDS[:3]}
    of["scenes"] = [r for r in door.rows["BallotSceneOptions"] if not r.kinds]
    of["files"] = door.rows["BallotSceneOptions"]
    lines = ['"""What the C interface says: options, columns, infos and error codes. Made by door.py."""', "",
             "from __future__ import annotations", "", "import enum",
             "from collections.abc import Callable, Mapping", "from typing import Any, NamedTuple, TypedDict", "",
             "import numpy as np", "", "",
             "class Code(enum.IntEnum):", '    """The kind of a failure, Error.code."""', ""]  # fmt: skip
    for name, number, text in door.codes:
        lines += field(f"{name} = {number}", words_of_python(text))
    lines += ["", ""]
    for struct in ROWS:
        if struct.endswith("Info") or struct == "BallotTimes":
            lines += fields(struct[6:], "NamedTuple", words_of_python(door.texts[struct]), door.rows[struct])
            lines += ["", ""]
    for kind, rows in of.items():
        name = {"hits": "HitOptions", "crossings": "CrossingOptions", "points": "PointOptions",
                "scenes": "SceneOptions", "files": "FileOptions"}[kind]  # fmt: skip
        lines += fields(name, "TypedDict, total=False", f"How to answer: options of {kind}.", rows)
        if kind in KINDS[:3]:
            for filter, text in FILTERS.items():
                lines += field(f"{filter}: Any", text)
            lines += field("progress: Callable[[float], object] | None",
                           "called with the share done; returning False ends the call")  # fmt: skip
        lines += ["", ""]
    lines += ["#: the options of each kind, by name, with the kind of their values and the largest number",
              "OPTIONS: dict[str, dict[str, tuple[str, int]]] = {"]  # fmt: skip
    for kind, rows in of.items():
        types = [r.type if r.count == 1 else f"{r.type}x{r.count}" for r in rows]
        pairs = ", ".join(f'"{r.name}": ("{t}", {most_of(r)})' for r, t in zip(rows, types))
        lines += [f'    "{kind}": {{{pairs}}},']
    lines += ['    "within": {},', "}"]
    number = {"Floats": "np.float32", "Doubles": "np.float64", "UInt32s": "np.uint32", "Bools": "np.bool_"}
    for struct, name in (("BallotHits", "HIT_COLUMNS"), ("BallotNearest", "POINT_COLUMNS"),
                         ("BallotClearance", "CLEARANCE_COLUMNS")):
        lines += [f"{name}: dict[str, tuple[type, tuple[int, ...]]] = {{  # dtype, and shape of an entry"]
        lines += [f'    "{r.name}": ({number[r.type]}, ({f"{r.count}," if r.count > 1 else ""})),'
                  for r in door.rows[struct] if r.type in number]  # fmt: skip
        lines += ["}"]
    texts = {f"{kind}_options": table([(r.name, text_of(r)) for r in rows]
                                      + (list(FILTERS.items()) if kind in KINDS[:3] else []))
             for kind, rows in of.items()}  # fmt: skip
    shapes = {1: "(...)", 2: "(..., 2)", 3: "(..., 3)", 4: "(..., 4)"}
    for struct, name in (("BallotHits", "hit_columns"), ("BallotNearest", "point_columns"),
                         ("BallotClearance", "clearance_columns")):
        texts[name] = table([(f'"{r.name}"', f"{shapes[r.count]} {number[r.type][3:].rstrip('_')}: {text_of(r)}")
                             for r in door.rows[struct] if r.type in number])  # fmt: skip
    lines += ["", "_TEXTS = {", *(f"    \"{name}\": '''{text}'''," for name, text in texts.items()), "}", "", "",
              "def documented(function: _F) -> _F:",
              '    """Puts the texts of options and columns where a docstring names them: {hits_options}."""',
              "    lines = []",
              "    for line in (function.__doc__ or \"\").split(\"\\n\"):",
              "        name, indent = line.strip(), line[: len(line) - len(line.lstrip())]",
              "        words = _TEXTS.get(name[1:-1]) if name.startswith(\"{\") else None",
              "        lines.append(line if words is None else indent + words.replace(\"\\n\", \"\\n\" + indent))",
              "    function.__doc__ = \"\\n\".join(lines)", "    return function", ""]  # fmt: skip
    text = "\n".join(lines)
    return text.replace("import Any, NamedTuple, TypedDict\n", "import Any, NamedTuple, TypedDict, TypeVar\n").replace(
        "import numpy as np\n", 'import numpy as np\n\n_F = TypeVar("_F", bound=Callable[..., object])\n', 1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="the folder of ballot_c.h")
    parser.add_argument("--rows", type=Path, help="write the rows for C++ here")
    parser.add_argument("--python", type=Path, help="write the module of Python here")
    options = parser.parse_args()
    door = Door(options.folder)
    for path, made in ((options.rows, c_rows), (options.python, python)):
        if path:
            path.parent.mkdir(parents=True, exist_ok=True)
            text = made(door)
            if not path.exists() or path.read_text() != text:  # else what depends on it stays as it is
                path.write_text(text)


if __name__ == "__main__":
    main()
