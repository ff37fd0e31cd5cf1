"""`rosidl-proto lock drop`."""

from __future__ import annotations

from pathlib import Path

import click

from rosidl_adapter_proto.cli.options import setting_option
from rosidl_adapter_proto.generate import Options
from rosidl_adapter_proto.generate.lock import drop
from rosidl_adapter_proto.schema.numbering import SequentialNumbering


@click.group("lock")
def command() -> None:
    """Change the lock file, which keeps sequential numbers."""


@command.command("drop")
@click.argument("names", nargs=-1, required=True, metavar="NAME...")
@setting_option("lock-file")
def drop_command(names: tuple[str, ...], lock_file: Path) -> None:
    """Forget numbers that were never released.

    NAME is a field, as it is or was (my_msgs/msg/Track.id), or a message (my_msgs/msg/Track). Its
    entry is gone: the name gets the number after the highest one, and may have another type. A folder generated before
    needs --renumber once.
    """
    options = Options(numbering=SequentialNumbering.name, lock_file=lock_file)
    for name, number in drop(options, names).items():
        click.echo(f"dropped {name}, which had number {number}")
    click.echo("a folder generated before needs --renumber once")
