"""What several commands print."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from rosidl_adapter_proto.bags.bag import Bag

_UNITS = ("B", "kB", "MB", "GB", "TB", "PB")


EXIT_INCOMPLETE = 1
"""The exit code of what is done with a bag if something of it was left out."""


def show_warnings(warnings: Iterable[str]) -> None:
    """Print what the user should know."""
    for warning in warnings:
        click.echo(f"Warning: {warning}", err=True)


def show_bag_warnings(bag: Bag) -> int:
    """Print what the user should know about a bag that was read, and return the exit code."""
    show_warnings(bag.warnings)
    return EXIT_INCOMPLETE if bag.is_damaged else 0


def size_text(size: float) -> str:
    """Return a number of bytes as people read it."""
    unit = 0
    while size >= 999.5 and unit < len(_UNITS) - 1:
        size /= 1000
        unit += 1
    digits = 0 if unit == 0 or size >= 99.95 else 1
    return f"{size:.{digits}f} {_UNITS[unit]}"


def time_text(seconds: float) -> str:
    """Return a duration as people read it."""
    if seconds < 59.95:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


@contextmanager
def progress_bar(length: int) -> Iterator[Callable[[int], None] | None]:
    """Show how far the work is, on a terminal; yield what to tell it."""
    if not sys.stderr.isatty():
        yield None
        return
    with click.progressbar(length=length, file=sys.stderr) as bar:
        yield bar.update
