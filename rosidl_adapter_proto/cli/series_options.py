"""What the commands share that show time series."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rosidl_adapter_proto.cli.options import complete_topic
from rosidl_adapter_proto.cli.texts import EXIT_INCOMPLETE, progress_bar, show_bag_warnings, show_warnings
from rosidl_adapter_proto.errors import RequestError

if TYPE_CHECKING:
    from rosidl_adapter_proto.plotjuggler.series import Series

_LONGEST_TEXT = 24


def series_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options that choose series, and the file that they go to."""
    options = (
        click.option(
            "--topic",
            "topics",
            multiple=True,
            metavar="NAME",
            shell_complete=complete_topic,
            help="Only this topic, or those that fit a pattern such as '/camera/*'. May be repeated.",
        ),
        click.option(
            "--field",
            "fields",
            multiple=True,
            metavar="NAME",
            help="Only this series, such as /imu/linear_acceleration/x; or all below a name, such as "
            "/imu/linear_acceleration; or those that fit a pattern with * and ?. May be repeated.",
        ),
        click.option(
            "--array-limit",
            type=click.IntRange(0, 2**32 - 1),
            metavar="NUMBER",
            help="Leave out arrays with more elements; by default as the plugin does, which ours do beyond 500.",
        ),
        click.option(
            "--clamp", is_flag=True, help="Show the first elements of arrays with more than --array-limit."
        ),
        click.option(
            "--output",
            "-o",
            type=click.Path(),
            metavar="FILE",
            help="Write the series to a new file: .csv, .parquet, .arrow, .feather or .npz.",
        ),
    )
    for option in reversed(options):
        command = option(command)
    return command


def show_series(
    bag: str,
    plugin: str | None,
    include: tuple[Path, ...],
    distro: str | None,
    *,
    salvage: bool,
    topics: tuple[str, ...],
    fields: tuple[str, ...],
    array_limit: int | None,
    clamp: bool,
    output: str | None,
    start: int | None,
    end: int | None,
) -> int:
    """List the series of a bag, or write them, and return the exit code of the command."""
    if clamp and array_limit is None:
        raise click.UsageError("--clamp needs --array-limit: how many elements to show.")
    if output == "-":
        raise RequestError("series cannot go to the standard output; name a file")
    require_plotjuggler()
    from rosidl_adapter_proto.bags.bag import open_bag
    from rosidl_adapter_proto.plotjuggler.host import ArrayPolicy, open_plugin
    from rosidl_adapter_proto.plotjuggler.series import chosen_topics, read_series
    from rosidl_adapter_proto.plotjuggler.series_files import check_file, write_series
    from rosidl_adapter_proto.plotjuggler.series_names import SeriesNames

    if output is not None:
        check_file(output)
    opened_plugin = None if plugin is None else open_plugin(plugin)
    policy = None if array_limit is None else ArrayPolicy(clamp, array_limit)
    with open_bag(bag, include=include, distro=distro, salvage=salvage) as opened:
        chosen = chosen_topics(opened, topics, SeriesNames(fields), opened_plugin)
        with progress_bar(sum(opened.topics[name].message_count for name in chosen)) as progress:
            found = read_series(opened, chosen, fields, opened_plugin, start, end, policy, progress)
        if output is None:
            _list_series(found.series)
        else:
            write_series(found.series, output)
            click.echo(f"{output}: {len(found.series)} series")
        show_warnings(found.warnings)
        status = show_bag_warnings(opened)
    return EXIT_INCOMPLETE if found.warnings else status


def require_plotjuggler() -> None:
    """Check that what runs plugins is installed.

    Raises:
        RequestError: It is not.
    """
    try:
        import wasmtime  # noqa: F401
    except ImportError as error:
        raise RequestError(
            f"running plugins needs wasmtime ({error}): pip install 'rosidl-adapter-proto[plotjuggler]'"
        ) from None


def _list_series(series: Iterable[Series]) -> None:
    rows = [("topic", "key", "type", "count", "first", "last")]
    for each in series:
        first, last = _value_text(each.values, 0), _value_text(each.values, -1)
        rows.append((each.topic, each.key, each.type_name, str(len(each)), first, last))
    widths = [max(len(row[column]) for row in rows) for column in range(5)]
    for topic, key, kind, count, first, last in rows:
        left = f"{topic:{widths[0]}}  {key:{widths[1]}}  {kind:{widths[2]}}"
        click.echo(f"{left}  {count:>{widths[3]}}  {first:{widths[4]}}  {last}")


def _value_text(values: Sequence[Any] | Any, index: int) -> str:
    value = values[index]
    if not isinstance(value, str):
        return str(value)
    shown = value if len(value) <= _LONGEST_TEXT else f"{value[:_LONGEST_TEXT]}..."
    return json.dumps(shown, ensure_ascii=False)  # quotes, and nothing that would move the cursor
