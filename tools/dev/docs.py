"""The reference in HTML: Sphinx over the manuals, the docstrings of Python, and what Doxygen reads in the headers."""

import os
import re
import shutil
import subprocess
import sys
import venv
from pathlib import Path

from dev import ROOT, Failed, gallery, run

OUT, FOLDER, PAGES = ROOT / "build" / "docs", ROOT / "build" / "reference", Path(__file__).parent / "reference"
REQUIREMENTS = ("sphinx>=8.1,<10", "myst-parser>=4,<6", "breathe>=5,<6")
COPIED = ("README.md", "engine", "shaders", "tools", "scenes", "tests")  # what the manuals link to


def environment() -> Path:
    """Returns the folder of the programs of Sphinx, which are installed from PyPI if they are not there."""
    folder = FOLDER / "venv"
    if not (folder / "bin/sphinx-build").exists():
        venv.create(folder, with_pip=True, clear=True)
        run(folder / "bin/python", "-m", "pip", "install", "-q", "--disable-pip-version-check", *REQUIREMENTS)
    return folder / "bin"


def sources() -> Path:
    """Returns a folder with the manuals where they lie in the tree, and the pages beside them."""
    folder = FOLDER / "source"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(PAGES, folder, ignore=shutil.ignore_patterns("*.py", "Doxyfile"))
    for name in COPIED:
        (shutil.copytree if (ROOT / name).is_dir() else shutil.copy)(ROOT / name, folder / name)
    (folder / "python").mkdir()
    return folder


def show_gallery(ballot: Path, folder: Path) -> int:
    """Renders the pictures beside their page, and adds them to it. Returns the exit code of the first that failed."""
    gallery.OUT = folder / "gallery"
    if code := gallery.render_gallery(ballot, []):
        return code
    with open(folder / "gallery.rst", "a", encoding="utf-8") as page:
        for name, (scene, options) in gallery.PICTURES.items():
            text = f"`{scene}`: `{options.replace(f'{ROOT}/', '')}`"
            page.write(f"\n{name}\n{'-' * len(name)}\n\n.. image:: gallery/{name}.png\n\n{text}\n")
    return 0


def complaints(command: list, **options) -> list[str]:
    """Runs a program and returns its warnings, each once, without the folders that only the run has."""
    done = subprocess.run([*map(str, command)], cwd=ROOT, text=True, capture_output=True, check=False, **options)
    noise = rf"{FOLDER}/source/|{ROOT}/|while setting up extension conf.py: |\x1b\[[0-9;]*m"
    said = re.sub(noise, "", done.stdout + done.stderr)
    lines = dict.fromkeys(line for line in said.splitlines() if re.search(r"\b(?:WARNING|ERROR|error|warning)\b", line))
    return [*lines] or ([f"exit code {done.returncode} of `{command[0]}`: {said[-2000:]}"] if done.returncode else [])


def make(build: Path, check: bool) -> int:
    """Makes build/docs, unless it is only checked. Throws Failed, which lists them, if links are broken or public names
    have no text."""
    packages = next((build / "python/venv/lib").glob("python3*/site-packages/ballot"), build).parent
    if packages == build.parent:
        raise Failed(f"the package of Python is not installed in {build}/python; `tools/dev.py docs` does it")
    programs, folder = environment(), sources()
    if not check and (code := show_gallery(build / "ballot", folder)):
        return code
    settings = f'OUTPUT_DIRECTORY = "{FOLDER}"\nINPUT_FILTER = "{sys.executable} {PAGES / "comments.py"}"\n'
    faults = complaints(["doxygen", "-"], input=(PAGES / "Doxyfile").read_text(encoding="utf-8") + settings)
    variables = {"BALLOT_REFERENCE": str(FOLDER), "BALLOT_PACKAGES": str(packages), "PYTHONDONTWRITEBYTECODE": "1"}
    new = FOLDER / "html"
    shutil.rmtree(new, ignore_errors=True)
    words = ["-q", "-E", "-W", "-b", "dummy" if check else "html", "-c", PAGES, "-d", FOLDER / "doctrees", folder, new]
    faults += complaints([programs / "sphinx-build", *words], env={**os.environ, **variables})
    if faults:
        raise Failed("\n".join([f"{len(faults)} faults in the reference:", *faults]))
    if not check:
        shutil.rmtree(OUT, ignore_errors=True)
        new.rename(OUT)
        print(OUT / "index.html")
    return 0
