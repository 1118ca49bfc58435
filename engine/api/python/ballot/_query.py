"""Checks of the arguments that say how to find hits, and of views."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from . import _door


def text(value: Any, name: str) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{name}: found {type(value).__name__}; expected a string")
    try:
        value.encode()
    except UnicodeEncodeError:
        raise ValueError(f"{name} is {shown(value)}; expected text that UTF-8 can hold") from None
    if "\0" in value:
        raise ValueError(f"{name} is {shown(value)}; expected text without zeros")
    return value


def shown(value: Any) -> str:
    """Returns what an error text shows of a value: one line."""
    line = " ".join(repr(value).split())
    return line if len(line) <= 80 else line[:77] + "..."


def number(value: Any, name: str, expected: str = "a number") -> float:
    """Returns a number, which may be infinite but is not NaN."""
    try:
        found = float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name}: found {shown(value)}; expected a number") from None
    except OverflowError:  # an integer beyond float64
        found = math.inf if value > 0 else -math.inf
    if math.isnan(found):
        raise ValueError(f"{name} is {found}; expected {expected}")
    return found


def integer(value: Any, name: str, low: int, high: int) -> int:
    """Returns an integer in [low, high]."""
    try:
        found = int(value.__index__())
    except AttributeError:
        raise TypeError(f"{name}: found {type(value).__name__}; expected an integer") from None
    if not low <= found <= high:
        raise ValueError(f"{name} is {found}; expected {low} to {high}")
    return found


#: what stands among options and leaves out triangles: words of questions, as their masks
FILTERS = ("excluded", "groups")


def options(given: Mapping[str, Any], kind: str, filters: bool = False) -> tuple[dict[str, Any], Any]:
    """Returns the options of a kind of answer or scene as the extension takes them, and the function that is told of
    progress. None stands for an option's default. `filters`: FILTERS are left to the caller."""
    if not given:
        return {}, None
    known, checked = _door.OPTIONS[kind], {}
    for name, value in given.items():
        if name == "progress" and kind not in ("scenes", "files"):
            continue
        if filters and name in FILTERS:
            continue
        if name not in known:
            also = f"; expected {', '.join(known)}" if known else ""
            raise TypeError(f"{name}: found an argument that is no option of {kind}{also}")
        if value is not None:
            kind_of_value, most = known[name]
            checked[name] = _CHECKS[kind_of_value](value, name, most)
    return checked, progress_function(given.get("progress"))


def hits_of_each(asked: Mapping[str, Any]) -> int:
    """Returns how many hits of each ray options ask for, in an axis of their own; 0: one, without."""
    return int(asked.get("first", asked.get("last", asked.get("strongest", 0))))


def _text_or_knobs(value: Any, name: str) -> str:
    if name != "knobs" or isinstance(value, str):
        return text(value, name)
    if not isinstance(value, Mapping):
        raise TypeError(f"knobs: found {type(value).__name__}; expected a dict such as {{'vote': 'count'}}")
    pairs = [(text(n, "knobs: a name"), _knob(v)) for n, v in value.items()]
    for pair in pairs:
        for part in pair:
            if "," in part or "=" in part:
                raise ValueError(f"knobs: found {part!r}; expected names and values without commas and '='")
    return ",".join(f"{n}={v}" for n, v in pairs)


def _knob(value: Any) -> str:
    return text(str(int(value)) if isinstance(value, bool) else str(value), "knobs: a value")


_CHECKS: dict[str, Callable[[Any, str, int], Any]] = {
    "Text": lambda value, name, most: _text_or_knobs(value, name),
    "Bool": lambda value, name, most: bool(value),
    "UInt32": lambda value, name, most: integer(value, name, 1, most),
    "Float32": lambda value, name, most: number(value, name),
    "Float64": lambda value, name, most: number(value, name),
    "Float64x2": lambda value, name, most: numbers(value, name, 2),
    "Float64x3": lambda value, name, most: _vector(value, name),
}


def progress_function(progress: Any) -> Any:
    if progress is not None and not callable(progress):
        raise TypeError(f"progress: found {type(progress).__name__}; expected a function of the share done, or None")
    return progress


def view(given: Any) -> tuple[Any, ...]:
    """Returns a view as the extension takes it: None is the scene's first, a string a name, a dict a camera."""
    zero = (0.0, 0.0, 0.0)
    if given is None:
        return ("", zero, zero, (0.0, 1.0, 0.0), 0.0, 0.0)
    if isinstance(given, str):
        if not given:
            raise ValueError("view: the name is empty; expected one of the scene's, or None for the first")
        return (text(given, "view"), zero, zero, (0.0, 1.0, 0.0), 0.0, 0.0)
    if not isinstance(given, Mapping):
        raise TypeError(f"view: found {type(given).__name__}; expected None, a name, or a dict with eye and target")
    unknown = set(given) - {"eye", "target", "up", "yfov", "ymag"}
    if unknown:
        raise ValueError(f"view: unknown key {sorted(map(str, unknown))[0]!r}; expected eye, target, up, yfov, ymag")
    if "eye" not in given or "target" not in given:
        raise ValueError(f"view: found the keys {sorted(given)}; expected at least eye and target")
    eye, target = _vector(given["eye"], "view: eye"), _vector(given["target"], "view: target")
    if eye == target:
        raise ValueError(f"view: eye and target are both {eye}; expected two points")
    up = _vector(given.get("up", (0, 1, 0)), "view: up")
    yfov, ymag = (finite(given.get(name, 0), f"view: {name}") for name in ("yfov", "ymag"))
    return ("", eye, target, up, yfov, ymag)


def finite(value: Any, name: str) -> float:
    found = number(value, name, "a finite number")
    if not math.isfinite(found):
        raise ValueError(f"{name} is {found}; expected a finite number")
    return found


def numbers(value: Any, name: str, count: int) -> tuple[float, ...]:
    """Returns so many finite numbers, two or three."""
    expected = "two" if count == 2 else "three"
    try:
        found = tuple(value)
    except TypeError:
        raise TypeError(f"{name}: found {shown(value)}; expected {expected} numbers") from None
    if len(found) != count:
        raise ValueError(f"{name}: found {len(found)} numbers; expected {expected}")
    return tuple(finite(n, name) for n in found)


def _vector(value: Any, name: str) -> tuple[float, float, float]:
    x, y, z = numbers(value, name, 3)
    return x, y, z
