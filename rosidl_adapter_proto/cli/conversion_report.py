"""What `rosidl-proto bag convert` prints: how far it is, and what became of bags."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from rosidl_adapter_proto.cli.texts import show_warnings, size_text, time_text

if TYPE_CHECKING:
    from rosidl_adapter_proto.bags.conversion import ConversionResult, Progress
    from rosidl_adapter_proto.bags.many import BagOutcome, BagsProgress

_REDRAWN_AFTER = 0.1  # seconds


class ProgressLine:
    """One line on the terminal, with the rate and the time that is left."""

    def __init__(self, started: float) -> None:
        self._started = started
        self._drawn = 0.0

    def __call__(self, progress: Progress) -> None:
        """Draw how far a bag is."""
        share = progress.done / progress.total if progress.total else 1.0
        self._draw(f"{share:4.0%}", share, progress)

    def show_bags(self, progress: BagsProgress) -> None:
        """Draw how far many bags are; how large those are that nobody has opened is not known."""
        share = progress.bags_done / progress.bags
        self._draw(f"{progress.bags_done} of {progress.bags} bags", share, progress)

    def _draw(self, head: str, share: float, progress: Progress | BagsProgress) -> None:
        now = time.monotonic()
        if now - self._drawn < _REDRAWN_AFTER:
            return
        self._drawn = now
        elapsed = now - self._started
        left = f", {time_text(elapsed / share - elapsed)} left" if share else ""
        text = f"{head}  {progress.message_count} messages, {size_text(progress.done / elapsed)}/s{left}"
        click.echo(f"\r{text}\x1b[K", nl=False, err=True)

    def clear(self) -> None:
        """Take the line away."""
        if self._drawn:
            self._drawn = 0.0
            click.echo("\r\x1b[K", nl=False, err=True)


def show_result(destination: str, result: ConversionResult, seconds: float | None = None) -> None:
    """Print what became of a bag, and what is odd about it."""
    show_warnings(result.warnings)
    _show_failures(result)
    click.echo(_summary(result, destination, seconds))


def show_outcome(outcome: BagOutcome) -> None:
    """Print what became of one of many bags."""
    if outcome.result:
        show_result(outcome.destination, outcome.result)
    elif outcome.was_there:
        click.echo(f"{outcome.destination}: was there already")
    else:
        click.echo(f"Failed: {outcome.source}", err=True)


def show_outcomes(outcomes: Sequence[BagOutcome], seconds: float) -> None:
    """Print what became of many bags, and at the end again which ones failed, and why."""
    results = [outcome.result for outcome in outcomes if outcome.result]
    failed = [outcome for outcome in outcomes if outcome.error]
    incomplete = sum(outcome.is_incomplete for outcome in outcomes)
    counts = {
        "converted": len(results) - incomplete,
        "incomplete": incomplete,
        "already there": sum(outcome.was_there for outcome in outcomes),
        "failed": len(failed),
    }
    size = sum(result.source_size for result in results)
    texts = ", ".join(f"{count} {name}" for name, count in counts.items() if count)
    bags = "1 bag" if len(outcomes) == 1 else f"{len(outcomes)} bags"
    click.echo(f"{bags}: {texts}; in {time_text(seconds)} ({size_text(size / seconds)}/s)")
    for outcome in failed:
        where = "" if outcome.source in outcome.error else f"{outcome.source}: "
        click.echo(f"Failed: {where}{outcome.error}", err=True)


def _show_failures(result: ConversionResult) -> None:
    for failure in result.failures:
        click.echo(f"Cannot convert {failure}", err=True)
    more = result.failed_count - len(result.failures)
    if more > 0:
        count = f"{more} more" if result.failures else more
        click.echo(f"Cannot convert {count} message{'' if more == 1 else 's'}", err=True)


def _summary(result: ConversionResult, destination: str, seconds: float | None) -> str:
    total = result.total
    counts = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in vars(total).items() if count)
    sizes = f"{size_text(result.source_size)} became {size_text(result.size)}"
    rate = (
        "" if seconds is None else f", in {time_text(seconds)} ({size_text(result.source_size / seconds)}/s)"
    )
    return f"{destination}: {counts or '0 converted'}; {sizes}{rate}"
