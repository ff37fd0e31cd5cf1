"""The embedded store: the message definitions of every ROS distribution that the rosbags library carries.

It holds messages only (no services, no actions), without comments and default values.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any

from rosidl_adapter_proto.errors import DefinitionError
from rosidl_adapter_proto.interfaces.model import EMPTY_STRUCT_FIELD, TypeName

_ROS1 = "noetic"


@cache
def distributions() -> tuple[str, ...]:
    """Return the names of the distributions in the store, oldest first: `noetic`, then those of ROS 2."""
    from rosbags.typesys import Stores

    return tuple(
        store.value.partition("_")[2] for store in Stores if store.value.startswith(("ros1_", "ros2_"))
    )


def newest_distribution() -> str:
    """Return the newest distribution in the store."""
    return distributions()[-1]


def check_distribution(distribution: str) -> None:
    """Check that a distribution is in the store.

    Raises:
        DefinitionError: It is not.
    """
    if distribution not in distributions():
        raise DefinitionError(
            f"the embedded store has no distribution {distribution!r}; it has {', '.join(distributions())}"
        )


def definitions(distribution: str) -> dict[TypeName, str]:
    """Return the `.msg` text of every message of a distribution; errors are those of `check_distribution`."""
    check_distribution(distribution)
    from rosbags.typesys import Stores, get_typestore

    generation = "ros1" if distribution == _ROS1 else "ros2"
    types = get_typestore(Stores(f"{generation}_{distribution}")).fielddefs
    return {TypeName.parse(name): _msg_text(constants, fields) for name, (constants, fields) in types.items()}


def is_ros1(distribution: str) -> bool:
    """Tell whether a distribution is one of ROS 1, whose definitions have other rules."""
    return distribution == _ROS1


def _msg_text(constants: Iterable[Any], fields: Iterable[Any]) -> str:
    lines = [f"{type_} {name}={value}" for name, type_, value in constants]
    lines += [f"{_type_text(field)} {name}" for name, field in fields if name != EMPTY_STRUCT_FIELD]
    return "".join(f"{line}\n" for line in lines)


def _type_text(field: Any) -> str:
    from rosbags.interfaces import Nodetype

    kind, detail = field
    if kind is Nodetype.NAME:
        return str(detail).replace("/msg/", "/")
    if kind is Nodetype.BASE:
        name, bound = detail
        return f"{name}<={bound}" if bound else str(name)
    element, size = detail
    if kind is Nodetype.ARRAY:
        return f"{_type_text(element)}[{size}]"
    return f"{_type_text(element)}[{f'<={size}' if size else ''}]"
