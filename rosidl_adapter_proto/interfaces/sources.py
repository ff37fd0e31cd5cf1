"""Where interface definitions come from, and what a set of them depends on.

Sources are asked in order, and the first that has a package provides all of it: paths given by the user, packages
of the ROS installation (`AMENT_PREFIX_PATH` and the environment that Python runs in), and the embedded store.
"""

from __future__ import annotations

import difflib
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from rosidl_adapter_proto.errors import DefinitionError
from rosidl_adapter_proto.interfaces import store
from rosidl_adapter_proto.interfaces.description import TypeDescription, describe, structs, type_hash
from rosidl_adapter_proto.interfaces.idl import parse_idl
from rosidl_adapter_proto.interfaces.model import (
    NAMESPACES,
    Interface,
    Message,
    TypeName,
    messages,
    references,
)
from rosidl_adapter_proto.interfaces.msg import parse_action, parse_msg, parse_srv

SUFFIXES = (".idl", ".action", ".srv", ".msg")
"""File name suffixes of definitions. ROS installs an `.idl` made from each `.msg`: the later one here is taken."""

_PARSERS: dict[str, Callable[[str, TypeName, str], Interface]] = {
    ".msg": parse_msg,
    ".srv": parse_srv,
    ".action": parse_action,
    ".idl": parse_idl,
}
_DERIVED = re.compile(
    r"(_SendGoal|_GetResult)?_(Request|Response|Event|Goal|Result|Feedback)$"
    r"|_(SendGoal|GetResult|FeedbackMessage)$"
)
_PACKAGE_NAME = re.compile(r"<name>\s*([A-Za-z0-9_.-]+)\s*</name>")
_IGNORE_MARKERS = ("COLCON_IGNORE", "AMENT_IGNORE")


@dataclass(frozen=True)
class Definition:
    """An interface definition that was found; it is read and parsed when it is needed.

    Attributes:
        name: The type it defines.
        format: How it is written; one of `SUFFIXES`.
        file: Its path, or the place in the embedded store.
        origin: The source that has it, for people.
    """

    name: TypeName
    format: str
    file: str
    origin: str
    stored_text: str | None = None
    ros1_names: bool = False

    @cached_property
    def text(self) -> str:
        """The definition itself.

        Raises:
            DefinitionError: The file cannot be read, or is not UTF-8.
        """
        if self.stored_text is not None:
            return self.stored_text
        try:
            return Path(self.file).read_bytes().decode("utf-8-sig")
        except OSError as error:
            raise DefinitionError(f"cannot read {self.file}: {error.strerror}") from None
        except UnicodeDecodeError as error:
            raise DefinitionError(
                f"{self.file}: byte {error.start} is not valid UTF-8; save the file as UTF-8"
            ) from None

    @cached_property
    def interface(self) -> Interface:
        """What it defines.

        Raises:
            DefinitionError: It cannot be read or is not valid.
        """
        if self.ros1_names:
            return parse_msg(self.text, self.name, self.file, ros1_names=True)
        return _PARSERS[self.format](self.text, self.name, self.file)


Package = Mapping[TypeName, Definition]


@dataclass(frozen=True)
class Source:
    """A place that has packages of interfaces.

    Attributes:
        origin: What it is, for people.
        packages: The definitions of each package.
    """

    origin: str
    packages: Mapping[str, Package]


def folder_source(folder: Path) -> Source:
    """Return the source of a package folder, or of a folder that has package folders at any depth.

    Raises:
        DefinitionError: There are no definitions in it, or two folders hold the same package.
    """
    packages: dict[str, Package] = {}
    found: dict[str, Path] = {}
    for package_folder in _package_folders(folder):
        name = _package_name(package_folder)
        package = _read_package(package_folder, name, str(folder))
        if not package:
            continue
        if name in found:
            raise DefinitionError(
                f"package {name!r} is in both {found[name]} and {package_folder}; "
                "put a file named COLCON_IGNORE into the one to leave out"
            )
        packages[name], found[name] = package, package_folder
    if not packages:
        raise DefinitionError(
            f"no interface definitions in {folder}: "
            "a package has .msg, .srv, .action or .idl files in folders named msg, srv and action"
        )
    return Source(str(folder), packages)


