"""Everything that can be set, one row each: how to generate (`Options`), and what else commands take.

Configuration files, the command line, the build hooks, the fingerprint of an output folder and the ament index derive
from these rows. A new option is one field of `Options`.
"""

from __future__ import annotations

import configparser
import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from rosidl_adapter_proto.schema.numbering import LOCK_FILE_NAME, HashNumbering, SequentialNumbering
from rosidl_adapter_proto.schema.typemap import DEFAULT_PYTHON_ROOT


class Kind(Enum):
    """What a setting is."""

    FLAG = "flag"
    TEXT = "text"
    PATH = "path"
    NAMES = "names"
    PATHS = "paths"


_KIND_TEXTS = {
    Kind.FLAG: "true or false",
    Kind.TEXT: "a string",
    Kind.PATH: "a string",
    Kind.NAMES: "a list of strings",
    Kind.PATHS: "a list of strings",
}


@dataclass(frozen=True)
class Setting:
    """One thing that can be set.

    Attributes:
        name: Its name in files and on the command line.
        kind: What its value is.
        help: What it is for.
        default: Its value if nothing sets it; None if that depends on the run.
        choices: The values that it can have, if not all of its kind.
        metavar: What help texts call its value.
        short: Its option of one letter.
        is_for_schema: Whether it says how `.proto` files are made.
        changes_output: Whether other values make other files.
    """

    name: str
    kind: Kind
    help: str
    default: Any = None
    choices: tuple[str, ...] = ()
    metavar: str | None = None
    short: str | None = None
    is_for_schema: bool = False
    changes_output: bool = False

    @property
    def attribute(self) -> str:
        """Its name in Python."""
        return self.name.replace("-", "_")

    def from_text(self, text: str) -> Any:
        """Return what a text stands for where there are only texts, yet to be checked; lists have an entry a line."""
        if self.kind in (Kind.NAMES, Kind.PATHS):
            return [line.strip() for line in text.replace(",", "\n").splitlines() if line.strip()]
        if self.kind is Kind.FLAG:
            return configparser.ConfigParser.BOOLEAN_STATES.get(text.lower(), text)
        return text

    def check(self, value: Any) -> None:
        """Check a value; paths are strings.

        Raises:
            ValueError: It is of another kind, or none of the choices.
        """
        if self.kind in (Kind.NAMES, Kind.PATHS):
            fits = isinstance(value, list) and all(isinstance(each, str) for each in value)
        else:
            fits = isinstance(value, bool if self.kind is Kind.FLAG else str)
        if not fits:
            raise ValueError(f"must be {_KIND_TEXTS[self.kind]}")
        if self.choices and value not in self.choices:
            raise ValueError(f"must be {' or '.join(map(repr, self.choices))}, not {value!r}")


def _option(kind: Kind, help: str, *, default: Any, changes_output: bool = True, **facts: Any) -> Any:
    row = {"kind": kind, "help": help, "default": default, "changes_output": changes_output, **facts}
    return dataclasses.field(default=default, metadata=row)


@dataclass(frozen=True, kw_only=True)
class Options:
    """How to generate: the default of each option, and the other facts of its `Setting`."""

    numbering: str = _option(
        Kind.TEXT,
        "How fields are numbered: from a hash of their names, or in sequence with a lock file.",
        default=HashNumbering.name,
        choices=(HashNumbering.name, SequentialNumbering.name),
        is_for_schema=True,
    )
    lock_file: Path = _option(
        Kind.PATH,
        "Where sequential numbers are kept; commit it. Only with sequential numbering.",
        default=Path(LOCK_FILE_NAME),
        is_for_schema=True,
        changes_output=False,  # what is in it does
    )
    events: bool = _option(
        Kind.FLAG,
        "Include the _Event messages of service introspection.",
        default=False,
        is_for_schema=True,
    )
    python_root: str = _option(
        Kind.TEXT,
        "The namespace package of the generated Python packages.",
        default=DEFAULT_PYTHON_ROOT,
        metavar="NAME",
    )

    @classmethod
    def of(cls, settings: Mapping[str, Any]) -> Options:
        """Return options from settings by name; those that are missing have their defaults."""
        values: dict[str, Any] = {}
        for each in OPTIONS:
            if each.name in settings:
                value = settings[each.name]
                values[each.attribute] = Path(value) if each.kind is Kind.PATH else value
        return cls(**values)

    def changing_output(self) -> dict[str, Any]:
        """Return the options that other files would be made with, by attribute."""
        return {each.attribute: getattr(self, each.attribute) for each in OPTIONS if each.changes_output}


def check_lock_file_is_used(numbering: str) -> None:
    """Check that there is a use for a lock file that was given: passing over it would make other numbers.

    Args:
        numbering: The numbering that it was given with.

    Raises:
        ValueError: That has no lock file.
    """
    if numbering != SequentialNumbering.name:
        raise ValueError(
            f"is for numbering {SequentialNumbering.name!r}, and numbering is {numbering!r}; "
            "set that numbering as well, or leave the lock file out"
        )


OPTIONS = tuple(Setting(each.name.replace("_", "-"), **each.metadata) for each in dataclasses.fields(Options))
"""A row for each option, in order."""

SETTINGS = {
    each.name: each
    for each in (
        Setting("packages", Kind.NAMES, "What to generate."),
        Setting(
            "output",
            Kind.PATH,
            "The folder to write. It holds what the last run made, and nothing older.",
            default=Path("generated"),
            short="o",
        ),
        Setting("deps", Kind.FLAG, "Generate the packages that WHAT depends on, too.", default=True),
        *OPTIONS,
        Setting(
            "include",
            Kind.PATHS,
            "A package folder, or a folder of packages, to find definitions in. May be repeated.",
            short="I",
        ),
        Setting(
            "distro",
            Kind.TEXT,
            "The ROS distribution whose embedded definitions stand in for packages found nowhere else "
            "(default: $ROS_DISTRO, else the newest).",
            metavar="NAME",
        ),
    )
}
"""Every setting of a configuration, by name."""
