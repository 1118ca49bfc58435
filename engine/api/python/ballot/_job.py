"""Traces in the background."""

from __future__ import annotations

import atexit
import weakref

import numpy as np

from . import _ballot
from ._door import Times


class Job:
    """A trace that Scene.submit() began. It keeps the arrays of rays and hits; letting go of it waits for the end."""

    def __init__(self, handle: _ballot.Job, hits: np.ndarray):
        self._handle = handle
        self._hits = hits
        self.times: Times | None = None  # after wait()
        _running.add(self)

    def poll(self) -> bool:
        """Returns True if the trace has ended; wait() then returns at once."""
        return self._handle.poll()

    def wait(self) -> np.ndarray:
        """Waits for the end and returns the hits. Raises what Scene.trace() would have raised. Ctrl-C ends the waiting,
        not the job."""
        self.times = Times(*self._handle.wait())
        return self._hits

    def __repr__(self) -> str:
        return f"<ballot.Job of {self._hits.size} rays, {'ended' if self.poll() else 'running'}>"


_running: weakref.WeakSet[Job] = weakref.WeakSet()


@atexit.register
def _end() -> None:
    """Lets calls of other threads, then the jobs end before the interpreter and the driver do."""
    _ballot.end()
    for job in list(_running):
        try:
            job.wait()
        except Exception:
            pass  # it would have been raised where nobody waited for it
