"""The arrays that RaycastingScene returns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np


class Answer(np.ndarray):
    """An array of NumPy with those methods of Open3D's tensors that programs call on results.

    An element is an array without axes, as an element of a tensor is, so that these methods are there too.
    """

    def numpy(self) -> np.ndarray:
        """Returns a plain array of NumPy over the same memory."""
        return self.view(np.ndarray)

    def cpu(self) -> Answer:
        """Returns the array: it is in the host's memory."""
        return self

    def __getitem__(self, key: Any) -> Any:
        found = super().__getitem__(key)
        return found if isinstance(found, np.ndarray) else answer(np.asarray(found))

    def __hash__(self) -> int:  # type: ignore[override]
        """Returns the hash of an element's value, so that elements serve as keys."""
        if self.ndim:
            raise TypeError(f"an array of shape {self.shape} has no hash; its elements have")
        return hash(self.item())


def answer(array: np.ndarray) -> Answer:
    """Returns an array as an Answer, over the same memory."""
    return array.view(Answer)


def answers(arrays: Mapping[str, np.ndarray]) -> dict[str, Answer]:
    """Returns arrays by name as Answers."""
    return {name: answer(array) for name, array in arrays.items()}
