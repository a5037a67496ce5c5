"""What shows the progress of a call."""

from __future__ import annotations

import warnings
from importlib import import_module
from typing import Any, Callable, Optional

from turncal._turncal import Error

Shown = Callable[[int, Optional[int]], Any]


class Bar:
    """A bar of tqdm."""

    def __init__(self, bars: Any) -> None:
        self._bar = bars(unit=" steps", leave=False)

    def __call__(self, done: int, total: int | None) -> None:
        self._bar.total = total
        self._bar.update(done - self._bar.n)

    def close(self) -> None:
        self._bar.close()


def shown(progress: bool | Shown) -> Shown | None:
    """The callable for a `progress` argument; None shows nothing."""
    if callable(progress):
        return progress
    if not isinstance(progress, bool):
        raise Error(f"progress: found {progress!r}, expected True, False or a function of two arguments")
    if not progress:
        return None
    try:
        with warnings.catch_warnings():
            # Of a notebook without widgets, where the bar is text.
            warnings.simplefilter("ignore")
            bars = import_module("tqdm.auto").tqdm
    except ImportError:
        return None
    return Bar(bars)
