"""Where interface definitions come from, and what a set of them depends on.

Sources are asked in order, and the first that has a package provides all of it: paths given by the user, packages
of the ROS installation (`AMENT_PREFIX_PATH` and the environment that Python runs in), and the embedded store.
"""

from __future__ import annotations

import codecs
import difflib
import os
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from xml.etree import ElementTree

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
            data = Path(self.file).read_bytes()
        except OSError as error:
            raise _unreadable(self.file, error) from None
        try:
            return data.removeprefix(codecs.BOM_UTF8).decode()
        except UnicodeDecodeError as error:
            line = error.object[: error.start].count(b"\n") + 1
            raise DefinitionError(
                f"{self.file}:{line}: byte 0x{error.object[error.start]:02x} is not valid UTF-8; "
                "save the file as UTF-8"
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
    for package_folder in _package_folders(folder, set()):
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
            f"no interface definitions in {folder}: give the folder of a package, which has .msg, .srv, .action "
            "or .idl files in folders named msg, srv and action, or a folder of such packages"
        )
    return Source(str(folder), packages)


def file_source(file: Path) -> tuple[Source, TypeName]:
    """Return the source of the package that a single definition belongs to, and the type that it defines.

    Raises:
        DefinitionError: The file is not where a package has its definitions.
    """
    absolute = file.absolute()
    namespace = absolute.parent.name
    if namespace not in NAMESPACES or file.suffix not in (".idl", f".{namespace}"):
        raise DefinitionError(
            f"{file} is not part of a package: a definition is <package>/msg/<Name>.msg, "
            "<package>/srv/<Name>.srv or <package>/action/<Name>.action, or an .idl file in one of these folders"
        )
    folder = absolute.parent.parent
    name = _package_name(folder)
    type_name = TypeName(name, namespace, file.stem)
    package = dict(_read_package(folder, name, str(file)))
    # The file that was named counts, even if the package has the same type in another format.
    package[type_name] = Definition(type_name, file.suffix, str(file), str(file))
    return Source(str(file), {name: package}), type_name


def interface_source(package: str, interfaces: Iterable[str]) -> Source:
    """Return the source of a package whose definitions are listed, as ROS's build and its command line do.

    Args:
        package: The name of the package.
        interfaces: Its definitions: paths such as `msg/Track.msg`, which may follow a base folder and a colon.

    Raises:
        DefinitionError: One is not in a folder msg, srv or action, or has another suffix.
    """
    definitions: dict[TypeName, Definition] = {}
    for interface in interfaces:
        base, _, relative = interface.rpartition(":")
        file = Path(base, relative)
        namespace = Path(relative).parent.name
        if namespace not in NAMESPACES or file.suffix not in (".idl", f".{namespace}"):
            raise DefinitionError(
                f"{file} is no definition: it has to be msg/<Name>.msg, srv/<Name>.srv or action/<Name>.action, "
                "or an .idl file in one of these folders"
            )
        name = TypeName(package, namespace, file.stem)
        definitions[name] = Definition(name, file.suffix, str(file), f"package {package}")
    return Source(f"package {package}", {package: definitions})


def prefixes() -> list[Path]:
    """Return where ROS packages are installed: `AMENT_PREFIX_PATH`, then the environment of this Python."""
    parts = [part for part in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if part]
    return [Path(prefix) for prefix in dict.fromkeys(os.path.realpath(part) for part in [*parts, sys.prefix])]


def prefix_sources() -> list[Source]:
    """Return the ROS installations, in the order of `prefixes`."""
    sources: list[Source] = []
    for prefix in prefixes():
        share = prefix / "share"
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
            origin = next(iter(package.values())).origin
            others = [each.origin for each in self.sources if name in each.packages.get(name.package, {})]
            hint = f"; {others[0]} has it, but comes later" if others else _near_types(str(name), package)
            raise DefinitionError(
                f"type {str(name)!r} was not found in package {name.package!r} of {origin}{hint}"
            )
        return package[owner]

    def owner(self, name: TypeName) -> TypeName | None:
        """Return the interface that `name` is, or is a part of; None if there is none."""
        package = self.packages.get(name.package, {})
        if name in package:
            return name
        base = TypeName(name.package, name.namespace, _DERIVED.sub("", name.name))
        if base == name or base not in package:
            return None
        return base if name in {each.name for each in structs(package[base].interface)} else None

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
            try:
                return self.definition(TypeName.parse(text)).name
            except ValueError as error:
                raise DefinitionError(str(error)) from None
        self.package(package)
        found = [self.owner(TypeName(package, namespace, rest)) for namespace in NAMESPACES]
        candidates = [each for each in found if each]
        if len(candidates) > 1:
            raise DefinitionError(
                f"{text!r} could be any of {', '.join(map(str, candidates))}; give the full name"
            )
        return candidates[0] if candidates else self.definition(TypeName(package, "msg", rest)).name

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
                if not _is_same(winner, loser):
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
    missing: dict[str, list[str]] = {}

    def needs(name: TypeName) -> Iterator[tuple[TypeName, str]]:
        for needed, user in _needs(sources.definition(name).interface, events):
            owner = sources.owner(needed)
            if owner is None:
                missing.setdefault(str(needed), []).append(user)
            else:
                yield owner, user

    queue = [name for package in whole for name in sources.package(package)]
    queue += [sources.definition(name).name for name in single]
    complete = set(whole)
    while queue:
        _order_by_need(queue, needs, order)
        needed_packages = {name.package for name in order} - complete - partial
        complete |= needed_packages
        queue = [name for package in sorted(needed_packages) for name in sources.package(package)]
    if missing:
        raise _missing_error(sources, missing)
    return list(order)


