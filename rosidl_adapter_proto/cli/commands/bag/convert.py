"""`rosidl-proto bag convert`."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Any, TextIO

import click

from rosidl_adapter_proto.cli.conversion_report import ProgressLine, show_outcome, show_outcomes, show_result
from rosidl_adapter_proto.cli.options import bag_source_options, complete_topic, plugin_option, time_options
from rosidl_adapter_proto.cli.texts import EXIT_INCOMPLETE
from rosidl_adapter_proto.errors import RequestError

if TYPE_CHECKING:
    from rosidl_adapter_proto.bags.many import BagOutcome, BagTask
    from rosidl_adapter_proto.bags.workers import Workers

EXIT_SOME_FAILED = 3


@click.command("convert")
@click.argument("places", metavar="IN... OUT", nargs=-1, required=True, type=click.Path())
@click.option(
    "--list",
    "listed",
    type=click.File(),
    metavar="FILE",
    help="Convert the bags that are named in a file too, one on each line; - is the standard input.",
)
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
    shell_complete=complete_topic,
    help="Convert this topic alone, or those that fit a pattern such as '/camera/*'. May be repeated.",
)
@click.option(
    "--exclude-topic",
    "excluded_topics",
    multiple=True,
    metavar="NAME",
    shell_complete=complete_topic,
    help="Leave out this topic, or those that fit a pattern. May be repeated.",
)
@time_options
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
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    metavar="NUMBER",
    help="How many files to convert at a time, each in a process of its own, or with --ray in a task; by default one "
    "after the other in this process, or as many tasks as the cluster has processors.",
)
@click.option(
    "--ray",
    is_flag=False,
    flag_value="",
    metavar="[ADDRESS]",
    help="Convert on a Ray cluster, each file as a task: the one at ADDRESS, or at $RAY_ADDRESS, or on this machine.",
)
@click.option(
    "--retries",
    type=click.IntRange(min=0),
    default=2,
    show_default=True,
    metavar="NUMBER",
    help="How often to try a file again after a process was killed or a connection broke.",
)
@plugin_option
@bag_source_options
def command(
    places: tuple[str, ...],
    listed: TextIO | None,
    jobs: int | None,
    ray: str | None,
    retries: int,
    **options: Any,
) -> int:
    """Convert a bag, or many, to another serialization format.

    IN is a folder that rosbag2 has recorded, a file of one, or a ROS 1 bag. OUT must not exist: it becomes such a
    folder, or a single file if its name ends in .mcap or .db3. Both may be URLs that fsspec knows, such as
    s3://bucket/drive-12.

    With several IN, a --list or a pattern such as 'bags/*', OUT is the folder that gets a bag for each, with its name.
    A bag that is there already is not converted again, so the same command goes on where another has ended.

    The exit code is 1 if OUT does not have all that it should: messages were left out or copied as they are, since they
    cannot be converted, or since IN is damaged. It is 3 if some of many bags could not be converted; they are listed at
    the end.
    """
    from rosidl_adapter_proto.bags.many import plan_bags
    from rosidl_adapter_proto.bags.places import is_pattern

    *sources, destination = places
    if not sources and not listed:
        raise click.UsageError("Missing argument 'OUT'.")
    _check_sources(sources if len(sources) > 1 else ())
    sources += filter(None, map(str.strip, listed or ()))
    many = listed or len(sources) > 1 or is_pattern(sources[0])
    tasks = plan_bags(sources, destination, options["storage"]) if many else []
    with _workers(jobs, ray, options["threads"], retries) as workers:
        if many:
            return _convert_bags(tasks, options, workers)
        return _convert_bag(sources[0], destination, options, workers)


def _check_sources(sources: Iterable[str]) -> None:
    """Refuse what is not there before anything is converted: a name behind OUT has made OUT one of the bags."""
    from rosidl_adapter_proto.bags.places import RemotePath, find_place, is_pattern

    for source in sources:
        place = find_place(source)
        if not is_pattern(source) and not isinstance(place, RemotePath) and not place.exists():
            raise RequestError(
                f"{source}: no such file or folder; the last name is OUT, and all before it must exist"
            )


def _workers(
    jobs: int | None, ray: str | None, threads: int | None, retries: int
) -> AbstractContextManager[Workers]:
    from rosidl_adapter_proto.bags.workers import Workers, processes

    if ray is not None:
        from rosidl_adapter_proto.bags.ray_workers import ray_workers

        return ray_workers(ray or None, count=jobs, threads=threads, retries=retries)
    return processes(jobs, retries=retries) if jobs and jobs > 1 else nullcontext(Workers(retries=retries))


def _convert_bag(source: str, destination: str, options: Mapping[str, Any], workers: Workers) -> int:
    from rosidl_adapter_proto.bags.convert import convert_bag

    started = time.monotonic()
    line = ProgressLine(started)
    progress = line if sys.stderr.isatty() else None
    try:
        result = convert_bag(source, destination, workers=workers, progress=progress, **options)
    finally:
        line.clear()
    show_result(destination, result, time.monotonic() - started)
    return 0 if result.is_complete else EXIT_INCOMPLETE


def _convert_bags(tasks: Sequence[BagTask], options: Mapping[str, Any], workers: Workers) -> int:
    from rosidl_adapter_proto.bags.convert import settings_of
    from rosidl_adapter_proto.bags.many import convert_bags

    started = time.monotonic()
    line = ProgressLine(started)
    progress = line.show_bags if sys.stderr.isatty() else None

    def finished(outcome: BagOutcome) -> None:
        line.clear()
        show_outcome(outcome)

    try:
        outcomes = convert_bags(
            tasks, settings_of(**options), workers=workers, progress=progress, finished=finished
        )
    finally:
        line.clear()
    show_outcomes(outcomes, time.monotonic() - started)
    if any(outcome.error for outcome in outcomes):
        return EXIT_SOME_FAILED
    return EXIT_INCOMPLETE if any(outcome.is_incomplete for outcome in outcomes) else 0
