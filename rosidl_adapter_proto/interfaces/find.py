"""Where interface definitions are: in folders, single files, ROS installations and the embedded store."""

from __future__ import annotations

import codecs
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from xml.etree import ElementTree

from rosidl_adapter_proto.errors import DefinitionError
from rosidl_adapter_proto.interfaces import store
from rosidl_adapter_proto.interfaces.idl import parse_idl
from rosidl_adapter_proto.interfaces.model import NAMESPACES, Interface, TypeName
from rosidl_adapter_proto.interfaces.msg import ROS1, ROS2, Dialect, parse_action, parse_msg, parse_srv

SUFFIXES = (".idl", ".action", ".srv", ".msg")
"""File name suffixes of definitions."""

_PARSERS: dict[str, Callable[[str, TypeName, str, Dialect], Interface]] = {
    ".msg": parse_msg,
    ".srv": parse_srv,
    ".action": parse_action,
    ".idl": lambda text, name, file, _: parse_idl(text, name, file),
}

_IGNORE_MARKERS = {"COLCON_IGNORE", "AMENT_IGNORE"}

_FOREIGN_MARKERS = ("package.xml", "CMakeCache.txt")
"""Files of folders in a package that are not part of it: other packages, and what CMake builds in."""

_TEST_FOLDERS = {"test", "tests"}
"""Folders of a package whose definitions are only built for its tests."""


def interface_name(package: str, file: Path) -> TypeName | None:
    """Return the type that ROS makes of a file of a package, or None if it is no definition.

    The suffix decides, whatever folder the file is in (`convert_to_idl` of rosidl_adapter). An `.idl` file is taken as
    it is: the folder that it is in decides (the generators of rosidl_cmake).
    """
    namespace = file.parent.name if file.suffix == ".idl" else file.suffix.removeprefix(".")
    return TypeName(package, namespace, file.stem) if namespace in NAMESPACES else None


@dataclass(frozen=True)
class Definition:
    """An interface definition that was found; it is read and parsed when it is needed.

    Attributes:
        name: The type it defines.
        format: How it is written; one of `SUFFIXES`.
        file: Its path, or the place in the embedded store.
        origin: The source that has it, for people.
        stored_text: The definition itself, if it is in no file.
        dialect: The rules of a text that is not `.idl`.
        other_file: Another file that defines the same type, if there is one: then neither can be read.
    """

    name: TypeName
    format: str
    file: str
    origin: str
    stored_text: str | None = None
    dialect: Dialect = ROS2
    other_file: str | None = None

    @cached_property
    def text(self) -> str:
        """The definition itself.

        Raises:
            DefinitionError: The file cannot be read, or is not UTF-8, or another one defines the same type.
        """
        if self.other_file is not None:
            raise DefinitionError(
                f"{self.name} is defined by both {self.other_file} and {self.file}: the name of a file makes the name "
                "of its type, whatever folder it is in; rename or remove one"
            )
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
        return _PARSERS[self.format](self.text, self.name, self.file, self.dialect)


Package = Mapping[TypeName, Definition]


@dataclass(frozen=True)
class Source:
    """A place that has packages of interfaces.

    Attributes:
        origin: What it is, for people.
        packages: The definitions of each package.
        stands_in: Whether it only stands in for packages that are nowhere else.
        limit: What it can have at all, for people; empty if that is everything.
        is_partial: Whether it has single types: of their packages, other sources have the rest.
    """

    origin: str
    packages: Mapping[str, Package]
    stands_in: bool = False
    limit: str = ""
    is_partial: bool = False


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
            f"no interface definitions in {folder}: give the folder of a package, which has a package.xml or folders "
            "named msg, srv and action, or a folder of such packages"
        )
    return Source(str(folder), packages)


def file_source(file: Path) -> tuple[Source, TypeName]:
    """Return the source of the package that a single definition belongs to, and the type that it defines.

    Raises:
        DefinitionError: The file is not where a package has its definitions.
    """
    folder = _package_folder_of(file.absolute())
    name = _package_name(folder) if folder else ""
    type_name = interface_name(name, file.absolute())
    if folder is None or type_name is None:
        raise DefinitionError(
            f"{file} is not part of a package: a definition is a .msg, .srv or .action file below a folder that has a "
            "package.xml, or below <package>/msg, <package>/srv or <package>/action; an .idl file is in a folder "
            "named msg, srv or action"
        )
    package = dict(_read_package(folder, name, str(file)))
    # The file that was named counts, even if the package has the same type in another format or folder.
    package[type_name] = Definition(type_name, file.suffix, str(file), str(file))
    return Source(str(file), {name: package}), type_name


