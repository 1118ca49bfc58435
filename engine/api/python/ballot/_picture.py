"""Pictures as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from . import _query
from ._scene import Progress, Scene


def render(
    scene: Scene,
    view: Any = None,
    width: int = 512,
    height: int = 512,
    samples: int = 1,
    shading: str = "eyelight",
    sky: str | None = None,
    bounces: int = 0,
    seed: int = 0,
    *,
    method: str = "auto",
    numeric: str = "watertight",
    knobs: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
) -> np.ndarray:
    """Renders a view: float32 (height, width, 4), linear Rec.709 red, green, blue and coverage, rows from the top.

    view      None: the scene's first; a name; or a dict of eye and target, (3,), and perhaps up, yfov (full vertical
              angle in radians; pi / 3) and ymag (orthographic: half the height of the view)
    width     pixels, 1 to 16384; so is height
    samples   of each pixel, 1 to 65536
    shading   "eyelight", "normals", "ao", "whitted" or "path"
    sky       as `ballot render --sky` takes it: "none", "gradient", a colour "r,g,b", FILE.exr; None: the scene's own
    bounces   last path depth, 1 to 64; 0: the shading's own
    progress  called with the share done; returning False ends the call with Error (Code.INTERRUPTED)

    Other arguments as Scene.trace(). Raises ValueError for values out of range; Ctrl-C ends the call.

    >>> scene = ballot.Scene([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> image = ballot.render(scene, {"eye": (0, 0, 4), "target": (0, 0, 0)}, 32, 24)
    >>> image.shape, bool(image[12, 16, 3] == 1)
    ((24, 32, 4), True)
    """
    if not isinstance(scene, Scene):
        raise TypeError(f"scene: found {type(scene).__name__}; expected a ballot.Scene")
    picture = (
        _query.integer(width, "width", 1, 16384),
        _query.integer(height, "height", 1, 16384),
        _query.integer(samples, "samples", 1, 65536),
        _query.text(shading, "shading"),
        _query.text(sky or "", "sky"),
        _query.integer(bounces, "bounces", 0, 64),
        _query.integer(seed, "seed", 0, 2**32 - 1),
    )
    asked = _query.query(False, method, numeric, knobs)
    return scene._handle.render(_query.view(view), picture, asked, _query.progress_function(progress))
