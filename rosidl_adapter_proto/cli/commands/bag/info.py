"""`rosidl-proto bag info`."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rosidl_adapter_proto.cli.options import bag_source_options, salvage_option
from rosidl_adapter_proto.cli.texts import EXIT_INCOMPLETE, show_warnings, size_text
from rosidl_adapter_proto.time import to_datetime

if TYPE_CHECKING:
    from rosidl_adapter_proto.bags.information import BagInformation


@click.command("info", short_help="Tell what is in a bag.")
@click.argument("bag", type=click.Path())
@click.option("--json", "as_json", is_flag=True, help="Print it as JSON, for other programs.")
@salvage_option
@bag_source_options
def command(bag: str, as_json: bool, include: tuple[Path, ...], distro: str | None, salvage: bool) -> int:
    """Tell what is in BAG: files, times, topics with their types and counts, and what is odd about it."""
    from rosidl_adapter_proto.bags.bag import open_bag
    from rosidl_adapter_proto.bags.information import bag_information

    with open_bag(bag, include=include, distro=distro, salvage=salvage) as opened:
        information = bag_information(opened)
    if as_json:
        click.echo(json.dumps(asdict(information), indent=2))
    else:
        _print(information)
    return EXIT_INCOMPLETE if opened.is_damaged else 0


def _print(information: BagInformation) -> None:
    duration = information.end_time - information.start_time
    rows = [
        *(("" if index else "files:", file) for index, file in enumerate(information.files)),
        ("storage:", ", ".join([*information.storage, *information.compression])),
        ("size:", size_text(information.size)),
        ("messages:", str(information.message_count)),
    ]
    if information.message_count:
        rows += [
            ("duration:", f"{duration // 10**9}.{duration % 10**9:09} s"),
            ("start:", f"{_date(information.start_time)} ({information.start_time})"),
            ("end:", f"{_date(information.end_time)} ({information.end_time})"),
        ]
    for name, value in rows:
        click.echo(f"{name:10} {value}")
    head = ("topic", "type", "format", "messages", "rate", "types from")
    table = [
        (
            each.name,
            each.type_name,
            each.serialization_format,
            str(each.message_count),
            _rate(each.message_count, duration),
            each.types_from,
        )
        for each in information.topics
    ]
    widths = [max(len(row[column]) for row in [head, *table]) for column in range(len(head) - 1)]
    click.echo()
    for topic, kind, format_name, count, rate, origin in [head, *table]:
        left = f"{topic:{widths[0]}}  {kind:{widths[1]}}  {format_name:{widths[2]}}"
        click.echo(f"{left}  {count:>{widths[3]}}  {rate:>{widths[4]}}  {origin}")
    show_warnings(information.warnings)


def _rate(count: int, duration: int) -> str:
    rate = count / duration * 1e9 if duration else 0.0
    if not rate:
        return ""
    return f"{rate:.3g} Hz" if rate < 999.5 else f"{rate:.0f} Hz"


def _date(nanoseconds: int) -> str:
    return f"{to_datetime(nanoseconds):%Y-%m-%dT%H:%M:%S}.{nanoseconds % 10**9:09}Z"
