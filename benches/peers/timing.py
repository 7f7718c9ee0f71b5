"""Times two functions alternately, so that a spell of load hits both alike."""

import gc
import statistics
import time
from dataclasses import dataclass
from typing import Any, Callable, Optional

#: Seconds that one block of calls is to take: far more than the clock's resolution.
BLOCK = 0.004


@dataclass
class Times:
    """Milliseconds of one call."""

    least: float
    median: float


class _Side:
    def __init__(self, function: Callable[[], Any]) -> None:
        self.function = function
        self.blocks = []
        function()
        began = time.perf_counter()
        function()
        once = time.perf_counter() - began
        self.calls = max(1, round(BLOCK / once)) if once > 0 else 1000

    def run(self) -> None:
        function, calls = self.function, self.calls
        began = time.perf_counter()
        for _ in range(calls):
            function()
        self.blocks.append((time.perf_counter() - began) / calls * 1e3)

    def times(self) -> Times:
        return Times(min(self.blocks), statistics.median(self.blocks))


def alternately(
    ours: Callable[[], Any], peer: Optional[Callable[[], Any]], budget: float, least_blocks: int = 5
) -> tuple:
    """The times of both, from blocks of calls in turn, for `budget` seconds or a few blocks."""
    sides = [_Side(ours)] + ([_Side(peer)] if peer is not None else [])
    collecting = gc.isenabled()
    gc.disable()
    try:
        end = time.perf_counter() + budget
        rounds = 0
        while rounds < least_blocks or time.perf_counter() < end:
            for side in sides if rounds % 2 == 0 else sides[::-1]:
                side.run()
            rounds += 1
    finally:
        if collecting:
            gc.enable()
    times = [side.times() for side in sides]
    return (*times, None) if peer is None else tuple(times)