def interface_source(package: str, interfaces: Iterable[str]) -> Source:
    """Return the source of a package whose definitions are listed, as ROS's build and its command line do.

    Args:
        package: The name of the package.
        interfaces: Its definitions: paths such as `msg/Track.msg`, which may follow a base folder and a colon.

    Raises:
        DefinitionError: One is none that ROS takes.
    """
    files: list[tuple[TypeName, str]] = []
    for interface in interfaces:
        base, _, relative = interface.rpartition(":")
        name = interface_name(package, Path(relative))
        if name is None:
            raise DefinitionError(
                f"{Path(base, relative)} is no definition: it has to be a .msg, .srv or .action file, or an .idl file "
                "in a folder named msg, srv or action"
            )
        files.append((name, str(Path(base, relative))))
    origin = f"package {package}"
    return Source(origin, {package: _definitions(dict.fromkeys(files), origin)})


def text_source(texts: Mapping[TypeName, str]) -> Source:
    """Return the source of definitions that are given as text, in the form of `.msg`, `.srv` and `.action` files.

    Raises:
        DefinitionError: The namespace of a type is none that definitions have.
    """
    packages: dict[str, dict[TypeName, Definition]] = {}
    for name, text in texts.items():
        if name.namespace not in NAMESPACES:
            raise DefinitionError(f"{name}: what stands in the middle has to be msg, srv or action")
        definition = Definition(name, f".{name.namespace}", str(name), _GIVEN_TEXTS, stored_text=text)
        packages.setdefault(name.package, {})[name] = definition
    return Source(_GIVEN_TEXTS, packages, is_partial=True)


_GIVEN_TEXTS = "the given texts"


def prefixes() -> list[Path]:
    """Return where ROS packages are installed: `AMENT_PREFIX_PATH`, then the environment of this Python."""
    parts = [part for part in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if part]
    return [Path(prefix) for prefix in dict.fromkeys(os.path.realpath(part) for part in [*parts, sys.prefix])]


def prefix_sources() -> list[Source]:
    """Return the ROS installations, in the order of `prefixes`."""
    sources: list[Source] = []
    for prefix in prefixes():
        share = prefix / "share"
        if not os.path.isdir(share):
            continue
        origin = f"ROS prefix {prefix}"
        packages = _InstalledPackages(share, origin)
        if any(True for _ in packages):
            sources.append(Source(origin, packages))
    return sources


def installed_sources(distribution: str | None = None) -> list[Source]:
    """Return everything there is without naming a folder: the ROS installations, then the embedded store.

    Args:
        distribution: That of the embedded store, as `store_source` takes it.

    Raises:
        DefinitionError: The store does not have the distribution that was asked for.
    """
    return [*prefix_sources(), store_source(distribution)]


def store_source(distribution: str | None = None) -> Source:
    """Return the embedded store of a distribution: by default that of `ROS_DISTRO`, else the newest.

    Raises:
        DefinitionError: The store does not have the distribution that was asked for.
    """
    if distribution is None:
        sourced = os.environ.get("ROS_DISTRO", "")
        distribution = sourced if sourced in store.distributions() else store.newest_distribution()
    else:
        store.check_distribution(distribution)
    origin = f"embedded store {distribution}"
    return Source(origin, _StorePackages(distribution, origin), stands_in=True, limit="messages only")


class _InstalledPackages(Mapping[str, Package]):
    """The packages of a ROS installation, each of which is read when somebody asks for it."""

    def __init__(self, share: Path, origin: str) -> None:
        self._folders = {entry.name: Path(entry.path) for entry in _scan(share)}
        self._origin = origin
        self._read: dict[str, Package] = {}

    def __getitem__(self, name: str) -> Package:
        if name not in self._read:
            folder = self._folders[name]
            self._read[name] = _read_package(folder, name, self._origin) if _is_package(folder) else {}
        if not self._read[name]:
            raise KeyError(name)
        return self._read[name]

    def __iter__(self) -> Iterator[str]:
        return (name for name in self._folders if name in self)

    def __len__(self) -> int:
        return sum(1 for _ in self)


class _StorePackages(Mapping[str, Package]):
    """The packages of the embedded store, which takes long to read: that waits until somebody asks for one."""

    def __init__(self, distribution: str, origin: str) -> None:
        self._distribution, self._origin = distribution, origin

    @cached_property
    def _packages(self) -> Mapping[str, Package]:
        return _store_packages(self._distribution, self._origin)

    def __getitem__(self, name: str) -> Package:
        return self._packages[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._packages)

    def __len__(self) -> int:
        return len(self._packages)


