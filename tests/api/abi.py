#!/usr/bin/env python3
"""Compares the binary interface of the library with the one that is noted: sizes and places of what structs hold,
values of constants, functions with their types, and the symbols that the library exports.

    python3 tests/api/abi.py build/release/libballot.so [--write]

A difference breaks programs that were built before. If it is meant, --write notes the interface as it is now.
"""

from __future__ import annotations

import argparse
import difflib
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NOTED = ROOT / "tests/api/abi.txt"
HEADERS = ["ballot_c.h", "ballot_c_scenes.h", "ballot_c_answers.h", "ballot_c_points.h", "ballot_c_kernels.h",
           "ballot_c_vulkan.h"]


def as_c(text: str) -> str:
    """Returns a header without its comments and what it says to C++."""
    text = re.sub(r"/\*.*?\*/", " ", text, flags=re.S)
    text = re.sub(r"#ifdef __cplusplus\n.*?#(?:else|endif)\n", "", text, flags=re.S)
    return re.sub(r"BALLOT_SIZE\(\w+\)", "size_t size", text).replace(" BALLOT_ZERO", "")


def members(body: str) -> list[str]:
    """Returns the names that a struct declares."""
    names = []
    for line in filter(str.strip, body.split(";")):
        function = re.search(r"\(\s*\*\s*(\w+)\s*\)\s*\(", line)
        declared = [function[1]] if function else [re.findall(r"\w+", re.sub(r"\[.*?\]", "", d))[-1]
                                                   for d in line.split(",")]  # fmt: skip
        names += declared
    return names


def printed(text: str) -> list[str]:
    """Returns statements of C that print structs and constants."""
    lines = []
    for name, body in re.findall(r"typedef struct (\w+) \{(.*?)\} \1;", text, flags=re.S):
        lines.append(f'printf("struct {name} size %zu\\n", sizeof({name}));')
        lines += [
            f'printf("struct {name} %zu: {m}, %zu bytes\\n", offsetof({name}, {m}), sizeof((({name}*)0)->{m}));'
            for m in members(body)
        ]
    constants = re.findall(r"^#define (BALLOT_\w+) \(?(?:0x)?[0-9A-Fa-f]+[uU]?\)? *$", text, flags=re.M)
    for body in re.findall(r"enum(?: \w+)? \{(.*?)\}", text, flags=re.S):
        constants += re.findall(r"(?:^|,)\s*(\w+)", body)
    lines += [f'printf("{name} = %lld\\n", (long long){name});' for name in constants]
    return lines


def interface(library: Path) -> str:
    text = as_c("\n".join((ROOT / "engine/api" / h).read_text() for h in HEADERS))
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        body = "\n  ".join(printed(text))
        (work / "abi.c").write_text(f'#include <stddef.h>\n#include <stdio.h>\n#include "engine/api/ballot_c.h"\n'
                                    f"int main(void) {{\n  {body}\n}}\n")  # fmt: skip
        subprocess.run(
            ["cc", f"-I{ROOT}", "-aux-info", work / "types", work / "abi.c", "-o", work / "abi"], check=True
        )
        layout = subprocess.run([work / "abi"], check=True, capture_output=True, text=True).stdout.splitlines()
        types = (work / "types").read_text().splitlines()
    ours = [t for t in types if re.match(r"/\*[^*]*engine/api/ballot_c[^*]*\*/ extern ", t)]
    functions = sorted(re.sub(r"^/\*.*?\*/ extern ", "", t) for t in ours)
    symbols = subprocess.run(["nm", "-D", "--defined-only", library], check=True, capture_output=True, text=True).stdout
    exported = sorted(line.split()[-1].split("@")[0] for line in symbols.splitlines() if " A " not in line)
    return "\n".join([*layout, *functions, *(f"exports {name}" for name in exported)]) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("library", type=Path, help="libballot.so of the build folder")
    parser.add_argument("--write", action="store_true", help=f"note the interface in {NOTED.relative_to(ROOT)}")
    options = parser.parse_args()
    found = interface(options.library)
    if options.write:
        NOTED.write_text(found)
        return
    noted = NOTED.read_text()
    if found == noted:
        print(f"abi: {found.count(chr(10))} lines as noted")
        return
    name = str(NOTED.relative_to(ROOT))
    sys.stdout.writelines(difflib.unified_diff(noted.splitlines(True), found.splitlines(True), name, "the library"))
    sys.exit(f"abi: the interface differs from {name}; if that is meant, note it: python3 tests/api/abi.py "
             f"{options.library} --write, and say so under Changes in engine/README.md")  # fmt: skip


if __name__ == "__main__":
    main()
