"""Checks of the arguments that say how to find hits, and of views."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from . import _ballot


class Times(NamedTuple):
    """What a call took."""

    seconds: float  #: wall time of the call inside the library
    device_ms: float  #: time of the traversal on the device
    hits: int  #: rays that hit, or points that found a triangle; 0 for arrays on the device: not counted


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


def query(
    any: bool = False,
    method: str = "auto",
    numeric: str = "watertight",
    knobs: Mapping[str, Any] | None = None,
    ray_class: str | None = None,
) -> _ballot.Query:
    if knobs is None:
        pairs = []
    elif isinstance(knobs, Mapping):
        pairs = [(text(name, "knobs: a name"), _knob(value)) for name, value in knobs.items()]
    else:
        raise TypeError(f"knobs: found {type(knobs).__name__}; expected a dict such as {{'vote': 'count'}}")
    return _ballot.Query(
        bool(any), text(method, "method"), text(numeric, "numeric"), pairs, text(ray_class or "", "ray_class")
    )


def _knob(value: Any) -> str:
    return text(str(int(value)) if isinstance(value, bool) else str(value), "knobs: a value")


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


def _vector(value: Any, name: str) -> tuple[float, float, float]:
    try:
        numbers = tuple(value)
    except TypeError:
        raise TypeError(f"{name}: found {shown(value)}; expected three numbers") from None
    if len(numbers) != 3:
        raise ValueError(f"{name}: found {len(numbers)} numbers; expected three")
    x, y, z = (finite(n, name) for n in numbers)
    return x, y, z
