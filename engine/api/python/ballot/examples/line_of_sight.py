"""Lines of sight between two sets of points: which of them see each other.

>>> scene = ballot.Scene(*ground())
>>> posts = [[-15, -15, 4], [5.5, 5.5, 12], [15, 15, 4]]
>>> sees = visible(scene, posts, posts)
>>> sees.astype(int).tolist()  # the tower between the outer two is in the way
[[1, 1, 0], [1, 1, 1], [0, 1, 1]]
"""

from __future__ import annotations

from typing import Any

import numpy as np

import ballot
from ballot.examples._ground import ground


def visible(scene: ballot.Scene, eyes: Any, targets: Any, margin: float = 1e-4) -> np.ndarray:
    """Returns (n, m) bool: whether eye i, (n, 3), sees target j, (m, 3). A point sees itself.

    margin is the share of each line that is left out at both ends, so that points on surfaces do not hide themselves.
    """
    start, end = np.asarray(eyes, np.float32)[:, None], np.asarray(targets, np.float32)[None]
    # t is 0 at the eye and 1 at the target.
    return ~scene.occluded(origins=start, directions=end - start, t=(margin, 1 - margin))


if __name__ == "__main__":
    random = np.random.default_rng(1)
    points = random.uniform((-19, -19, 2), (19, 19, 6), (300, 3))
    share = visible(ballot.Scene(*ground()), points, points).mean()
    print(f"{share:.1%} of {len(points) ** 2} pairs see each other")
