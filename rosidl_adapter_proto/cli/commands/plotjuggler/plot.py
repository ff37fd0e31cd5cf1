"""`rosidl-proto plotjuggler plot`."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Any

import click

from rosidl_adapter_proto.cli.options import bag_source_options, time_options
from rosidl_adapter_proto.cli.series_options import require_plotjuggler
from rosidl_adapter_proto.cli.texts import EXIT_INCOMPLETE, progress_bar, show_warnings
from rosidl_adapter_proto.errors import RequestError

_HEIGHT = 20  # lines; plotext draws no more than it takes a terminal to have


@click.command("plot", short_help="Draw time series as PNG, HTML or in the terminal.")
@click.argument("bag", type=click.Path())
@click.option(
    "--field",
    "fields",
    required=True,
    multiple=True,
    metavar="TOPIC/KEY",
    help="What to draw, such as /imu/linear_acceleration/x; of a shorter one, all that is below it. May be repeated.",
)
@click.option(
    "--output", "-o", type=click.Path(), metavar="FILE", help="The picture; without it, the terminal."
)
@click.option("--title", help="What stands above the plot; by default the name of the bag.")
@time_options
@bag_source_options
def command(
    bag: str,
    fields: tuple[str, ...],
    output: str | None,
    title: str | None,
    start: int | None,
    end: int | None,
    include: tuple[Path, ...],
    distro: str | None,
) -> int:
    """Draw fields of the messages in BAG over time, all in one plot.

    The suffix of FILE says what it is: .png, or .html, a page of its own in which one can zoom, hide series and read
    values, without a network. Without FILE the plot is drawn in the terminal.

    The exit code is 1 if something is missing: topics that could not be read, messages that are not valid.
    """
    require_plotjuggler()
    from rosidl_adapter_proto.bags.bag import open_bag
    from rosidl_adapter_proto.plotjuggler.plot import read_plot
    from rosidl_adapter_proto.plotjuggler.plot_files import write_plot
    from rosidl_adapter_proto.plotjuggler.series import chosen_topics
    from rosidl_adapter_proto.plotjuggler.series_names import SeriesNames

    width = shutil.get_terminal_size().columns
    with open_bag(bag, include=include, distro=distro) as opened:
        topics = chosen_topics(opened, names=SeriesNames(fields))
        try:
            with progress_bar(sum(opened.topics[name].message_count for name in topics)) as progress:
                chosen: dict[str, Any] = {"title": title, "start": start, "end": end, "progress": progress}
                if output is None:
                    from rosidl_adapter_proto.plotjuggler.plot_terminal import terminal_plot

                    plot = read_plot(opened, fields, spans=width, **chosen)
                else:
                    plot = write_plot(opened, fields, output, **chosen)
        except ImportError as error:
            raise RequestError(str(error)) from None
        if output is None:
            click.echo(terminal_plot(plot, width, _HEIGHT, is_coloured=sys.stdout.isatty()))
        else:
            click.echo(f"{output}: {len(plot.lines)} series, {plot.value_count} values")
        show_warnings([*opened.warnings, *plot.warnings])
    return EXIT_INCOMPLETE if plot.warnings else 0
