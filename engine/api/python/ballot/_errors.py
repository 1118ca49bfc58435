"""The exceptions of ballot. Wrong values raise ValueError, wrong types TypeError; everything else is ballot.Error."""

import enum


class Code(enum.IntEnum):
    """The kind of a failure, Error.code."""

    WORK = 1  # a file, the driver or the device failed
    ARGUMENT = 2  # raised as ValueError
    DEVICE = 3  # there is no usable Vulkan device
    MEMORY = 4  # the host ran out of memory
    CLOSED = 5  # the object was closed
    FORKED = 6  # the object was made before fork()
    INTERRUPTED = 7  # the progress function returned False


class Error(RuntimeError):
    """A failure of the device, the driver, a file or of the state of an object.

    str(error) is one line that says what failed, where, what was found, what was expected and what to do. error.code is
    a Code.
    """

    def __init__(self, text: str, code: int = Code.WORK):
        super().__init__(text)
        self.code = Code(code)

    def __reduce__(self):
        return Error, (str(self), int(self.code))
