"""What can be asked for, and how the words of a command line or a configuration become a request."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rosidl_adapter_proto.errors import RequestError
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import (
    SUFFIXES,
    Source,
    file_source,
    folder_source,
    installed_sources,
)
from rosidl_adapter_proto.interfaces.model import TypeName


@dataclass(frozen=True)
class Request:
    """What to generate.

    Attributes:
        packages: Packages, which are generated whole.
        types: Single interfaces.
        dependencies: Whether to generate what these refer to as well.
    """

    packages: tuple[str, ...] = ()
    types: tuple[TypeName, ...] = ()
    dependencies: bool = True


def find_catalog(include: Iterable[Path], distro: str | None, first: Sequence[Source] = ()) -> Catalog:
    """Return every source in the order they win: `first`, included folders, ROS installations, the store."""
    folders = [folder_source(_existing(path)) for path in include]
    return Catalog((*first, *folders, *installed_sources(distro)))


def find_request(
    what: Sequence[str],
    include: Iterable[Path],
    distro: str | None,
    dependencies: bool,
    first: Sequence[Source] = (),
) -> tuple[Request, Catalog]:
    """Return what the arguments of a command ask for, and where definitions come from.

    Args:
        what: Packages, types, folders and files.
        include: Folders to find definitions in.
        distro: The distribution of the embedded store.
        dependencies: Whether dependencies are asked for as well.
        first: Where definitions come from before all else.
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
    catalog = find_catalog(include, distro, [*first, *given])
    for text in names:
        if text not in catalog.packages and os.path.isdir(text):
            source = folder_source(Path(text))
            catalog = Catalog((source, *catalog.sources))
            packages += source.packages
        elif "/" in text:
            types.append(catalog.interface_name(text))
        else:
            catalog.package(text)
            packages.append(text)
    return Request(tuple(packages), tuple(types), dependencies), catalog


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
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        raise RequestError(f"there is no file or folder {path}") from None
    except OSError as error:
        raise RequestError(f"cannot read {path}: {error.strerror}; give another file or folder") from None
    return path
