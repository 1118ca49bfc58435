"""Pictures as arrays, and as PNG."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _query
from ._door import HitOptions
from ._scene import Scene

if TYPE_CHECKING:
    from typing_extensions import Unpack

_LIT = ("whitted", "path")  # shadings whose colours are those of light


class Picture(np.ndarray):
    """A picture: float32 (height, width, 4), linear Rec.709 red, green, blue and coverage, rows from the top.

    srgb() is what screens and matplotlib show, to_png() writes it, and notebooks show it by themselves. A part that was
    cut out, picture[a:b, c:d], is a Picture too. Its `lit` says whether its colours are those of light.
    """

    lit: bool = False  #: whether its colours are those of light: of the shadings "whitted" and "path"

    def __array_finalize__(self, source: Any) -> None:
        self.lit = getattr(source, "lit", False)

    def __array_wrap__(self, array: np.ndarray, *rest: Any) -> Any:
        """Returns what NumPy computed: a number where that has no axes, as of plain arrays."""
        return super().__array_wrap__(array, *rest) if array.ndim else array[()]

    def srgb(self, tone: str = "auto", exposure: float = 0.0) -> np.ndarray:
        """Returns the colours as screens show them: uint8 (height, width, 3), sRGB encoded, as in `ballot render`'s
        PNG. plt.imshow(picture.srgb()) shows them as they are; the picture itself would be too dark there.

        tone      "neutral": Khronos PBR Neutral; "none": cut off at 1; "auto": "neutral" for shadings whitted and path
        exposure  stops: colours are multiplied by 2^exposure before

        Raises ValueError if this is not a whole picture of four channels.
        """
        if self.ndim != 3 or self.shape[2] != 4:
            raise ValueError(f"srgb: shape is {self.shape}; expected (height, width, 4)")
        if tone not in ("auto", "neutral", "none"):
            raise ValueError(f"tone is {tone!r}; expected auto, neutral or none")
        if not abs(exposure) <= 30:
            raise ValueError(f"exposure is {exposure}; expected -30 to 30 stops")
        linear = np.asarray(self)[..., :3] * np.float32(2.0**exposure)
        shown = np.where(linear > 0, np.minimum(linear, np.float32(1e6)), np.float32(0))
        if tone == "neutral" or (tone == "auto" and self.lit):
            shown = _neutral(shown)
        shown = np.clip(shown, 0, 1)
        encoded = np.where(shown <= 0.0031308, 12.92 * shown, 1.055 * shown ** np.float32(1 / 2.4) - 0.055)
        return (255 * encoded + 0.5).astype(np.uint8)

    def to_png(self, path: str | os.PathLike[str], tone: str = "auto", exposure: float = 0.0) -> None:
        """Writes an 8-bit PNG of srgb(tone, exposure). Raises OSError if the file cannot be written."""
        data = _png(self.srgb(tone, exposure))
        with open(path, "wb") as file:
            file.write(data)

    def _repr_png_(self) -> bytes | None:
        """Returns a PNG for notebooks, unless this is not a whole picture."""
        return _png(self.srgb()) if self.ndim == 3 and self.shape[2] == 4 and self.size else None

    def __repr__(self) -> str:
        if self.ndim != 3 or self.shape[2] != 4:
            return repr(np.asarray(self))
        return f"<ballot.Picture of {self.shape[1]} x {self.shape[0]} pixels, float32 linear RGBA>"

    def __reduce__(self) -> tuple[Callable[..., Picture], tuple[np.ndarray, bool]]:
        return picture_of, (np.asarray(self), self.lit)


def picture_of(array: np.ndarray, lit: bool) -> Picture:
    """Returns an array as a Picture, over the same memory."""
    picture = array.view(Picture)
    picture.lit = lit
    return picture


def _neutral(color: np.ndarray) -> np.ndarray:
    """Returns linear colours (..., 3) tone-mapped by Khronos PBR Neutral, as engine/files/tone.h does it."""
    start, desaturation = np.float32(0.76), np.float32(0.15)  # 0.76: where compression begins
    least = color.min(axis=-1, keepdims=True)
    color = color - np.where(least < 0.08, least - least * least / np.float32(0.16), np.float32(0.04))
    peak = np.maximum(color.max(axis=-1, keepdims=True), start)
    rest = 1 - start
    new_peak = 1 - rest * rest / (peak + rest - start)
    white = 1 - 1 / (desaturation * (peak - new_peak) + 1)
    return np.where(peak > start, color * new_peak / peak * (1 - white) + new_peak * white, color)


def _png(rgb: np.ndarray) -> bytes:
    """Returns the file of an 8-bit picture (height, width, 3), sRGB encoded."""

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    height, width = rgb.shape[:2]
    rows = np.zeros((height, 1 + 3 * width), np.uint8)  # each begins with its filter: none
    rows[:, 1:] = rgb.reshape(height, -1)
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = chunk(b"IHDR", head) + chunk(b"sRGB", b"\0") + chunk(b"IDAT", zlib.compress(rows.tobytes()))
    return b"\x89PNG\r\n\x1a\n" + body + chunk(b"IEND", b"")


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
    **options: Unpack[HitOptions],
) -> Picture:
    """Renders a view: a Picture, an array of float32 (height, width, 4), linear Rec.709 red, green, blue and coverage,
    rows from the top. Its to_png(path) writes it, its srgb() is for plt.imshow, and notebooks show it.

    view      None: the scene's first; a name; or a dict of eye and target, (3,), and perhaps up, yfov (full vertical
              angle in radians; pi / 3) and ymag (orthographic: half the height of the view)
    width     pixels, 1 to 16384; so is height
    samples   of each pixel, 1 to 65536
    shading   "eyelight", "normals", "ao", "whitted" or "path"
    sky       as `ballot render --sky` takes it: "none", "gradient", a colour "r,g,b", FILE.exr; None: the scene's own
    bounces   last path depth, 1 to 64; 0: the shading's own
    progress  called with the share done; returning False ends the call with Error (Code.INTERRUPTED)

    The options method, numeric and knobs are those of Scene.trace(). Raises ValueError for values out of range; Ctrl-C
    ends the call.

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
    asked, progress = _query.options(options, "hits")
    rendered = scene._handle.render(_query.view(view), picture, asked, progress)
    return picture_of(rendered, shading in _LIT)
