"""How long calls take, in turns, so that whatever else the machine does meets all of them."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path


def seconds(*calls: Callable[[], object], folder: Path | None = None, turns: int = 5) -> list[float]:
    """Return the time that each call takes; what it writes to a folder is removed before the next."""
    best = [float("inf")] * len(calls)
    for _ in range(turns):
        for index, call in enumerate(calls):
            start = time.perf_counter()
            call()
            best[index] = min(best[index], time.perf_counter() - start)
            for written in folder.iterdir() if folder else ():
                written.unlink()
    return best
