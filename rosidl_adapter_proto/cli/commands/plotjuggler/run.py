"""`rosidl-proto plotjuggler run`."""

from __future__ import annotations

from pathlib import Path

import click

from rosidl_adapter_proto.cli.options import bag_source_options, salvage_option, time_options
from rosidl_adapter_proto.cli.series_options import series_options, show_series


@click.command("run", short_help="Run a parser plugin over the messages of a bag.")
@click.argument("plugin", type=click.Path())
@click.argument("bag", type=click.Path())
@series_options
@time_options
@salvage_option
@bag_source_options
def command(plugin: str, bag: str, include: tuple[Path, ...], distro: str | None, **options: object) -> int:
    """Run PLUGIN, a .wasm file, over the messages of BAG that have its encoding, and show the time series.

    Without --output they are listed: topic and key, type, how many values there are, the first and the last of them.

    The exit code is 1 if something is missing: topics that could not be read, messages that are not valid.
    """
    return show_series(bag, plugin, include, distro, **options)  # type: ignore[arg-type]
