"""The options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from rosidl_adapter_proto.errors import Error
from rosidl_adapter_proto.generate.configuration import NUMBERINGS
from rosidl_adapter_proto.generate.request import find_catalog
from rosidl_adapter_proto.interfaces import store
from rosidl_adapter_proto.schema.numbering import LOCK_FILE_NAME, HashNumbering

Command = TypeVar("Command", bound=Callable[..., Any])


def complete_distro(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Return the distributions that begin with what was typed."""
    return [name for name in store.distributions() if name.startswith(incomplete)]


def complete_name(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Return the packages, or behind a slash the types of one, that begin with what was typed."""
    try:
        catalog = find_catalog(context.params.get("include") or (), context.params.get("distro"))
    except Error:
        return []
    package, slash, _ = incomplete.partition("/")
    names = map(str, catalog.packages.get(package, ())) if slash else catalog.packages
    return sorted(name for name in names if name.startswith(incomplete))


def source_options(command: Command) -> Command:
    """Add the options that say where definitions come from."""
    command = click.option(
        "--distro",
        metavar="NAME",
        shell_complete=complete_distro,
        help="The ROS distribution whose embedded definitions stand in for packages found nowhere else "
        "(default: $ROS_DISTRO, else the newest).",
    )(command)
    return click.option(
        "--include",
        "-I",
        type=click.Path(path_type=Path),
        multiple=True,
        help="A package folder, or a folder of packages, to find definitions in. May be repeated.",
    )(command)


def schema_options(command: Command) -> Command:
    """Add the options that say how the `.proto` files are made."""
    command = click.option(
        "--events/--no-events",
        default=False,
        help="Include the _Event messages of service introspection.",
    )(command)
    command = click.option(
        "--lock-file",
        type=click.Path(path_type=Path),
        default=Path(LOCK_FILE_NAME),
        show_default=True,
        help="Where sequential numbers are kept; commit it.",
    )(command)
    return click.option(
        "--numbering",
        type=click.Choice(NUMBERINGS),
        default=HashNumbering.name,
        show_default=True,
        help="How fields are numbered: from a hash of their names, or in sequence with a lock file.",
    )(command)
