"""Tables as Markdown and CSV, and numbers as text."""

import csv
import io

from results import unique


def figure(value: float) -> str:
    """Returns a number with at least four significant digits: "5867", "36.84", "0.9931"."""
    if value == 0:
        return "0"
    size = abs(value)
    digits = 0 if size >= 999.5 else 1 if size >= 99.95 else 2 if size >= 9.995 else 3 if size >= 0.9995 else 4
    return f"{value:.{digits}f}"


def percent(ratio: float) -> str:
    return f"{100 * (ratio - 1):+.1f} %"


def rate(value: float) -> str:
    """Returns a rate with at most two decimals, or with an exponent: "0", "0.58", "12.3", "5210", "1.2e-03"."""
    if value == 0:
        return "0"
    if value < 0.01 or value >= 1e6:
        return f"{value:.1e}"
    return f"{value:.{2 if value < 1 else 1 if value < 99.95 else 0}f}"


def cell_text(cell) -> str:
    """Returns a cell in one line. Names come from files, and must end neither a cell nor a line."""
    return "".join(c if c.isprintable() else " " for c in str(cell)).replace("|", "\\|")


def table(header: list, rows: list[list], left: int = 1) -> str:
    """Returns a Markdown table, "" without rows. The first `left` columns hold text, the others are aligned right."""
    if not rows:
        return ""
    lines = [[cell_text(cell) for cell in row] for row in [header, *rows]]
    widths = [max(3, *(len(line[i]) for line in lines)) for i in range(len(header))]
    texts = ["| " + " | ".join(c.ljust(w) if i < left else c.rjust(w)
                               for i, (c, w) in enumerate(zip(line, widths))) + " |" for line in lines]
    rule = "|" + "|".join(" " + "-" * w + " " if i < left else " " + "-" * (w - 1) + ": "
                          for i, w in enumerate(widths)) + "|"
    return "\n".join([texts[0], rule, *texts[1:]]) + "\n\n"


def pivot(titles: list[str], items, row, column, cell) -> str:
    """Returns a table with a row for each `row(item)`, a tuple under these titles, and a column for each
    `column(item)`. `cell(item)` is the text; "-" where there is no item."""
    items = list(items)
    rows, columns = unique(row(i) for i in items), unique(column(i) for i in items)
    cells = {(row(i), column(i)): cell(i) for i in items}
    return table([*titles, *columns], [[*r, *(cells.get((r, c), "-") for c in columns)] for r in rows], len(titles))


def section(heading: str, body: str, intro: str = "") -> str:
    """Returns a section; "" if the body is empty."""
    return f"{heading}\n\n{intro}{body}" if body else ""


def flat(record: dict, prefix: str = "") -> dict:
    """Returns the fields of a record without lists; those of an object inside are called "object.field"."""
    fields = {}
    for name, value in record.items():
        if name == "knobs":
            fields[prefix + name] = " ".join(f"{k}={v}" for k, v in value.items())
        elif isinstance(value, dict):
            fields.update(flat(value, f"{prefix}{name}."))
        elif not isinstance(value, list):
            fields[prefix + name] = value
    return fields


def csv_text(documents: list[dict]) -> str:
    """Returns a line for each record, of any kind of document; those of hard cases too."""
    rows = []
    for d in documents:
        head = {name: d[name] for name in ("device", "driver", "clock") if name in d}
        rows += [head | flat(record) for record in d["records"] + d.get("hard", [])]
    out = io.StringIO()
    writer = csv.DictWriter(out, unique(name for row in rows for name in row))
    writer.writeheader()
    writer.writerows(rows)
    return out.getvalue()
