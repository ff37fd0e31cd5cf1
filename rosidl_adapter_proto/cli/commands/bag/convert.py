"""`rosidl-proto bag convert`."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rosidl_adapter_proto.cli.options import parse_time, plugin_option, source_options

if TYPE_CHECKING:
    from rosidl_adapter_proto.bags.conversion import ConversionResult, Progress

EXIT_INCOMPLETE = 1
_REDRAWN_AFTER = 0.1  # seconds
_UNITS = ("B", "kB", "MB", "GB", "TB")


@click.command("convert")
@click.argument("source", metavar="IN", type=click.Path(path_type=Path))
@click.argument("destination", metavar="OUT", type=click.Path(path_type=Path))
@click.option(
    "--input-serialization-format",
    "--from",
    "source_format",
    metavar="FORMAT",
    help="How the messages are serialized, whatever the bag says; by default what it says.",
)
@click.option(
    "--output-serialization-format",
    "--to",
    "target_format",
    metavar="FORMAT",
    help="What to convert to; by default protobuf, and cdr if the messages are protobuf.",
)
@click.option(
    "--storage", type=click.Choice(["mcap", "sqlite3"]), help="The storage of OUT; by default that of IN."
)
@click.option(
    "--compression",
    type=click.Choice(["none", "zstd", "lz4"]),
    help="How chunks of mcap are compressed; by default as in IN.",
)
@click.option(
    "--topic",
    "topics",
    multiple=True,
    metavar="NAME",
    help="Convert this topic alone, or those that fit a pattern such as '/camera/*'. May be repeated.",
)
@click.option(
    "--exclude-topic",
    "excluded_topics",
    multiple=True,
    metavar="NAME",
    help="Leave out this topic, or those that fit a pattern. May be repeated.",
)
@click.option(
    "--start",
    type=parse_time,
    default="0",
    metavar="TIME",
    help="Convert only what was recorded at this time or later.",
)
@click.option(
    "--end", type=parse_time, metavar="TIME", help="Convert only what was recorded before this time."
)
@click.option(
    "--on-error",
    type=click.Choice(["stop", "skip", "copy"]),
    default="stop",
    show_default=True,
    help="What becomes of messages that cannot be converted: end there, leave them out, or copy them as they are. "
    "Unless it is stop, whatever can be read of a damaged file is converted.",
)
@click.option(
    "--threads",
    type=click.IntRange(min=1),
    metavar="NUMBER",
    help="On how many threads to convert; by default one for each processor.",
)
@plugin_option
@source_options
def command(source: Path, destination: Path, **settings: Any) -> int:
    """Convert a bag to another serialization format.

    IN is a folder that rosbag2 has recorded, a file of one, or a ROS 1 bag. OUT must not exist: it becomes such a
    folder, or a single file if its name ends in .mcap or .db3. Times are in ISO 8601 with a time zone, such as
    2026-05-01T12:00:00Z, or in nanoseconds since 1970.

    The exit code is 1 if OUT does not have all that it should: messages were left out or copied as they are, since they
    cannot be converted, or since IN is damaged.
    """
    from rosidl_adapter_proto.bags.convert import convert_bag

    started = time.monotonic()
    progress = _ProgressLine(started) if sys.stderr.isatty() else None
    try:
        result = convert_bag(source, destination, progress=progress, **settings)
    finally:
        if progress:
            progress.clear()
    for warning in result.warnings:
        click.echo(f"Warning: {warning}", err=True)
    _show_failures(result)
    click.echo(_summary(result, destination, time.monotonic() - started))
    return 0 if result.is_complete else EXIT_INCOMPLETE


class _ProgressLine:
    """One line on the terminal, with the rate and the time that is left."""

    def __init__(self, started: float) -> None:
        self._started = started
        self._drawn = 0.0

    def __call__(self, progress: Progress) -> None:
        now = time.monotonic()
        if now - self._drawn < _REDRAWN_AFTER:
            return
        self._drawn = now
        share = progress.done / progress.total if progress.total else 1.0
        elapsed = now - self._started
        left = elapsed / share - elapsed if share else 0.0
        click.echo(
            f"\r{share:4.0%}  {progress.message_count} messages, {size_text(progress.done / elapsed)}/s, "
            f"{time_text(left)} left\x1b[K",
            nl=False,
            err=True,
        )

    def clear(self) -> None:
        """Take the line away."""
        if self._drawn:
            click.echo("\r\x1b[K", nl=False, err=True)


def _show_failures(result: ConversionResult) -> None:
    for failure in result.failures:
        click.echo(f"Cannot convert {failure}", err=True)
    more = result.failed_count - len(result.failures)
    if more > 0:
        click.echo(f"Cannot convert {more} more messages", err=True)


def _summary(result: ConversionResult, destination: Path, seconds: float) -> str:
    total = result.total
    counts = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in vars(total).items() if count)
    rate = size_text(result.source_size / seconds)
    return (
        f"{destination}: {counts or '0 converted'}; {size_text(result.source_size)} became "
        f"{size_text(result.size)}, in {time_text(seconds)} ({rate}/s)"
    )


def size_text(size: float) -> str:
    """Return a number of bytes as people read it."""
    unit = 0
    while size >= 1000 and unit < len(_UNITS) - 1:
        size /= 1000
        unit += 1
    return f"{size:.0f} {_UNITS[unit]}" if unit == 0 or size >= 100 else f"{size:.1f} {_UNITS[unit]}"


def time_text(seconds: float) -> str:
    """Return a duration as people read it."""
    if seconds < 60:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
