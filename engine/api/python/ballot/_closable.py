"""What every object has that holds something of a device."""

from __future__ import annotations

from typing import Any, TypeVar

_Self = TypeVar("_Self", bound="Closable")


class Closable:
    """An object that can be closed, also at the end of a `with` statement."""

    _handle: Any

    @property
    def closed(self) -> bool:
        """Whether close() was called."""
        return bool(self._handle.closed)

    def close(self) -> None:
        """Lets go of what this object holds, after calls in other threads have ended. Using it then raises Error
        (Code.CLOSED).

        What others use stays: a device as long as it has scenes or arrays, the memory of an array as long as it has
        views.
        """
        self._handle.close()

    def __enter__(self: _Self) -> _Self:
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()
