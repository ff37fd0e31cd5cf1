"""`rosidl-proto show`."""

from __future__ import annotations

from itertools import zip_longest
from pathlib import Path

import click

from rosidl_adapter_proto.cli.options import complete_name, generate_options, source_options
from rosidl_adapter_proto.generate import Options, proto_text
from rosidl_adapter_proto.generate.request import find_catalog
from rosidl_adapter_proto.generate.settings import OPTIONS


@click.command("show")
@click.argument("type_name", metavar="TYPE", shell_complete=complete_name)
@generate_options(each for each in OPTIONS if each.is_for_schema)
@source_options
def command(type_name: str, options: Options, include: tuple[Path, ...], distro: str | None) -> None:
    """Show the definition of TYPE (std_msgs/msg/String) and the .proto made of it, side by side."""
    if "/" not in type_name:
        raise click.UsageError(f"{type_name!r} is not the name of a type, such as std_msgs/msg/String")
    catalog = find_catalog(include, distro)
    name = catalog.type_name(type_name)
    definition = catalog.definition(name)
    proto = proto_text(definition.name, catalog, options)
    click.echo(f"{name} from {definition.file}")
    click.echo(f"type hash {catalog.hash(name)}\n")
    left = definition.text.expandtabs(4).splitlines()
    right = proto.splitlines()
    width = max((len(line) for line in left), default=0)
    for definition_line, proto_line in zip_longest(left, right, fillvalue=""):
        click.echo(f"{definition_line:{width}}  |  {proto_line}".rstrip())
