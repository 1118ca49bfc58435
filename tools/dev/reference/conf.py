"""How Sphinx makes the reference. tools/dev/docs.py starts it, and says where the folders are."""

import inspect
import os
import re
import sys
from pathlib import Path

FOLDER = Path(os.environ["BALLOT_REFERENCE"])
sys.path += [str(Path(__file__).parent), os.environ["BALLOT_PACKAGES"]]

import ballot.examples  # noqa: E402
from comments import as_lists  # noqa: E402
from sphinx.pycode import ModuleAnalyzer  # noqa: E402
from sphinx.util.logging import getLogger  # noqa: E402

project, version, html_title = "Ballot", ballot.version(), "Ballot"
extensions = ["myst_parser", "breathe", "sphinx.ext.autodoc"]
exclude_patterns = ["tools/dev/**"]
myst_heading_anchors = 6
default_role = "literal"
html_theme_options = {"page_width": "76rem", "sidebar_width": "16rem", "fixed_sidebar": True, "show_powered_by": False}
html_copy_source = html_show_copyright = smartquotes = breathe_show_include = False
autodoc_default_options = {"undoc-members": True}
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
breathe_projects, breathe_default_project = {"ballot": str(FOLDER / "xml")}, "ballot"
breathe_domain_by_file_pattern = {"*ballot_c*.h": "c"}
nitpicky = True  # but for names of other libraries, and headers where a text only names them
nitpick_ignore_regex = [(r"py:.*", r"(?!ballot).*"), (r"c(pp)?:.*", r"std::.*|[a-z\d_]+"), ("std:ref", ".*_8h")]


def public():
    """Yields the names that ballot exports, and what they are."""
    for name in [*ballot.__all__, "examples"]:
        thing = getattr(ballot, name)
        kind = "function" if callable(thing) else "module" if inspect.ismodule(thing) else "data"
        yield name, thing, "class" if inspect.isclass(thing) else kind


def write_pages() -> None:
    """Writes a page for each public name of Python."""
    for name, thing, kind in public():
        text = f"{name}\n{'=' * len(name)}\n\n.. auto{kind}:: ballot.{name}\n"
        bases = getattr(thing, "__mro__", ())[1:]
        text += "   :members:\n" if kind in ("class", "module") else ""
        text += "   :inherited-members:\n" if any(base.__module__.startswith("ballot.") for base in bases) else ""
        (FOLDER / "source/python" / f"{name}.rst").write_text(text, encoding="utf-8")


def comments(module: str) -> dict[tuple[str, str], list[str]]:
    """Returns the comments of a module's attributes, which begin with #:, by class and name."""
    return ModuleAnalyzer.for_module(module).find_attr_docs()


def is_described(owner, name: str, value) -> bool:
    has_own = inspect.isroutine(value) or isinstance(value, property | staticmethod | classmethod)
    return (owner.__qualname__, name) in comments(owner.__module__) or has_own and bool(inspect.getdoc(value))


def undocumented():
    """Yields the public names without a text: of the package, and of the classes in it and in its modules."""
    for name, thing, kind in public():
        if not (("", name) in comments("ballot._arrays") if kind == "data" else inspect.getdoc(thing)):
            yield name
        for owned in vars(thing).values() if kind == "module" else [thing]:
            if inspect.isclass(owned) and (owned is thing or owned.__module__ == thing.__name__):
                own = [base for base in owned.__mro__ if base.__module__.startswith("ballot.")]
                members = ((base, *item) for base in own for item in vars(base).items())
                yield from (f"{name}.{one[1]}" for one in members if one[1][0] != "_" and not is_described(*one))


def edit(_app, what: str, name: str, _thing, _options, lines: list[str]) -> None:
    """Makes lists of the tables of a docstring. Data has its comment."""
    if what == "data":
        lines[:] = comments("ballot._arrays").get(("", name.split(".")[-1]), [])
    lines[:] = as_lists(lines, "::")


def resolve(app, environment, node, content):
    """Finds what the package names by the private module that it lies in, and what C++ has from C."""
    target = node.get("reftarget", "")
    domain, kind = {"py": ("py", "obj"), "cpp": ("c", "identifier")}.get(node.get("refdomain"), ("", ""))
    if not domain or not target.lower().startswith("ballot"):
        return None
    name, rest = re.sub(r"^ballot\._\w+\.", "ballot.", target), (environment, node["refdoc"], app.builder, kind)
    found = environment.domains[domain].resolve_xref(*rest, name, node, content)
    return found or (content if name != target else None)  # a private name stays a text


def setup(app) -> None:
    write_pages()
    for name in undocumented():
        getLogger(__name__).warning("ballot.%s has no docstring", name)
    app.connect("autodoc-process-docstring", edit)
    app.connect("missing-reference", resolve)
