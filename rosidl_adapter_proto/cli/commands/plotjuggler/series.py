"""`rosidl-proto plotjuggler series`."""

from __future__ import annotations

from pathlib import Path

import click

from rosidl_adapter_proto.cli.options import bag_source_options, salvage_option, time_options
from rosidl_adapter_proto.cli.series_options import series_options, show_series


@click.command("series", short_help="List the time series of a bag, or write them to a file.")
@click.argument("bag", type=click.Path())
@series_options
@time_options
@salvage_option
@bag_source_options
def command(bag: str, include: tuple[Path, ...], distro: str | None, **options: object) -> int:
    """Show the time series that PlotJuggler has of BAG, with our parser plugins: protobuf, CDR and ROS 1.

    Without --output they are listed: topic and key, type, how many values there are, the first and the last of them.

    The exit code is 1 if something is missing: topics that could not be read, messages that are not valid.
    """
    return show_series(bag, None, include, distro, **options)  # type: ignore[arg-type]