def file_source(file: Path) -> tuple[Source, TypeName]:
    """Return the source of the package that a single definition belongs to, and the type that it defines.

    Raises:
        DefinitionError: The file is not where a package has its definitions.
    """
    absolute = file.absolute()
    if file.suffix not in SUFFIXES or absolute.parent.name not in NAMESPACES:
        raise DefinitionError(
            f"{file} is not part of a package: "
            "a definition is a .msg, .srv, .action or .idl file in <package>/msg, <package>/srv or "
            "<package>/action"
        )
    folder = absolute.parent.parent
    name = _package_name(folder)
    type_name = TypeName(name, absolute.parent.name, file.stem)
    package = dict(_read_package(folder, name, str(file)))
    # The file that was named counts, even if the package has the same type in another format.
    package[type_name] = Definition(type_name, file.suffix, str(file), str(file))
    return Source(str(file), {name: package}), type_name


def prefix_sources() -> list[Source]:
    """Return the ROS installations: each prefix on `AMENT_PREFIX_PATH`, then the environment of this Python."""
    prefixes = [part for part in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if part]
    sources: list[Source] = []
    for prefix in dict.fromkeys(os.path.realpath(part) for part in [*prefixes, sys.prefix]):
        share = Path(prefix, "share")
        if not share.is_dir():
            continue
        origin = f"ROS prefix {prefix}"
        packages = {
            entry.name: package
            for entry in sorted(os.scandir(share), key=lambda each: each.name)
            if entry.is_dir() and (package := _read_package(Path(entry.path), entry.name, origin))
        }
        if packages:
            sources.append(Source(origin, packages))
    return sources


def store_source(distribution: str | None = None) -> Source:
    """Return the embedded store of a distribution: by default that of `ROS_DISTRO`, else the newest.

    Raises:
        DefinitionError: The store does not have the distribution that was asked for.
    """
    if distribution is None:
        sourced = os.environ.get("ROS_DISTRO", "")
        distribution = sourced if sourced in store.distributions() else store.newest_distribution()
    origin = f"embedded store {distribution}"
    ros1_names = store.has_ros1_names(distribution)
    packages: dict[str, dict[TypeName, Definition]] = {}
    texts = store.definitions(distribution)
    # ROS adds these to services and actions; old distributions do not have them all.
    for name, text in store.definitions(store.newest_distribution()).items():
        if name.package in _USED_BY_ROS_ITSELF:
            texts.setdefault(name, text)
    for name, text in texts.items():
        definition = Definition(name, ".msg", f"{origin}: {name}", origin, text, ros1_names)
        packages.setdefault(name.package, {})[name] = definition
    return Source(origin, packages)


_USED_BY_ROS_ITSELF = ("builtin_interfaces", "service_msgs", "unique_identifier_msgs")


