"""Makes tables, comparisons and plots of what `ballot bench` and `ballot verify` wrote with --json. Plots need
matplotlib.

  python3 tools/report tables bench.json              tables, beside the published figures, as Markdown
  python3 tools/report tables gpu.json cpu.json --csv a line for each record
  python3 tools/report compare before.json after.json exit code 1 if a method got slower beyond noise
  python3 tools/report plots bench.json --out plots   SVG and PNG files
  python3 tools/report merge gpu.json cpu.json        the runs in one file
"""

import argparse
import json
import signal
import sys
from pathlib import Path

from accuracy import accuracy_sections, is_verified
from compare import compare
from paper import paper_section, scenes_section
from results import Failed, platforms_of, read
from speed import runs_text, speed_section
from studies import study_section
from text import csv_text

FIELDS = (".npy", ".raw")


def tables(documents: list[dict]) -> str:
    methods = [d for d in documents if d["kind"] == "methods"]
    verified, measured = [d for d in methods if is_verified(d)], [d for d in methods if not is_verified(d)]
    platforms = platforms_of(measured)
    text = runs_text(methods) if methods else ""
    if measured:
        text += scenes_section(measured) + paper_section(platforms)
    text += "".join(speed_section(p, mode) for p in platforms for mode in p.modes)
    if verified:
        text += accuracy_sections(platforms_of(verified), verified)
    return text + "".join(study_section(d) for d in documents if d["kind"] != "methods")


def plots(files: list[Path], out: Path) -> list[str]:
    try:
        from plots import STUDIES, plot_field, plot_platform
    except ImportError as missing:
        raise Failed(f"{missing}; install python3-matplotlib (Debian, for /usr/bin/python3) or matplotlib "
                     "(pip)") from None
    out.mkdir(parents=True, exist_ok=True)
    documents = read([file for file in files if file.suffix not in FIELDS])
    written = [name for file in files if file.suffix in FIELDS for name in plot_field(file, out)]
    for i, platform in enumerate(platforms_of([d for d in documents if d["kind"] == "methods"]), 1):
        written += plot_platform(platform, i, out)
    for d in documents:
        if d["kind"] in STUDIES:
            written += STUDIES[d["kind"]](d, Path(d["source"]).stem, out)
    return written


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="report", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    added = {name: commands.add_parser(name, help=text) for name, text in (
        ("tables", "prints tables of runs; those of several devices stand side by side"),
        ("compare", "tells whether the second of two runs is slower than the first"),
        ("plots", "draws plots into a folder and prints their names"), ("merge", "prints the runs of files as one"))}
    added["tables"].add_argument("--csv", action="store_true", help="print every record as CSV")
    for name in ("tables", "plots", "merge"):
        added[name].add_argument("files", nargs="+", type=Path, metavar="FILE",
                                 help="JSON of ballot" + (", or a field .npy or .raw" if name == "plots" else ""))
    added["plots"].add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the plots")
    for name, text in (("before", "the older run"), ("after", "the newer run")):
        added["compare"].add_argument(name, type=Path, metavar=f"{name.upper()}.json", help=text)
    added["compare"].add_argument("--tolerance", type=float, default=0.02, metavar="SHARE",
                                  help="by which the second run may be slower, 0 to 10 [0.02]; 0.02 is 2 %%")
    added["compare"].add_argument("--json", action="store_true", help="print the comparison as JSON")
    return parser.parse_args()


def run(options: argparse.Namespace) -> int:
    if options.command == "plots":
        print("\n".join(plots(options.files, options.out)) or "nothing to draw")
        return 0
    if options.command == "compare":
        text, data, slower = compare(read([options.before]), read([options.after]), options.tolerance)
        print(json.dumps(data, indent=1) if options.json else text, end="")
        return int(slower)
    documents = read(options.files)
    if options.command == "merge":
        print(json.dumps({"documents": documents}, indent=1))
    else:
        print(csv_text(documents) if options.csv else tables(documents), end="")
    return 0


if __name__ == "__main__":
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    try:
        sys.exit(run(arguments()))
    except (Failed, OSError) as failure:
        print(f"error: {failure}", file=sys.stderr)
        sys.exit(1)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        print(f"error: a file is not as ballot writes it: {error!r}", file=sys.stderr)
        sys.exit(1)
