"""What a set of interfaces depends on."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping

from rosidl_adapter_proto.errors import DefinitionError, MissingDefinitionError
from rosidl_adapter_proto.interfaces.catalog import Catalog, near_misses, near_types
from rosidl_adapter_proto.interfaces.model import Interface, Message, TypeName, messages, references


def closure(
    catalog: Catalog, packages: Iterable[str], types: Iterable[TypeName] = (), *, events: bool = False
) -> list[TypeName]:
    """Return every interface to generate for a request, dependencies first.

    A package that is asked for, or that something refers to, comes whole. Of a package that only single types were
    asked of, these come with what they refer to.

    Args:
        catalog: Where to look.
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
    queue = [name for package in whole for name in catalog.package(package)]
    queue += [catalog.definition(name).name for name in single]
    complete = set(whole)
    while queue:
        _order_by_need(queue, _interface_needs(catalog, events, missing), order)
        needed_packages = {name.package for name in order} - complete - partial
        complete |= needed_packages
        queue = [name for package in sorted(needed_packages) for name in catalog.package(package)]
    if missing:
        raise _missing_error(catalog, missing)
    return list(order)


def type_closure(catalog: Catalog, name: TypeName, *, events: bool = False) -> list[TypeName]:
    """Return an interface and every one that it refers to, dependencies first.

    Args:
        catalog: Where to look.
        name: The interface, or a part of it.
        events: Whether services have their `_Event` messages.

    Raises:
        DefinitionError: A type is missing (all of them are named), or messages contain each other.
    """
    order: dict[TypeName, None] = {}
    missing: dict[str, list[str]] = {}
    _order_by_need([catalog.definition_name(name)], _interface_needs(catalog, events, missing), order)
    if missing:
        raise _missing_error(catalog, missing)
    return list(order)


_Needs = Callable[[TypeName], Iterator[tuple[TypeName, str]]]
"""Gives each type that one needs, and the field that does."""


def _interface_needs(catalog: Catalog, events: bool, missing: dict[str, list[str]]) -> _Needs:
    """Return what gives the interfaces that one needs, and adds those that there are not to `missing`."""

    def needs(name: TypeName) -> Iterator[tuple[TypeName, str]]:
        for needed, user in _needs(catalog.definition(name).interface, events):
            owner = catalog.owner(needed)
            if owner is None:
                missing.setdefault(str(needed), []).append(user)
            else:
                yield owner, user

    return needs


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


def _order_by_need(names: Iterable[TypeName], needs: _Needs, order: dict[TypeName, None]) -> None:
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


def _missing_error(catalog: Catalog, missing: Mapping[str, list[str]]) -> DefinitionError:
    lines = []
    for name, users in missing.items():
        more = f" and {len(users) - 1} more" if len(users) > 1 else ""
        package = name.partition("/")[0]
        if package in catalog.packages:
            near = near_types(name, catalog.packages[package])
        else:
            near = near_misses(package, catalog.packages)
        lines.append(f"{name} was not found, but {users[0]}{more} need{'' if more else 's'} it{near}")
    return MissingDefinitionError("\n".join([*lines, catalog.places()]))
