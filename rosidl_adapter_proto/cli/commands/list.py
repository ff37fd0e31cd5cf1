"""`rosidl-proto list`."""

from __future__ import annotations

from pathlib import Path

import click

from rosidl_adapter_proto.cli.options import complete_name, source_options
from rosidl_adapter_proto.generate.request import find_catalog
from rosidl_adapter_proto.generate.targets.index import installed_packages
from rosidl_adapter_proto.interfaces.find import prefixes


@click.command("list")
@click.argument("package", required=False, shell_complete=complete_name)
@source_options
def command(package: str | None, include: tuple[Path, ...], distro: str | None) -> None:
    """List the packages that are found and where, or the interfaces of one PACKAGE.

    A package whose protobuf types and adapters are installed is listed with their place, too.
    """
    catalog = find_catalog(include, distro)
    if package is None:
        installed = installed_packages(prefixes())
        rows = []
        for name in sorted({*catalog.packages, *installed}):
            found = catalog.packages.get(name, {})
            places = [next(iter(found.values())).origin if found else "no definitions"]
            if name in installed:
                number = installed[name].generated.interfaces
                places.append(f"{number} with adapters in {installed[name].prefix}")
            rows.append((name, str(len(found)), ", ".join(places)))
    else:
        rows = [
            (
                str(name),
                definition.format,
                " and ".join(filter(None, (definition.other_file, definition.file))),
            )
            for name, definition in catalog.package(package).items()
        ]
    widths = [max(len(row[column]) for row in rows) for column in range(2)]
    for first, second, third in rows:
        click.echo(f"{first:{widths[0]}}  {second:{widths[1]}}  {third}")
