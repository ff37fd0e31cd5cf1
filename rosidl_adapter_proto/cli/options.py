"""What several commands share: how arguments become sources and a request."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click

from rosidl_adapter_proto.errors import Error
from rosidl_adapter_proto.generate import Request
from rosidl_adapter_proto.interfaces import store
from rosidl_adapter_proto.interfaces.model import TypeName
from rosidl_adapter_proto.interfaces.sources import (
    SUFFIXES,
    Source,
    Sources,
    file_source,
    folder_source,
    prefix_sources,
    store_source,
)
from rosidl_adapter_proto.schema.numbering import LOCK_FILE_NAME, HashNumbering, SequentialNumbering

Command = TypeVar("Command", bound=Callable[..., Any])


def complete_distro(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Return the distributions that begin with what was typed."""
    return [name for name in store.distributions() if name.startswith(incomplete)]


def complete_name(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """Return the packages, or behind a slash the types of one, that begin with what was typed."""
    try:
        sources = find_sources(context.params.get("include") or (), context.params.get("distro"))
    except (Error, click.UsageError):
        return []
    package, slash, _ = incomplete.partition("/")
    names = map(str, sources.packages.get(package, ())) if slash else sources.packages
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
        type=click.Choice([HashNumbering.name, SequentialNumbering.name]),
        default=HashNumbering.name,
        show_default=True,
        help="How fields are numbered: from a hash of their names, or in sequence with a lock file.",
    )(command)


def find_sources(include: Iterable[Path], distro: str | None, first: Sequence[Source] = ()) -> Sources:
    """Return every source in the order they win: `first`, included folders, ROS installations, the store."""
    folders = [folder_source(_existing(path)) for path in include]
    return Sources((*first, *folders, *prefix_sources(), store_source(distro)))


def find_request(
    what: Sequence[str], include: Iterable[Path], distro: str | None, dependencies: bool
) -> tuple[Request, Sources]:
    """Return what the arguments of a command ask for, and where definitions come from.

    Args:
        what: Packages, types, folders and files.
        include: Folders to find definitions in.
        distro: The distribution of the embedded store.
        dependencies: Whether dependencies are asked for as well.
    """
    given: list[Source] = []
    packages: list[str] = []
    types: list[TypeName] = []
    names: list[str] = []
    for text in what:
        path = Path(text)
        if path.suffix in SUFFIXES:
            source, name = file_source(_existing(path))
            _add_file(given, source, name)
            types.append(name)
        elif is_path(text):
            source = folder_source(_existing(path))
            given.append(source)
            packages += source.packages
        else:
            names.append(text)
    sources = find_sources(include, distro, given)
    for text in names:
        if text not in sources.packages and Path(text).is_dir():
            source = folder_source(Path(text))
            sources = Sources((source, *sources.sources))
            packages += source.packages
        elif "/" in text:
            types.append(sources.full_name(text))
        else:
            sources.package(text)
            packages.append(text)
    return Request(tuple(packages), tuple(types), dependencies), sources


def is_path(text: str) -> bool:
    """Tell whether an argument can only be a file or folder; `std_msgs` may be a folder or a package."""
    return text.startswith((".", "/")) or text.endswith(("/", *SUFFIXES)) or "\\" in text


def _add_file(given: list[Source], source: Source, name: TypeName) -> None:
    """Add the definition of a file that was named to the source that has its package already, or else its source."""
    for index, other in enumerate(given):
        if name.package in other.packages:
            package = {**other.packages[name.package], name: source.packages[name.package][name]}
            given[index] = Source(other.origin, {**other.packages, name.package: package})
            return
    given.append(source)


def _existing(path: Path) -> Path:
    if not path.exists():
        raise click.UsageError(f"there is no file or folder {path}")
    return path
