"""`rosidl-proto list`."""

from __future__ import annotations

from pathlib import Path

import click

from rosidl_adapter_proto.cli.options import complete_name, source_options
from rosidl_adapter_proto.generate.request import find_sources


@click.command("list")
@click.argument("package", required=False, shell_complete=complete_name)
@source_options
def list_command(package: str | None, include: tuple[Path, ...], distro: str | None) -> None:
    """List the packages that are found and where, or the interfaces of one PACKAGE."""
    sources = find_sources(include, distro)
    if package is None:
        rows = [
            (name, str(len(found)), next(iter(found.values())).origin)
            for name, found in sorted(sources.packages.items())
        ]
    else:
        rows = [
            (str(name), definition.format, definition.file)
            for name, definition in sources.package(package).items()
        ]
    widths = [max(len(row[column]) for row in rows) for column in range(2)]
    for first, second, third in rows:
        click.echo(f"{first:{widths[0]}}  {second:{widths[1]}}  {third}")
