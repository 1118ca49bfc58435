#!/usr/bin/env python3
"""Compiles and runs the samples of a manual: the blocks of a language, one after the other, are a program.

guide.py MANUAL.md c COMPILER FLAGS...      what is no #include stands in main()
guide.py MANUAL.md cpp COMPILER FLAGS...
guide.py MANUAL.md python                   by the Python that runs this file, in the folder of the source tree
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def program(manual: Path, language: str) -> str:
    """Returns the program. Ends if there is no block of the language."""
    blocks = re.findall(rf"^```{language}\n(.*?)^```$", manual.read_text(encoding="utf-8"), re.M | re.S)
    if not blocks:
        sys.exit(f"{manual}: found no block of {language}")
    if language == "python":
        return "".join(blocks)
    lines = "".join(blocks).splitlines(keepends=True)
    includes = [line for line in lines if line.startswith("#include")]
    body = [line for line in lines if not line.startswith("#include")]
    return f"{''.join(includes)}int main(void) {{\n{''.join(body)}return 0;\n}}\n"


def main() -> None:
    manual, language, *compiler = sys.argv[1:]
    text = program(Path(manual), language)
    if language == "python":
        sys.exit(subprocess.run([sys.executable, "-c", text], cwd=ROOT, check=False).returncode)
    with tempfile.TemporaryDirectory() as folder:
        source, binary = Path(folder, f"guide.{language}"), Path(folder, "guide")
        source.write_text(text, encoding="utf-8")
        done = subprocess.run([compiler[0], source, *compiler[1:], "-o", binary], check=False)
        sys.exit(done.returncode or subprocess.run([binary], check=False).returncode)


if __name__ == "__main__":
    main()
