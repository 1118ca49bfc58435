"""Names and cheap checks by clang-tidy, on the C++ files that changed last."""

import json
import os
import re
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import dev_build
from dev_build import ROOT
from dev_packages import Failed

HELP = """\
Runs clang-tidy with the rules of .clang-tidy: how types, functions, variables, members, constants and macros are
named, and a few cheap checks. Without --all it takes the files of the last --commits commits and of the work tree, the
newest first and --files at most; a header is checked through the .cpp of the same name. A file takes about three
seconds.

  tools/dev.py lint
  tools/dev.py lint --all
"""
FOLDERS = ("engine/", "tools/", "tests/")


def _git(*arguments: str) -> list[str]:
    result = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise Failed(f"git {' '.join(arguments)}: {result.stderr.strip()}")
    return result.stdout.splitlines()


def changed_files(commits: int) -> list[str]:
    """Files of the work tree and of the last commits, the newest first, each once."""
    names = [line[3:] for line in _git("status", "--porcelain")]
    names += [line for line in _git("log", f"-{commits}", "--name-only", "--format=") if line]
    return list(dict.fromkeys(names))


def sources_of(names: list[str]) -> list[str]:
    """The .cpp files to check: those named, and those of headers that are named."""
    sources = []
    for name in names:
        source = re.sub(r"\.h$", ".cpp", name)
        if source.endswith(".cpp") and source.startswith(FOLDERS) and (ROOT / source).is_file():
            sources.append(source)
    return list(dict.fromkeys(sources))


def database() -> Path:
    """A compilation database without unity files; they would hide the single ones."""
    folder = ROOT / "build" / "lint"
    dev_build.run_logged("configuring lint", ["cmake", "-S", ".", "-B", str(folder), "-G", "Ninja",
                                              "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_UNITY_BUILD=OFF"],
                         folder / "configure.log")
    commit = folder / "generated" / "ballot_commit.h"  # a build writes it
    commit.parent.mkdir(parents=True, exist_ok=True)
    commit.write_text('#define BALLOT_COMMIT "unknown"\n', encoding="utf-8")
    return folder


def check(source: str, folder: Path) -> list[str]:
    """The findings of a file, a line each."""
    result = subprocess.run(["clang-tidy", "-p", str(folder), "--quiet", source], cwd=ROOT, capture_output=True,
                            text=True, check=False)
    found = [line for line in result.stdout.splitlines() if re.search(r": (error|warning): ", line)]
    if result.returncode != 0 and not found:
        found = [f"{source}: clang-tidy failed: {(result.stderr.strip().splitlines() or ['no message'])[-1]}"]
    return found


def lint(options) -> int:
    if options.all:
        sources = sources_of(_git("ls-files", *FOLDERS))
    else:
        sources = sources_of(changed_files(options.commits))
        if len(sources) > options.files:
            print(f"{len(sources)} changed files; the {options.files} changed last are checked")
            sources = sources[:options.files]
    folder = database()
    # The extension of Python is built by a project of its own, which nobody has configured here.
    known = {entry["file"] for entry in json.loads((folder / "compile_commands.json").read_text(encoding="utf-8"))}
    sources = [source for source in sources if str(ROOT / source) in known]
    with ThreadPoolExecutor(max_workers=len(os.sched_getaffinity(0))) as pool:
        findings = sorted({line for found in pool.map(lambda s: check(s, folder), sources) for line in found})
    for line in findings:
        print(line)
    print(f"{len(sources)} files checked, {len(findings)} findings")
    return 1 if findings else 0