@dataclass(frozen=True)
class Sources:
    """Every place where definitions may come from, in the order they win."""

    sources: tuple[Source, ...]

    @cached_property
    def packages(self) -> Mapping[str, Package]:
        """Every package, from the first source that has it."""
        merged: dict[str, Package] = {}
        for source in reversed(self.sources):
            merged.update(source.packages)
        return merged

    def package(self, name: str) -> Package:
        """Return the definitions of a package.

        Raises:
            DefinitionError: No source has it; the message names similar ones and where was looked.
        """
        if name not in self.packages:
            raise DefinitionError(
                f"package {name!r} was not found{_near_misses(name, self.packages)}; {self.places()}"
            )
        return self.packages[name]

    def definition(self, name: TypeName) -> Definition:
        """Return the definition of an interface, or the one that a derived type such as `X_Request` is part of.

        Raises:
            DefinitionError: No source has its package, or the package does not have it.
        """
        package = self.package(name.package)
        owner = self.owner(name)
        if owner is None:
            names = [str(each) for each in package]
            origin = next(iter(package.values())).origin
            raise DefinitionError(
                f"type {str(name)!r} was not found in package {name.package!r} of {origin}"
                f"{_near_misses(str(name), names)}"
            )
        return package[owner]

    def owner(self, name: TypeName) -> TypeName | None:
        """Return the interface that `name` is, or is a part of; None if there is none."""
        package = self.packages.get(name.package, {})
        if name in package:
            return name
        base = TypeName(name.package, name.namespace, _DERIVED.sub("", name.name))
        return base if base in package else None

    def definition_name(self, name: TypeName) -> TypeName:
        """Return the interface that `name` is, or is a part of; errors are those of `definition`."""
        return self.definition(name).name

    def message(self, name: TypeName) -> Message:
        """Return a message; services and actions are seen as messages of their parts.

        Raises:
            DefinitionError: It is missing, or its definition is not valid.
        """
        if name not in self._messages:
            self._messages.update((each.name, each) for each in structs(self.definition(name).interface))
        return self._messages[name]

    def describe(self, name: TypeName) -> TypeDescription:
        """Return the type description of a type (REP-2011); errors are those of `message`."""
        return describe(name, self.message)

    def hash(self, name: TypeName) -> str:
        """Return the RIHS01 hash of a type; errors are those of `message`."""
        return type_hash(self.describe(name))

    @cached_property
    def _messages(self) -> dict[TypeName, Message]:
        return {}

    def full_name(self, text: str) -> TypeName:
        """Return the interface that `pkg/Name` or `pkg/msg/Name` means.

        Raises:
            DefinitionError: There is none, or the short form could mean several.
        """
        package, _, rest = text.partition("/")
        if "/" in rest:
            return self.definition(TypeName.parse(text)).name
        candidates = [each for each in self.package(package) if each.name == rest]
        if len(candidates) > 1:
            raise DefinitionError(
                f"{text!r} could be any of {', '.join(map(str, candidates))}; give the full name"
            )
        if not candidates:
            return self.definition(TypeName(package, "msg", rest)).name
        return candidates[0]

    def shadowed(self, names: Iterable[TypeName]) -> Iterator[tuple[Definition, Definition]]:
        """Yield what wins and what loses where two sources define one of `names` differently.

        The embedded store only stands in for packages that are nowhere else: it takes no part.
        """
        for name in names:
            winner = self.definition(name)
            for source in self.sources:
                loser = source.packages.get(name.package, {}).get(name)
                if loser is None or loser.stored_text is not None or loser.file == winner.file:
                    continue
                if loser.text != winner.text and loser.interface != winner.interface:
                    yield winner, loser

    def places(self) -> str:
        """Say where was looked."""
        return "looked in " + ", ".join(source.origin for source in self.sources)


