"""Settings from `[tool.rosidl-proto]` of a pyproject.toml, or of a setup.cfg."""

from __future__ import annotations

import configparser
import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from rosidl_adapter_proto.errors import RequestError
from rosidl_adapter_proto.generate.request import Options, Request, find_request, is_path
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.schema.numbering import LOCK_FILE_NAME, HashNumbering, SequentialNumbering

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

SECTION = "tool.rosidl-proto"


class Kind(Enum):
    """What a setting is."""

    NAMES = 1
    PATHS = 2
    FLAG = 3
    TEXT = 4
    PATH = 5


_KIND_TEXTS = {
    Kind.NAMES: "a list of strings",
    Kind.PATHS: "a list of strings",
    Kind.FLAG: "true or false",
    Kind.TEXT: "a string",
    Kind.PATH: "a string",
}


NUMBERINGS = (HashNumbering.name, SequentialNumbering.name)

SETTINGS = {
    "packages": Kind.NAMES,
    "output": Kind.PATH,
    "deps": Kind.FLAG,
    "numbering": Kind.TEXT,
    "lock-file": Kind.PATH,
    "events": Kind.FLAG,
    "python-root": Kind.TEXT,
    "include": Kind.PATHS,
    "distro": Kind.TEXT,
}
"""Every setting: what to generate, and the options of the command line by their names."""

OUTPUT_NAME = "generated"
_BESIDE_CONFIGURATION = {"output": OUTPUT_NAME, "lock-file": LOCK_FILE_NAME}
"""Paths that are not set are beside the configuration too, wherever the program runs."""


@dataclass(frozen=True)
class Configuration:
    """What a file sets.

    Attributes:
        file: The file.
        values: Lists, flags and strings by their settings; paths are relative to the current folder.
    """

    file: Path
    values: Mapping[str, Any]

    def request(self) -> tuple[Request, Catalog, Options]:
        """Return what the configuration asks for, where definitions come from, and how to generate.

        Raises:
            DefinitionError: A package or type was not found.
            RequestError: It names no packages, or a path that does not exist.
        """
        values = self.values
        if not values.get("packages"):
            raise RequestError(f"{self.file}: [{SECTION}] names nothing to generate; set `packages`")
        include = map(Path, values.get("include", ()))
        request, catalog = find_request(
            values["packages"], include, values.get("distro"), values.get("deps", True)
        )
        default = Options()
        options = Options(
            values.get("numbering", default.numbering),
            Path(values["lock-file"]),
            values.get("events", default.events),
            values.get("python-root", default.python_root),
        )
        return request, catalog, options


def find_configuration(folder: Path) -> Configuration | None:
    """Return the nearest configuration, in `folder` or above; errors are those of `read_configuration`."""
    for candidate in (folder, *folder.parents):
        configuration = read_configuration(candidate)
        if configuration is not None:
            return configuration
    return None


def read_configuration(folder: Path) -> Configuration | None:
    """Return the configuration in a folder: its pyproject.toml, or else its setup.cfg, if that has our section.

    Raises:
        RequestError: A file cannot be read, or has a setting that does not exist or is of another kind.
    """
    for name, read in (("pyproject.toml", _read_toml), ("setup.cfg", _read_ini)):
        file = folder / name
        if not file.is_file():
            continue
        try:
            section = read(file.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, configparser.Error) as error:
            raise RequestError(f"cannot read {file}: {error}") from None
        if section is not None:
            return Configuration(file, _values(section, file))
    return None


def _read_toml(text: str) -> Any:
    tools = tomllib.loads(text).get("tool", {})
    return tools.get(SECTION.partition(".")[2]) if isinstance(tools, dict) else None


def _read_ini(text: str) -> Any:
    """Return the section of a setup.cfg, with its strings as what they stand for: lists have an entry a line."""
    parser = configparser.ConfigParser(interpolation=None)
    parser.read_string(text)
    if SECTION not in parser:
        return None
    return {name: _from_ini(SETTINGS.get(name), value) for name, value in parser[SECTION].items()}


def _from_ini(kind: Kind | None, value: str) -> Any:
    if kind in (Kind.NAMES, Kind.PATHS):
        return [line.strip() for line in value.replace(",", "\n").splitlines() if line.strip()]
    if kind is Kind.FLAG:
        return configparser.ConfigParser.BOOLEAN_STATES.get(value.lower(), value)
    return value


def _values(section: Any, file: Path) -> dict[str, Any]:
    if not isinstance(section, dict):
        raise RequestError(f"{file}: [{SECTION}] must be a table")
    values: dict[str, Any] = {name: _path(path, file) for name, path in _BESIDE_CONFIGURATION.items()}
    for name, value in section.items():
        if name not in SETTINGS:
            raise RequestError(
                f"{file}: [{SECTION}] has no setting {name!r}; it has {', '.join(sorted(SETTINGS))}"
            )
        values[name] = _value(name, value, file)
    return values


def _value(name: str, value: Any, file: Path) -> Any:
    """Return the value of a setting, with paths relative to the current folder.

    Raises:
        RequestError: It is not of the kind that the setting has.
    """
    kind = SETTINGS[name]
    if not _is_of_kind(kind, value):
        raise RequestError(f"{file}: [{SECTION}] {name} must be {_KIND_TEXTS[kind]}")
    if name == "numbering" and value not in NUMBERINGS:
        choices = " or ".join(map(repr, NUMBERINGS))
        raise RequestError(f"{file}: [{SECTION}] {name} must be {choices}, not {value!r}")
    if kind is Kind.NAMES:
        return [_path(each, file) if _is_path(each, file.parent) else each for each in value]
    if kind is Kind.PATHS:
        return [_path(each, file) for each in value]
    return _path(value, file) if kind is Kind.PATH else value


def _is_of_kind(kind: Kind, value: Any) -> bool:
    if kind in (Kind.NAMES, Kind.PATHS):
        return isinstance(value, list) and all(isinstance(each, str) for each in value)
    return isinstance(value, bool if kind is Kind.FLAG else str)


def _is_path(text: str, folder: Path) -> bool:
    return is_path(text) or ("/" in text and (folder / text).exists())


def _path(text: str, file: Path) -> str:
    """Return a path that is relative to the configuration as one that is relative to the current folder."""
    path = os.path.relpath(file.parent / text)
    return str(file.parent / text) if path.startswith("..") else os.path.join(".", path)
