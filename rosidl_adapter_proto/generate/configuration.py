"""Settings from `[tool.rosidl-proto]` of a pyproject.toml, or of a setup.cfg."""

from __future__ import annotations

import configparser
import os
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rosidl_adapter_proto.errors import RequestError
from rosidl_adapter_proto.generate.request import Request, find_request, is_path
from rosidl_adapter_proto.generate.settings import SETTINGS, Kind, Options, Setting, check_lock_file_is_used
from rosidl_adapter_proto.interfaces.catalog import Catalog

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

SECTION = "tool.rosidl-proto"


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
        return request, catalog, Options.of(values)


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
        RequestError: A file cannot be read, or has a section with nearly the name of ours, or a setting that does not
            exist or is of another kind.
    """
    for name, read in (("pyproject.toml", _read_toml), ("setup.cfg", _read_ini)):
        file = folder / name
        if not os.path.isfile(file):
            continue
        try:
            names, section = read(file.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, configparser.Error) as error:
            raise RequestError(f"cannot read {file}: {error}") from None
        for misspelt in (each for each in names if each != SECTION and _letters(each) == _letters(SECTION)):
            raise RequestError(f"{file}: [{misspelt}] is not read; did you mean [{SECTION}]?")
        if section is not None:
            return Configuration(file, _values(section, file))
    return None


def _letters(section: str) -> str:
    """Return what is left of the name of a section if only the letters behind `tool` count."""
    return re.sub("[^a-z]", "", section.lower()).removeprefix("tool")


def _read_toml(text: str) -> tuple[list[str], Any]:
    """Return the names of all sections of a pyproject.toml, and ours."""
    content = tomllib.loads(text)
    tools = content.get("tool")
    if not isinstance(tools, dict):
        tools = {}
    return [*content, *(f"tool.{name}" for name in tools)], tools.get(SECTION.partition(".")[2])


def _read_ini(text: str) -> tuple[list[str], Any]:
    """Return the names of all sections of a setup.cfg, and ours, with its strings as what they stand for."""
    parser = configparser.ConfigParser(interpolation=None)
    parser.read_string(text)
    if SECTION not in parser:
        return parser.sections(), None
    return parser.sections(), {
        name: SETTINGS[name].from_text(value) if name in SETTINGS else value
        for name, value in parser[SECTION].items()
    }


def _values(section: Any, file: Path) -> dict[str, Any]:
    """Return the values of a section; paths that are not set are beside the configuration, wherever the program runs.

    Raises:
        RequestError: A setting does not exist, is of another kind, or has no use.
    """
    if not isinstance(section, dict):
        raise RequestError(f"{file}: [{SECTION}] must be a table")
    unset = [each for each in SETTINGS.values() if each.kind is Kind.PATH and each.default is not None]
    values: dict[str, Any] = {each.name: _path(str(each.default), file) for each in unset}
    for name, value in section.items():
        if name not in SETTINGS:
            raise RequestError(
                f"{file}: [{SECTION}] has no setting {name!r}; it has {', '.join(sorted(SETTINGS))}"
            )
        try:
            SETTINGS[name].check(value)
            if name == "lock-file":
                check_lock_file_is_used(section.get("numbering", SETTINGS["numbering"].default))
        except ValueError as error:
            raise RequestError(f"{file}: [{SECTION}] {name} {error}") from None
        values[name] = _located(SETTINGS[name], value, file)
    return values


def _located(setting: Setting, value: Any, file: Path) -> Any:
    """Return the value of a setting, with paths relative to the current folder."""
    if setting.kind is Kind.NAMES:
        return [_path(each, file) if _is_path(each, file.parent) else each for each in value]
    if setting.kind is Kind.PATHS:
        return [_path(each, file) for each in value]
    return _path(value, file) if setting.kind is Kind.PATH else value


def _is_path(text: str, folder: Path) -> bool:
    return is_path(text) or ("/" in text and os.path.exists(folder / text))


def _path(text: str, file: Path) -> str:
    """Return a path that is relative to the configuration as one that is relative to the current folder."""
    path = os.path.relpath(file.parent / text)
    return str(file.parent / text) if path.startswith("..") else os.path.join(".", path)
