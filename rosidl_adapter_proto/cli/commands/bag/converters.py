"""`rosidl-proto bag converters`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from rosidl_adapter_proto.cli.options import plugin_option

if TYPE_CHECKING:
    from rosidl_adapter_proto.converters import ConverterRegistry


@click.command("converters", short_help="List formats of messages, and their plugins.")
@plugin_option
def command(registry: ConverterRegistry) -> None:
    """List the serialization formats that bags are read and written in, and which plugins do it.

    A plugin that cannot be used is listed with the reason.
    """
    rows = []
    for each in registry.plugins():
        used = {"reads": each.deserializes, "writes": each.serializes}
        directions = "broken" if each.error else ", ".join(name for name, is_used in used.items() if is_used)
        about = each.error or f"{each.plugin.reference}, {each.plugin.origin}"
        rows.append((each.serialization_format, directions, about))
    widths = [max(len(row[column]) for row in rows) for column in range(2)]
    for first, second, third in rows:
        click.echo(f"{first:{widths[0]}}  {second:{widths[1]}}  {third}")
