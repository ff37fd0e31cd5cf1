"""`rosidl-proto bag table`."""

from __future__ import annotations

from pathlib import Path

import click

from rosidl_adapter_proto.cli.options import (
    bag_source_options,
    complete_topic,
    fields_option,
    salvage_option,
    time_options,
)
from rosidl_adapter_proto.cli.texts import progress_bar, show_bag_warnings
from rosidl_adapter_proto.errors import RequestError


@click.command("table", short_help="Write a topic as Parquet, Arrow or CSV.")
@click.argument("bag", type=click.Path())
@click.argument("topic", shell_complete=complete_topic)
@click.option("--output", "-o", required=True, type=click.Path(), metavar="FILE", help="The table.")
@click.option(
    "--format",
    "file_format",
    type=click.Choice(["parquet", "arrow", "csv"]),
    help="What to write, where the suffix of FILE does not say.",
)
@fields_option
@time_options
@salvage_option
@bag_source_options
def command(
    bag: str,
    topic: str,
    output: str,
    file_format: str | None,
    fields: list[str] | None,
    start: int | None,
    end: int | None,
    include: tuple[Path, ...],
    distro: str | None,
    salvage: bool,
) -> int:
    """Write the messages of a TOPIC in BAG as a table, with a row for each and its fields as columns.

    The suffix of FILE says what is written: .parquet, .arrow or .feather, or .csv. Nested messages and lists stay what
    they are; in CSV, each field of a nested message is a column, and a list is JSON.
    """
    from rosidl_adapter_proto.bags.bag import open_bag

    try:
        from rosidl_adapter_proto.bags.table import write_table
    except ImportError as error:
        raise RequestError(str(error)) from None
    if output == "-":
        raise RequestError("a table cannot go to the standard output; name a file")
    with open_bag(bag, include=include, distro=distro, salvage=salvage) as opened:
        found = opened.topics.get(topic)
        with progress_bar(found.message_count if found else 0) as progress:
            rows = write_table(
                opened,
                topic,
                output,
                file_format=file_format,
                fields=fields,
                start=start,
                end=end,
                progress=progress,
            )
        status = show_bag_warnings(opened)
    click.echo(f"{output}: {rows} rows")
    return status
