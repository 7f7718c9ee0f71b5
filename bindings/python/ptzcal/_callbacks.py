"""Python functions that the library calls.

An exception cannot travel through the library: it is kept, the library is told by a status, and
when its call ends the exception goes on from there. A device's failure (ptzcal.Error, OSError,
NotImplementedError) is the library's to handle, which may well succeed at the next try. Anything
else, such as a bug or Ctrl-C, ends the call: from then on only stopping the head and switching the
laser off still reach the host.
"""

from __future__ import annotations

import contextlib
import math
import signal
import threading
from ctypes import byref, c_void_p
from typing import Any, Callable, Iterator, List, Optional

from . import _structs, images
from ._native import taken_error
from .errors import Error, Status


class _Call:
    """A call of the library that may call back."""

    def __init__(self) -> None:
        self.fatal: Optional[BaseException] = None
        self.device: Optional[BaseException] = None
        self.depth = 0  # functions of the host that are running


_thread = threading.local()


def _device_status(exception: BaseException) -> Optional[int]:
    if isinstance(exception, Error):
        return exception.status or Status.DEVICE
    if isinstance(exception, TimeoutError):
        return Status.DEVICE_TIMEOUT
    if isinstance(exception, ConnectionError):
        return Status.DEVICE_LOST
    if isinstance(exception, NotImplementedError):
        return Status.UNSUPPORTED
    if isinstance(exception, OSError):
        return Status.DEVICE
    return None


def device(
    function: Callable[..., Any], always: Callable[..., bool] = lambda *_: False
) -> Callable[..., int]:
    """A device's function, made fit to be called by the library: it returns a status.

    After an exception that ends the call it runs only if `always(*arguments)`.
    """

    def callback(_user: Any, *arguments: Any) -> int:
        current = _thread.calls[-1]
        if current.fatal is not None and not always(*arguments):
            return Status.DEVICE
        try:
            _run(current, function, arguments)
            return Status.OK
        except BaseException as exception:
            status = _device_status(exception)
            if status is None:
                current.fatal = current.fatal or exception
                return Status.DEVICE
            current.device = exception
            return status

    return callback


def listener(function: Callable[..., Any], otherwise: Any = None) -> Callable[..., Any]:
    """Any other function, made fit likewise. Every exception ends the call.

    The library gets what it returns, and `otherwise` when that is not to be had.
    """

    def callback(_user: Any, *arguments: Any) -> Any:
        current = _thread.calls[-1]
        if current.fatal is not None:
            return otherwise
        try:
            return _run(current, function, arguments)
        except BaseException as exception:
            current.fatal = exception
            return otherwise

    return callback


def frames(source: Callable[..., Any]) -> Any:
    """A source of frames as the library calls it."""

    def next_frame(not_before: float, timeout: float, image: Any, timestamp: Any) -> None:
        frame = source(not_before, timeout)
        seconds, format = math.nan, None
        if isinstance(frame, tuple):
            frame, seconds, *rest = frame
            format = rest[0] if rest else None
        view = images.view(frame, format, "the frame")
        images.fill(image[0], view)
        timestamp[0] = math.nan if seconds is None else seconds
        # The library copies the pixels after this returns.
        next_frame.pixels = view  # type: ignore[attr-defined]

    return _structs.ptzcal_frame_fn(device(next_frame))


def _run(current: _Call, function: Callable[..., Any], arguments: tuple) -> Any:
    current.depth += 1
    try:
        return function(*arguments)
    finally:
        current.depth -= 1


def call(function: Any, *arguments: Any) -> Optional[BaseException]:
    """As _native.call, for functions that may call back.

    Returns the last failure of a device, which did not keep the call from succeeding.
    """
    calls: List[_Call] = _thread.__dict__.setdefault("calls", [])
    current = _Call()
    failure = c_void_p()
    calls.append(current)
    try:
        with _interrupts():
            status = function(*arguments, byref(failure))
    finally:
        calls.pop()
    error = taken_error(status, failure) if status else None
    if current.fatal is not None:
        raise current.fatal
    if error is not None:
        raise error from current.device
    return current.device


@contextlib.contextmanager
def _interrupts() -> Iterator[None]:
    """Ctrl-C ends the call instead of being lost.

    Python handles signals when a callback begins, before the callback's own `try`: an exception
    raised there would only be printed by ctypes. So it is raised in the host's functions only, and
    otherwise kept for the end of the call.
    """
    if (
        threading.current_thread() is not threading.main_thread()
        or signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    ):
        yield
        return
    signal.signal(signal.SIGINT, _interrupted)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _interrupted(number: int, frame: Any) -> None:
    calls = _thread.calls
    if not calls:
        signal.default_int_handler(number, frame)
    current = calls[-1]
    if current.depth:
        signal.default_int_handler(number, frame)
    current.fatal = current.fatal or KeyboardInterrupt()


def reporter(progress: Optional[Callable[[int, int], Any]]) -> Any:
    """progress(done, total) for the library; a true result stops the work."""

    def heard(report: Any) -> int:
        return bool(progress and progress(report[0].done, report[0].total))

    return _structs.ptzcal_progress_fn(listener(heard, otherwise=1))
