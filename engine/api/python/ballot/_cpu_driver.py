"""The CPU driver of `pip install "ballot[cpu]"`: the package ballot_lavapipe. It serves where there is no other."""

from __future__ import annotations

import os
import threading

from . import _ballot
from ._door import Code, DeviceInfo
from ._errors import Error

_NAMES = ("VK_DRIVER_FILES", "VK_ICD_FILENAMES")  # the second is that of loaders before 1.3.207
_lock = threading.Lock()
_looked = False
_used: str | None = None


def used() -> str | None:
    """Returns the folder of the driver of ballot_lavapipe if it serves this process."""
    return _used


def _without_driver() -> bool:
    """Returns whether the system has no device that Ballot can use."""
    try:
        return not any(DeviceInfo(*device).usable for device in _ballot.devices())
    except Error as error:
        if error.code != Code.DEVICE:
            raise
        return True


def after_fork() -> None:
    """Prepares a child of fork(): another thread of the parent may have held the lock."""
    global _lock
    _lock = threading.Lock()


def provide() -> None:
    """Has this process use the driver of ballot_lavapipe if that is installed and the system has none. What the
    environment names is left alone. To be called before a device is listed or opened."""
    global _looked, _used
    with _lock:
        if _looked:
            return
        _looked = True
        if any(name in os.environ for name in (*_NAMES, "BALLOT_VULKAN_LOADER")):
            return
        from importlib import import_module, util  # here, as `import ballot` is to be fast

        if not util.find_spec("ballot_lavapipe") or not _without_driver():
            return
        ballot_lavapipe = import_module("ballot_lavapipe")
        os.environ.update(dict.fromkeys(_NAMES, ballot_lavapipe.ICD))
        os.environ["BALLOT_VULKAN_LOADER"] = ballot_lavapipe.LOADER
        _used = os.path.dirname(ballot_lavapipe.ICD)
