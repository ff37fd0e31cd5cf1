"""The ament index resource `rosidl_proto`: says of which packages protobuf types and adapters are installed.

Every generated package has one, a small JSON file `share/ament_index/resource_index/rosidl_proto/<package>` in the
prefix that it is installed to. Build hooks look there for what they need not generate again. An empty file says that a
package was built without protobuf types, since they could not be made.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rosidl_adapter_proto.errors import GenerateError
from rosidl_adapter_proto.generate.manifest import digest
from rosidl_adapter_proto.generate.settings import Options
from rosidl_adapter_proto.generate.targets import Files, Generation
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.model import TypeName

PLACE = "share/ament_index/resource_index"
"""Where the ament index is in a prefix."""
RESOURCE_TYPE = "rosidl_proto"
RESOURCE_FOLDER = f"{PLACE}/{RESOURCE_TYPE}"


@dataclass(frozen=True)
class GeneratedPackage:
    """What was generated of a package, and how.

    Attributes:
        interfaces: The number of its interfaces.
        definitions: A digest of their definitions.
        options: The options that change the output.
    """

    interfaces: int
    definitions: str
    options: Mapping[str, Any]

    def to_json(self) -> bytes:
        """Return the content of the resource."""
        facts = {"interfaces": self.interfaces, "definitions": self.definitions, **self.options}
        return (json.dumps(facts, indent=1) + "\n").encode()

    @classmethod
    def from_json(cls, content: bytes) -> GeneratedPackage:
        """Return what a resource says.

        Raises:
            ValueError: It is none, or one of a newer version.
        """
        facts = json.loads(content)
        if not isinstance(facts, dict):
            raise ValueError("it is not a JSON object")
        # A version that did not have an option yet made what its default makes.
        facts = {**Options().changing_output(), **facts}
        try:
            interfaces, definitions = facts.pop("interfaces"), facts.pop("definitions")
        except KeyError as error:
            raise ValueError(f"{error} is missing") from None
        options = {name: facts.pop(name) for name in Options().changing_output()}
        if facts:
            raise ValueError(f"it has {', '.join(map(repr, facts))}, which only a newer version knows")
        return cls(interfaces, definitions, options)


@dataclass(frozen=True)
class InstalledPackage:
    """A generated package, and the prefix that it is installed to."""

    prefix: Path
    generated: GeneratedPackage


def generated_packages(
    names: Iterable[TypeName], catalog: Catalog, options: Options
) -> dict[str, GeneratedPackage]:
    """Return what is generated of each package when `names` are."""
    by_package: dict[str, list[TypeName]] = {}
    for name in sorted(names):
        by_package.setdefault(name.package, []).append(name)
    return {
        package: GeneratedPackage(
            len(interfaces),
            digest(
                "".join(f"{each}\n{_essence(catalog.definition(each).text)}" for each in interfaces).encode()
            ),
            options.changing_output(),
        )
        for package, interfaces in by_package.items()
    }


def resource_files(generation: Generation) -> Files:
    """Return the resource of each package that is generated."""
    names = (file.source.name for file in generation.files)
    packages = generated_packages(names, generation.catalog, generation.options)
    return {f"{RESOURCE_TYPE}/{name}": each.to_json() for name, each in packages.items()}


def _essence(text: str) -> str:
    """Return a definition without what makes no difference: empty lines, and spaces at the ends of lines."""
    return "".join(f"{line.rstrip()}\n" for line in text.splitlines() if line.strip())


def installed_package(prefix: Path, name: str) -> GeneratedPackage | None:
    """Return what is installed of a package in a prefix; None if nothing is.

    Raises:
        GenerateError: The resource is damaged, or of another version of this program.
    """
    content = _resource(prefix, name)
    if not content:
        return None
    try:
        return GeneratedPackage.from_json(content)
    except ValueError as error:
        raise _unreadable(prefix, name, error) from None


def is_skipped(prefix: Path, name: str) -> bool:
    """Tell whether a package in a prefix was built without protobuf types, since they could not be made.

    Raises:
        GenerateError: The resource cannot be read.
    """
    return _resource(prefix, name) == b""


def _resource(prefix: Path, name: str) -> bytes | None:
    try:
        return (prefix / RESOURCE_FOLDER / name).read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise _unreadable(prefix, name, error) from None


def _unreadable(prefix: Path, name: str, error: Exception) -> GenerateError:
    return GenerateError(
        f"{prefix / RESOURCE_FOLDER / name} is not a resource that this version of rosidl-proto reads ({error}); "
        "install its package again, or remove the file"
    )


def _resources(folder: Path) -> list[str]:
    try:
        return sorted(os.listdir(folder))
    except (FileNotFoundError, NotADirectoryError):
        return []
    except OSError as error:
        raise GenerateError(
            f"cannot read {folder}: {error.strerror}; take its prefix off AMENT_PREFIX_PATH"
        ) from None


def installed_packages(prefixes: Iterable[Path]) -> Mapping[str, InstalledPackage]:
    """Return every package that is installed, from the first prefix that has it; errors as of `installed_package`."""
    found: dict[str, InstalledPackage] = {}
    for prefix in prefixes:
        for name in _resources(prefix / RESOURCE_FOLDER):
            package = installed_package(prefix, name)
            if package is not None:
                found.setdefault(name, InstalledPackage(prefix, package))
    return found
