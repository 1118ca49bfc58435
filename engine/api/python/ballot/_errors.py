"""The exceptions of ballot. Wrong values raise ValueError, wrong types TypeError; everything else is ballot.Error."""

from __future__ import annotations

import os
import sys
import warnings

from ._door import Code


class Error(RuntimeError):
    """A failure of the device, the driver, a file or of the state of an object.

    str(error) is one line that says what failed, where, what was found, what was expected and what to do. error.code is
    a Code.
    """

    def __init__(self, text: str, code: int = Code.WORK):
        super().__init__(text)
        self.code = Code(code)

    def __reduce__(self) -> tuple[type[Error], tuple[str, int]]:
        return Error, (str(self), int(self.code))


class PrecisionWarning(UserWarning):
    """Rounding to float32 moves a vertex of arrays or of a file by more than 2^-20 of the size of its mesh.

    The text says which vertex, by how much, and what to subtract. warnings.simplefilter("error",
    ballot.PrecisionWarning) makes it an exception.
    """


_FOLDER = os.path.dirname(__file__)


def warn(text: str) -> None:
    """Gives a PrecisionWarning at the line of the user's code that called the package."""
    level = 1
    while os.path.dirname(sys._getframe(level).f_code.co_filename) == _FOLDER and sys._getframe(level).f_back:
        level += 1
    warnings.warn(text, PrecisionWarning, stacklevel=level + 1)
