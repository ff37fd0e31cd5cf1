"""How far the work of a command is, on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click


@contextmanager
def progress_bar(length: int) -> Iterator[Callable[[int], None] | None]:
    """Show how far the work is, on a terminal; yield what to tell it."""
    if not sys.stderr.isatty():
        yield None
        return
    with click.progressbar(length=length, file=sys.stderr) as bar:
        yield bar.update
