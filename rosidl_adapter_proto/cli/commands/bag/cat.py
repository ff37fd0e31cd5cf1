"""`rosidl-proto bag cat`."""

from __future__ import annotations

from itertools import chain, islice
from pathlib import Path

import click

from rosidl_adapter_proto.cli.options import (
    bag_source_options,
    complete_topic,
    fields_option,
    salvage_option,
    time_options,
)
from rosidl_adapter_proto.cli.texts import show_bag_warnings, show_warnings


@click.command("cat", short_help="Print messages as JSON, one on each line.")
@click.argument("bag", type=click.Path())
@click.argument("topics", nargs=-1, required=True, metavar="TOPIC...", shell_complete=complete_topic)
@fields_option
@time_options
@click.option("--limit", type=click.IntRange(min=0), help="Print so many messages at most.")
@salvage_option
@bag_source_options
def command(
    bag: str,
    topics: tuple[str, ...],
    fields: list[str] | None,
    start: int | None,
    end: int | None,
    limit: int | None,
    include: tuple[Path, ...],
    distro: str | None,
    salvage: bool,
) -> int:
    """Print the messages of topics in BAG as JSON, one on each line, in the order in which they were recorded.

    TOPIC is a name, or a pattern such as '/camera/*'.
    """
    from rosidl_adapter_proto.bags.bag import open_bag
    from rosidl_adapter_proto.bags.message_json import chosen_fields, message_json
    from rosidl_adapter_proto.bags.topic_names import is_named

    chosen = chosen_fields(fields or ())
    with open_bag(bag, include=include, distro=distro, salvage=salvage) as opened:
        named = ([name for name in opened.topics if is_named(name, [topic])] or [topic] for topic in topics)
        messages = opened.messages(chain.from_iterable(named), start=start, end=end, fields=fields)
        printed = False
        for recorded in islice(messages, limit):
            printed = True
            click.echo(message_json(recorded, chosen))
        if not printed and limit != 0:
            show_warnings(["there are no messages of these topics and times"])
        return show_bag_warnings(opened)
