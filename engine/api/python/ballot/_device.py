"""Devices: those that there are, those that are open, and the one that everything shares unless told otherwise."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable

from . import _ballot, _cpu_driver, _query
from ._closable import Closable
from ._door import DeviceInfo
from ._errors import Error


def devices() -> list[DeviceInfo]:
    """Returns the Vulkan devices of this machine, usable or not.

    Raises Error (Code.DEVICE) if there is no Vulkan driver; the text names the line that installs one.
    """
    _cpu_driver.provide()
    return [DeviceInfo(*device) for device in _ballot.devices()]


class Device(Closable):
    """A device that is open.

    name      an index of devices(), part of a name, "gpu" or "cpu"; "": the best GPU, else a CPU device
    validate  Vulkan validation with synchronization checks, for tests; slow

    Raises ValueError, which lists the devices, if none is called so, and Error (Code.DEVICE), which says what each one
    lacks, if none is usable. Opening takes 10 to 500 ms, so open one and share it. A device may be used from any
    thread; calls on one device, its scenes and its arrays run one after another. A device does not survive fork(): use
    multiprocessing's method "spawn", or open it in the child.

    >>> with ballot.Device() as device:
    ...     scene = ballot.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], device=device)
    ...     print(scene.info.triangles)
    1
    """

    def __init__(self, name: str = "", validate: bool = False):
        _cpu_driver.provide()
        self._handle = _ballot.Device(_query.text(name, "name"), bool(validate))
        self._key = (name, bool(validate))

    @property
    def info(self) -> DeviceInfo:
        """What the device is."""
        return DeviceInfo(*self._handle.info())

    @property
    def messages(self) -> int:
        """The number of messages of the validation layers so far; 0 without `validate`."""
        return int(self._handle.message_count())

    def __repr__(self) -> str:
        if self.closed:
            return "<ballot.Device, closed>"
        try:
            return f"<ballot.Device {self.info.name!r}>"
        except Error as error:  # such as one that was opened before fork()
            return f"<ballot.Device, {error.code.name.lower()}>"

    def __reduce__(self) -> tuple[Callable[[str, bool], Device], tuple[str, bool]]:
        return opened, self._key


_lock = threading.Lock()
_default: Device | None = None
_opened: dict[tuple[str, bool], Device] = {}  # by unpickling


def _after_fork() -> None:
    global _lock, _default
    _ballot.after_fork()
    _cpu_driver.after_fork()
    _lock = threading.Lock()  # another thread of the parent may have held it
    _default = None  # the parent's, which this process cannot use
    _opened.clear()


os.register_at_fork(after_in_child=_after_fork)


def default_device() -> Device:
    """Returns the device that is used where none is named, opened on first use: the best GPU, else a CPU device.

    A child of fork() opens one of its own. Objects of its parent it cannot use.
    """
    global _default
    with _lock:
        if _default is None or _default.closed:
            _default = Device()
        return _default


def opened(name: str, validate: bool) -> Device:
    """Returns the device of this name, the same one until it is closed: what an unpickled Device is, also a scene's."""
    with _lock:
        device = _opened.get((name, validate))
        if device is None or device.closed:
            device = _opened[name, validate] = Device(name, validate)
        return device


def device_or_default(device: Device | None) -> Device:
    if device is None:
        return default_device()
    if not isinstance(device, Device):
        raise TypeError(f"device: found {type(device).__name__}; expected a ballot.Device or None")
    return device