def _needs(interface: Interface, events: bool) -> Iterator[tuple[TypeName, str]]:
    """Yield each type outside an interface that its messages refer to, and the field that does, with its place.

    Raises:
        DefinitionError: The messages of the interface contain each other.
    """
    own = {message.name: message for message in messages(interface, events=events)}
    _order_by_need(own, lambda name: (each for each in _users(own[name]) if each[0] in own), {})
    for message in own.values():
        yield from (each for each in _users(message) if each[0] not in own)


def _users(message: Message) -> Iterator[tuple[TypeName, str]]:
    for field, name in references(message):
        place = f" ({field.location})" if field.location else ""
        yield name, f"{message.name}.{field.name}{place}"


def _order_by_need(
    names: Iterable[TypeName],
    needs: Callable[[TypeName], Iterator[tuple[TypeName, str]]],
    order: dict[TypeName, None],
) -> None:
    """Add `names` and everything they need to `order`, what is needed first.

    It does not recurse: definitions may be nested deeper than Python's stack.

    Raises:
        DefinitionError: Some need each other.
    """
    for first in names:
        if first in order:
            continue
        # What is on the way from `first` to the current name, with what each still has to visit.
        path = {first: needs(first)}
        users: list[str] = []
        while path:
            current = next(reversed(path))
            for needed, user in path[current]:
                if needed in path:
                    start = list(path).index(needed)
                    raise _cycle_error([*path][start:], [*users[start:], user])
                if needed not in order:
                    path[needed] = needs(needed)
                    users.append(user)
                    break
            else:
                order[current] = None
                del path[current]
                del users[-1:]


def _cycle_error(names: list[TypeName], users: list[str]) -> DefinitionError:
    if len(names) == 1:
        return DefinitionError(f"a message cannot contain itself: {users[0]}")
    contained = [*names[1:], names[0]]
    lines = [f"  {user} is a {name}" for user, name in zip(users, contained, strict=True)]
    if len(lines) > _LONGEST_CHAIN:
        lines[_LONGEST_CHAIN - 1 : -1] = [f"  ... {len(lines) - _LONGEST_CHAIN} more"]
    return DefinitionError("\n".join(["messages cannot contain each other:", *lines]))


_LONGEST_CHAIN = 10
"""How much of a chain of messages an error shows."""


def _missing_error(sources: Sources, missing: Mapping[str, list[str]]) -> DefinitionError:
    lines = []
    for name, users in missing.items():
        more = f" and {len(users) - 1} more" if len(users) > 1 else ""
        package = name.partition("/")[0]
        if package in sources.packages:
            near = _near_types(name, sources.packages[package])
        else:
            near = _near_misses(package, sources.packages)
        lines.append(f"{name} was not found, but {users[0]}{more} need{'' if more else 's'} it{near}")
    return DefinitionError("\n".join([*lines, sources.places()]))


def _is_same(one: Definition, other: Definition) -> bool:
    try:
        return one.text == other.text or one.interface == other.interface
    except DefinitionError:
        return False


def _near_types(name: str, package: Package) -> str:
    """Suggest types of a package by their last name alone: all else is alike, and would make everything similar."""
    by_last_name: dict[str, str] = {each.name: str(each) for each in package}
    return _near_misses(name.rpartition("/")[2], by_last_name, by_last_name)


def _near_misses(name: str, known: Iterable[str], shown: Mapping[str, str] | None = None) -> str:
    by_lower = {each.lower(): each for each in known}
    near = [by_lower[each] for each in difflib.get_close_matches(name.lower(), by_lower, n=3)]
    words = " or ".join(shown[each] if shown else each for each in near)
    return f"; did you mean {words}?" if near else ""


def _unreadable(path: str | Path, error: OSError) -> DefinitionError:
    return DefinitionError(f"cannot read {path}: {error.strerror}")


def _package_folders(folder: Path, seen: set[str]) -> Iterator[Path]:
    """Yield the package folders at and below `folder`; nothing is looked for inside a package.

    Args:
        folder: Where to look.
        seen: The real paths that were looked at, since symbolic links may lead back.
    """
    real_path = os.path.realpath(folder)
    if real_path in seen or any((folder / marker).exists() for marker in _IGNORE_MARKERS):
        return
    seen.add(real_path)
    if (folder / "package.xml").is_file() or any((folder / namespace).is_dir() for namespace in NAMESPACES):
        yield folder
        return
    try:
        children = sorted(entry.name for entry in os.scandir(folder) if entry.is_dir())
    except OSError as error:
        raise _unreadable(folder, error) from None
    for child in children:
        if not child.startswith("."):
            yield from _package_folders(folder / child, seen)


def _package_name(folder: Path) -> str:
    manifest = folder / "package.xml"
    if not manifest.is_file():
        return folder.resolve().name
    try:
        name = (ElementTree.parse(manifest).getroot().findtext("name") or "").strip()
    except OSError as error:
        raise _unreadable(manifest, error) from None
    except ElementTree.ParseError as error:
        raise DefinitionError(f"{manifest} is not valid XML: {error}") from None
    if not name:
        raise DefinitionError(f"{manifest} has no <name>; give the package one")
    return name


def _read_package(folder: Path, name: str, origin: str) -> Package:
    found: dict[TypeName, Definition] = {}
    for namespace in NAMESPACES:
        try:
            files = os.listdir(folder / namespace)
        except (FileNotFoundError, NotADirectoryError):
            continue
        except OSError as error:
            raise _unreadable(folder / namespace, error) from None
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
