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
from rosidl_adapter_proto.interfaces.msg import parse_action, parse_msg, parse_srv

SUFFIXES = (".idl", ".action", ".srv", ".msg")
"""File name suffixes of definitions. ROS installs an `.idl` made from each `.msg`: the later one here is taken."""

_PARSERS: dict[str, Callable[[str, TypeName, str], Interface]] = {
    ".msg": parse_msg,
    ".srv": parse_srv,
    ".action": parse_action,
    ".idl": parse_idl,
}

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
    return Source(_GIVEN_TEXTS, packages)


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
        packages = {
            name: package
            for name in _folders(share)
            if (package := _read_package(share / name, name, origin))
        }
        if packages:
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


def _unreadable(path: str | Path, error: OSError) -> DefinitionError:
    return DefinitionError(f"cannot read {path}: {error.strerror}")


def _package_folders(folder: Path, seen: set[str]) -> Iterator[Path]:
    """Yield the package folders at and below `folder`; nothing is looked for inside a package.

    Args:
        folder: Where to look.
        seen: The real paths that were looked at, since symbolic links may lead back.
    """
    real_path = os.path.realpath(folder)
    if real_path in seen or any(os.path.exists(folder / marker) for marker in _IGNORE_MARKERS):
        return
    seen.add(real_path)
    if os.path.isfile(folder / "package.xml") or any(os.path.isdir(folder / each) for each in NAMESPACES):
        yield folder
        return
    for child in _folders(folder):
        if not child.startswith("."):
            yield from _package_folders(folder / child, seen)


def _folders(folder: Path) -> list[str]:
    """Return the names of the folders in a folder. A link that leads nowhere, or in a circle, is none."""
    try:
        return sorted(entry.name for entry in os.scandir(folder) if os.path.isdir(entry))
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