def closure(
    sources: Sources, packages: Iterable[str], types: Iterable[TypeName] = (), *, events: bool = False
) -> list[TypeName]:
    """Return every interface to generate for a request, dependencies first.

    A package that is asked for, or that something refers to, comes whole. Of a package that only single types were
    asked of, these come with what they refer to.

    Args:
        sources: Where to look.
        packages: Packages asked for.
        types: Single interfaces asked for.
        events: Whether services have their `_Event` messages.

    Raises:
        DefinitionError: A package or type is missing (all of them are named), or messages contain each other.
    """
    whole, single = list(packages), list(types)
    partial = {name.package for name in single} - set(whole)
    order: dict[TypeName, None] = {}
    open_path: list[TypeName] = []
    missing: dict[str, list[str]] = {}

    def visit(name: TypeName) -> None:
        if name in order:
            return
        open_path.append(name)
        interface = sources.definition(name).interface
        for needed, user in _needs(interface, events):
            owner = sources.owner(needed)
            if owner is None:
                missing.setdefault(str(needed), []).append(user)
            elif owner in open_path and owner != name:
                chain = " -> ".join(map(str, [*open_path[open_path.index(owner) :], owner]))
                raise DefinitionError(f"messages cannot contain each other: {chain}")
            elif owner == name and needed == name:
                raise DefinitionError(f"a message cannot contain itself: {user}")
            else:
                visit(owner)
        open_path.pop()
        order[name] = None

    queue = [name for package in whole for name in sources.package(package)]
    queue += [sources.definition(name).name for name in single]
    complete = set(whole)
    while queue:
        for name in queue:
            visit(name)
        needed_packages = {name.package for name in order} - complete - partial
        complete |= needed_packages
        queue = [name for package in sorted(needed_packages) for name in sources.package(package)]
    if missing:
        raise _missing_error(sources, missing)
    return list(order)


def _needs(interface: Interface, events: bool) -> Iterator[tuple[TypeName, str]]:
    """Yield each type that the messages of an interface refer to, and the field that does, with its place."""
    parts = messages(interface, events=events)
    own = {message.name for message in parts}
    for message in parts:
        for field, name in references(message):
            if name not in own or isinstance(interface, Message):
                place = f" ({field.location})" if field.location else ""
                yield name, f"{message.name}.{field.name}{place}"


def _missing_error(sources: Sources, missing: Mapping[str, list[str]]) -> DefinitionError:
    lines = []
    for name, users in missing.items():
        more = f" and {len(users) - 1} more" if len(users) > 1 else ""
        package = name.partition("/")[0]
        if package in sources.packages:
            near = _near_misses(name, [str(each) for each in sources.packages[package]])
        else:
            near = _near_misses(package, sources.packages)
        lines.append(f"{name} was not found, but {users[0]}{more} needs it{near}")
    return DefinitionError("\n".join([*lines, sources.places()]))


def _near_misses(name: str, known: Iterable[str]) -> str:
    by_lower = {each.lower(): each for each in known}
    near = [by_lower[each] for each in difflib.get_close_matches(name.lower(), by_lower, n=3)]
    return f"; did you mean {' or '.join(near)}?" if near else ""


def _package_folders(folder: Path) -> Iterator[Path]:
    """Yield the package folders at and below `folder`; nothing is looked for inside a package."""
    if any((folder / marker).exists() for marker in _IGNORE_MARKERS):
        return
    if (folder / "package.xml").is_file() or any((folder / namespace).is_dir() for namespace in NAMESPACES):
        yield folder
        return
    try:
        children = sorted(entry.name for entry in os.scandir(folder) if entry.is_dir())
    except OSError as error:
        raise DefinitionError(f"cannot read {folder}: {error.strerror}") from None
    for child in children:
        if not child.startswith("."):
            yield from _package_folders(folder / child)


def _package_name(folder: Path) -> str:
    manifest = folder / "package.xml"
    if manifest.is_file():
        match = _PACKAGE_NAME.search(manifest.read_text(encoding="utf-8", errors="replace"))
        if match is None:
            raise DefinitionError(f"{manifest} has no <name>")
        return match[1]
    return folder.resolve().name


def _read_package(folder: Path, name: str, origin: str) -> Package:
    found: dict[TypeName, Definition] = {}
    for namespace in NAMESPACES:
        try:
            files = sorted(os.listdir(folder / namespace))
        except (FileNotFoundError, NotADirectoryError):
            continue
        for suffix in SUFFIXES:
            if suffix not in (".idl", f".{namespace}"):
                continue
            for file in files:
                stem, extension = os.path.splitext(file)
                if extension == suffix:
                    type_name = TypeName(name, namespace, stem)
                    path = str(folder / namespace / file)
                    found[type_name] = Definition(type_name, suffix, path, origin)
    return dict(sorted(found.items()))
