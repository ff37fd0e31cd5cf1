"""`rosidl-proto bag table`."""

from __future__ import annotations

from pathlib import Path

import click

from rosidl_adapter_proto.errors import RequestError


@click.command("table")
@click.argument("bag", type=click.Path(path_type=Path))
@click.argument("topic")
@click.option(
    "--output",
    "-o",
    required=True,
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="The file to write.",
)
@click.option(
    "--format",
    "file_format",
    type=click.Choice(["parquet", "arrow", "csv"]),
    help="What to write, if the suffix of the file does not say.",
)
@click.option(
    "--fields", metavar="NAMES", help="Only these fields, such as header.stamp,linear_acceleration."
)
def command(bag: Path, topic: str, output: Path, file_format: str | None, fields: str | None) -> None:
    """Write the messages of one TOPIC of BAG as a table: Parquet, Arrow (.arrow, .feather) or CSV.

    Nested messages and lists stay what they are; in CSV, fields of nested messages are columns, and lists are JSON.
    """
    try:
        from rosidl_adapter_proto.bags.table import write_table
    except ImportError as error:
        raise RequestError(str(error)) from None
    chosen = None if fields is None else [each.strip() for each in fields.split(",")]
    rows = write_table(bag, topic, output, file_format=file_format, fields=chosen)
    click.echo(f"{output}: {rows} rows")