def _store_packages(distribution: str, origin: str) -> Mapping[str, Package]:
    dialect = ROS1 if store.is_ros1(distribution) else ROS2
    packages: dict[str, dict[TypeName, Definition]] = {}
    texts = store.definitions(distribution)
    # ROS adds these to services and actions; old distributions do not have them all.
    for name, text in store.definitions(store.newest_distribution()).items():
        if name.package in _USED_BY_ROS_ITSELF:
            texts.setdefault(name, text)
    for name, text in texts.items():
        definition = Definition(name, ".msg", f"{origin}: {name}", origin, text, dialect)
        packages.setdefault(name.package, {})[name] = definition
    return packages


_USED_BY_ROS_ITSELF = ("builtin_interfaces", "service_msgs", "unique_identifier_msgs")


def _unreadable(path: str | Path, error: OSError) -> DefinitionError:
    return DefinitionError(f"cannot read {path}: {error.strerror}")


def _is_package(installed: Path) -> bool:
    """Tell whether a folder in `share` has interfaces; ROS always installs some of their files to these places."""
    return any(os.path.isdir(installed / namespace) for namespace in NAMESPACES)


def _package_folders(folder: Path, seen: set[str]) -> Iterator[Path]:
    """Yield the package folders at and below `folder`; nothing is looked for inside a package.

    Args:
        folder: Where to look.
        seen: The real paths that were looked at, since symbolic links may lead back.
    """
    entries = _entries(folder, seen)
    if not entries:
        return
    if _has_manifest(folder) or any(each.name in NAMESPACES and os.path.isdir(each) for each in entries):
        yield folder
        return
    for each in entries:
        if os.path.isdir(each) and not each.name.startswith("."):
            yield from _package_folders(Path(each.path), seen)


def _package_folder_of(file: Path) -> Path | None:
    """Return the package folder that a file is in: the next one with a package.xml, else that of msg, srv or action."""
    with_manifest = (each for each in file.parents if _has_manifest(each))
    with_namespace = (each.parent for each in file.parents if each.name in NAMESPACES)
    return next(with_manifest, None) or next(with_namespace, None)


def _has_manifest(folder: Path) -> bool:
    return os.path.isfile(folder / "package.xml")


def _entries(folder: Path, seen: set[str]) -> list[os.DirEntry[str]]:
    """Return what is in a folder, in order; nothing if it says so, or was looked at before.

    Raises:
        DefinitionError: It cannot be read.
    """
    real_path = os.path.realpath(folder)
    if real_path in seen:
        return []
    seen.add(real_path)
    entries = _scan(folder)
    return [] if any(each.name in _IGNORE_MARKERS for each in entries) else entries


def _scan(folder: Path) -> list[os.DirEntry[str]]:
    try:
        return sorted(os.scandir(folder), key=lambda each: each.name)
    except OSError as error:
        raise _unreadable(folder, error) from None


def _package_name(folder: Path) -> str:
    manifest = folder / "package.xml"
    if not os.path.isfile(manifest):
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
    """Return the definitions of a package folder, without each `.idl` that ROS made from another file and installed."""
    files = [
        (type_name, file)
        for file in _files(folder, set())
        if (type_name := interface_name(name, file)) is not None
    ]
    sources = {type_name for type_name, file in files if file.suffix != ".idl"}
    kept = [
        (type_name, str(file))
        for type_name, file in files
        if type_name not in sources or file.suffix != ".idl"
    ]
    return _definitions(kept, origin)


def _files(folder: Path, seen: set[str]) -> Iterator[Path]:
    """Yield what may be a definition in a package folder at any depth; other packages and tests are none of it."""
    for each in _entries(folder, seen):
        if each.name.endswith(SUFFIXES):
            yield Path(each.path)
        if not os.path.isdir(each) or each.name.startswith(".") or each.name in _TEST_FOLDERS:
            continue
        if not any(os.path.isfile(os.path.join(each.path, marker)) for marker in _FOREIGN_MARKERS):
            yield from _files(Path(each.path), seen)


def _definitions(files: Iterable[tuple[TypeName, str]], origin: str) -> dict[TypeName, Definition]:
    """Return the definitions that are in files; of a type that two of them define, neither can be read."""
    found: dict[TypeName, Definition] = {}
    for name, file in sorted(files):
        other = found[name].file if name in found else None
        found[name] = Definition(name, Path(file).suffix, file, origin, other_file=other)
    return found
