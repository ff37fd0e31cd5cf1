"""Looks definitions up in every place where they may come from, and suggests similar names where there is none.

Sources are asked in order, and the first that has a package provides all of it: paths given by the user, packages
of the ROS installation (`AMENT_PREFIX_PATH` and the environment that Python runs in), and the embedded store.
"""

from __future__ import annotations

import difflib
import re
from collections import ChainMap
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from typing import cast

from rosidl_adapter_proto.errors import DefinitionError, MissingDefinitionError
from rosidl_adapter_proto.interfaces.description import TypeDescription, describe, structs, type_hash
from rosidl_adapter_proto.interfaces.find import Definition, Package, Source
from rosidl_adapter_proto.interfaces.model import NAMESPACES, Message, TypeName

_DERIVED = re.compile(
    r"(_SendGoal|_GetResult)?_(Request|Response|Event|Goal|Result|Feedback)$"
    r"|_(SendGoal|GetResult|FeedbackMessage)$"
)


@dataclass(frozen=True)
class Catalog:
    """Every place where definitions may come from, in the order they win."""

    sources: tuple[Source, ...]

    @cached_property
    def packages(self) -> Mapping[str, Package]:
        """Every package, from the first source that has it; later ones are not even asked.

        Sources that have single types win before all others.
        """
        partial = [each.packages for each in self.sources if each.is_partial]
        whole = [cast("dict[str, Package]", each.packages) for each in self.sources if not each.is_partial]
        completed: dict[str, dict[TypeName, Definition]] = {}
        for name in dict.fromkeys(chain.from_iterable(partial)):
            for packages in (*partial, ChainMap(*whole)):
                for type_name, definition in packages.get(name, {}).items():
                    completed.setdefault(name, {}).setdefault(type_name, definition)
        return ChainMap(cast("dict[str, Package]", completed), *whole)

    def package(self, name: str) -> Package:
        """Return the definitions of a package.

        Raises:
            DefinitionError: No source has it; the message names similar ones and where was looked.
        """
        if name not in self.packages:
            raise MissingDefinitionError(
                f"package {name!r} was not found{near_misses(name, self.packages)}; {self.places()}"
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
            hint = f"; {others[0]} has it, but comes later" if others else near_types(str(name), package)
            raise MissingDefinitionError(
                f"type {str(name)!r} was not found in package {name.package!r} of {origin}{hint}"
            )
        return package[owner]

    def owner(self, name: TypeName) -> TypeName | None:
        """Return the interface that `name` is, or is a part of; None if there is none."""
        package = self.packages.get(name.package, {})
        if name in package:
            return name
        base = interface_base(name)
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

    def type_name(self, text: str) -> TypeName:
        """Return the type that `pkg/Name` or `pkg/msg/Name` means: an interface, or a part of one as `pkg/X_Request`.

        Raises:
            DefinitionError: There is none, or the short form could mean several.
        """
        package, _, rest = text.partition("/")
        if "/" in rest:
            try:
                name = TypeName.parse(text)
            except ValueError as error:
                raise DefinitionError(str(error)) from None
            self.definition(name)
            return name
        self.package(package)
        names = [TypeName(package, namespace, rest) for namespace in NAMESPACES]
        candidates = [each for each in names if self.owner(each)]
        if len(candidates) > 1:
            raise DefinitionError(
                f"{text!r} could be any of {', '.join(map(str, candidates))}; give the full name"
            )
        name = candidates[0] if candidates else TypeName(package, "msg", rest)
        self.definition(name)
        return name

    def interface_name(self, text: str) -> TypeName:
        """Return the interface that has the type which a text means; errors are those of `type_name`."""
        return self.definition_name(self.type_name(text))

    def shadowed(self, names: Iterable[TypeName]) -> Iterator[tuple[Definition, Definition]]:
        """Yield what wins and what loses where two sources define one of `names` differently.

        The embedded store only stands in for packages that are nowhere else: it takes no part.
        """
        sources = [source for source in self.sources if not source.stands_in]
        for name in names:
            winner = self.definition(name)
            for source in sources:
                loser = source.packages.get(name.package, {}).get(name)
                if loser is None or loser.file == winner.file:
                    continue
                if not _is_same(winner, loser):
                    yield winner, loser

    def places(self) -> str:
        """Say where was looked."""
        places = (f"{each.origin} ({each.limit})" if each.limit else each.origin for each in self.sources)
        return "looked in " + ", ".join(places)


def interface_base(name: TypeName) -> TypeName:
    """Return the service or action that a name belongs to if it is one of a part; any other name as it is."""
    return name if name.namespace == "msg" else replace(name, name=_DERIVED.sub("", name.name))


def _is_same(one: Definition, other: Definition) -> bool:
    try:
        return one.text == other.text or one.interface == other.interface
    except DefinitionError:
        return False


def near_types(name: str, package: Package) -> str:
    """Suggest types of a package by their last name alone: all else is alike, and would make everything similar."""
    by_last_name: dict[str, str] = {each.name: str(each) for each in package}
    return near_misses(name.rpartition("/")[2], by_last_name, by_last_name)


def near_misses(name: str, known: Iterable[str], shown: Mapping[str, str] | None = None) -> str:
    by_lower = {each.lower(): each for each in known}
    near = [by_lower[each] for each in difflib.get_close_matches(name.lower(), by_lower, n=3)]
    words = " or ".join(shown[each] if shown else each for each in near)
    return f"; did you mean {words}?" if near else ""
