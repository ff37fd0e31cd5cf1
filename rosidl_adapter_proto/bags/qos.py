"""QoS profiles in bags: a YAML list, whose policies are numbers or names.

rosbag2 writes numbers up to version 8 of the metadata and names from version 9, in the metadata, in the topics of
sqlite3 and in the channels of MCAP alike, and reads only the one that belongs to the version that a file states. Here
they are always numbers, which every rosbag2 since Humble reads (`rosbag2_storage/qos.cpp`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from rosidl_adapter_proto.bags.yaml_text import Node, read_yaml
from rosidl_adapter_proto.errors import BagError

# rmw/types.h: the place of a name is its number.
_POLICIES: Mapping[str, tuple[str, ...]] = {
    "history": ("system_default", "keep_last", "keep_all", "unknown"),
    "reliability": ("system_default", "reliable", "best_effort", "unknown", "best_available"),
    "durability": ("system_default", "transient_local", "volatile", "unknown", "best_available"),
    "liveliness": (
        "system_default",
        "automatic",
        "manual_by_node",
        "manual_by_topic",
        "unknown",
        "best_available",
    ),
}
_ORDER = (
    "history",
    "depth",
    "reliability",
    "durability",
    "deadline",
    "lifespan",
    "liveliness",
    "liveliness_lease_duration",
    "avoid_ros_namespace_conventions",
    "sec",
    "nsec",
)
_SCALAR = re.compile(r"[\w.+-]+", re.ASCII)


def numbered_qos(text: str) -> str:
    """Return QoS profiles with numbers for names, spelled as rosbag2 does; what is no QoS is kept as it is."""
    if not text:
        return text
    try:
        return qos_text(read_yaml(text, "offered_qos_profiles"), "offered_qos_profiles")
    except BagError:
        return text


def qos_text(profiles: Node, where: str) -> str:
    """Return the text of QoS profiles, as rosbag2 writes it in metadata of version 8.

    Args:
        profiles: The list of them.
        where: Where it stands, for people.

    Raises:
        BagError: It is no list of profiles.
    """
    if not isinstance(profiles, list):
        raise BagError(f"{where}: expected a list of QoS profiles")
    return "\n".join(_profile(profile, f"{where}[{index}]") for index, profile in enumerate(profiles))


def _profile(profile: Node, where: str) -> str:
    if not isinstance(profile, dict) or not profile:
        raise BagError(f"{where}: expected a QoS profile, as names and values")
    lines: list[str] = []
    for name, value in _in_order(profile):
        if isinstance(value, dict):
            lines.append(f"{name}:")
            lines += [
                f"  {part}: {_scalar(part, number, f'{where}.{name}')}" for part, number in _in_order(value)
            ]
        else:
            lines.append(f"{name}: {_scalar(name, value, where)}")
    return "- " + "\n  ".join(lines)


def _in_order(values: dict[str, Node]) -> list[tuple[str, Node]]:
    return sorted(
        values.items(), key=lambda item: _ORDER.index(item[0]) if item[0] in _ORDER else len(_ORDER)
    )


def _scalar(name: str, value: Node, where: str) -> str:
    if not isinstance(value, str) or not _SCALAR.fullmatch(value) or not _SCALAR.fullmatch(name):
        raise BagError(f"{where}: {name!r} is neither a number nor a name")
    names = _POLICIES.get(name, ())
    return str(names.index(value)) if value in names else value
