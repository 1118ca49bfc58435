#!/usr/bin/env python3
"""Comments as Sphinx and Doxygen take them. `comments.py HEADER` prints a header whose comments are documentation."""

import itertools
import re
import sys
from pathlib import Path

ITEM = re.compile(r"((?:\S+ )?\S+(?:, \S+)*) {2,}(?=\S)")  # the beginning of a table: a name, then what it means


def column_of(rows: list[str], at: int) -> int:
    """Returns the column in which the text of a table's row begins, or 0: a long name is one space before it."""
    if found := ITEM.match(rows[at]):
        return found.end()
    below = re.match(" {4,}", rows[at + 1]) if at + 1 < len(rows) else None
    return below.end() if below and re.fullmatch(r"\S+ ", rows[at][:below.end()]) else 0


def items(rows: list[str], code: str) -> tuple[list[str], int]:
    """Returns the list that a table is, and how many rows it has."""
    column, end, result = column_of(rows, 0), 0, []
    while end < len(rows) and rows[end].strip():
        own = column_of(rows, end) or (column if re.fullmatch(r"\S+ ", rows[end][:column]) else 0)
        if not own:
            break
        name, text = rows[end][:own].rstrip(), rows[end][own:]
        below = [*itertools.takewhile(lambda row: row[:1] == " ", rows[end + 1:])]
        within = min((len(row) - len(row.lstrip()) for row in below), default=0)
        body = as_lists([text, *(row[within:] for row in below)], code)
        end += 1 + len(below)
        result += [f"- **{name}** {body[0]}".rstrip(), *(f"  {row}".rstrip() for row in body[1:])]
    return result + [""] * (end < len(rows) and rows[end].strip() != ""), end


def as_lists(rows: list[str], code: str = "") -> list[str]:
    """Returns the rows of a comment as both reStructuredText and Markdown take them: tables of names as lists, and what
    is indented as code, after `code` if that is given and else between commands of Doxygen."""
    result: list[str] = []
    at = 0
    while at < len(rows):
        row, ahead = rows[at], not (at and rows[at - 1].strip())
        indent = len(row) - len(row.lstrip())
        block = [line[indent:] for line in rows[at:]]
        if column_of(block, 0) and (bool(indent) != ahead or row[0] == '"') and not row.startswith(">>>"):
            made, count = items(block, code)
            result += made if ahead else ["", *made]
        elif indent and ahead:
            block = [*itertools.takewhile(lambda row: row[:1] in ("", " "), rows[at:])]
            result, count = result + ([code, "", *block] if code else ["@code", *block, "@endcode"]), len(block)
        else:
            result, count = [*result, row], 1
        at += count
    return result


def documentation(text: str) -> str:
    """Returns a header whose comments are documentation, and in the form that Sphinx reads of C++."""

    def block(found: re.Match) -> str:
        before, body = found[1], [re.sub(r"^ *\* ?", "", row) for row in found[2].rstrip().split("\n")]
        if before.lstrip().startswith("#include") or body[0].startswith("---"):
            return found[0]
        if before.strip():  # of all that the line declares
            comment = "/**< " + "\n".join(row.strip() for row in body) + " */ "
            return re.sub(r"(?<=[\w\]}]), (?=\*?\w+[\[,; ])", f", {comment}", before) + comment
        return f"{before}/** " + "\n".join(as_lists(body)).rstrip() + " */"

    text = re.sub(r"^#ifdef __cplusplus\n(?:(?!#endif).)*?\n#else\n(.*?)#endif\n", r"\1", text, flags=re.M | re.S)
    size = "size_t size; /* of this struct, in bytes: BALLOT_INIT() sets it */"
    text = re.sub(r"BALLOT_SIZE\(Ballot\w+\);", size, text).replace(" BALLOT_ZERO", "")
    text = re.sub(r"^( *[^ */\n][^/\n]*[;,]) +// (.*)$", r"\1 /* \2 */", text, flags=re.M)
    text = re.sub(r"^(#define \w+_H|inline namespace v1 {|}  // namespace v1)$", "", text, flags=re.M)
    text = re.sub(r"(\w+)& (\w+) = \{\.(.*?)\}", r"\1& \2 = \1(\3)", text)
    if top := re.match(r"(?://.*\n)+", text):
        text = "/* " + re.sub(r"^// ?", "", top[0], flags=re.M) + "*/\n" + text[top.end():]
    return re.sub(r"^([^\n]*?)/\* (.*?)\*/", block, text, flags=re.M | re.S).replace("/** ", "/** @file\n", 1)


if __name__ == "__main__":
    print(documentation(Path(sys.argv[1]).read_text(encoding="utf-8")), end="")
