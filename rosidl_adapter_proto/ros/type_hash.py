"""Compares the type that an adapter was generated for with the type that is installed (REP-2011, "Type Version Hash").

Nothing else would: DDS connects endpoints by the name of their type, and reads the bytes of another version wrongly.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rclpy.exceptions import InvalidHandle

from rosidl_adapter_proto.errors import Error

if TYPE_CHECKING:
    from rclpy.impl.rcutils_logger import RcutilsLogger
    from rclpy.node import Node


class TypeHashError(Error):
    """An adapter was generated for another version of a type than the one that is installed."""


def check_type_hash(adapter: Any, ros_type: Any, logger: RcutilsLogger) -> None:
    """Check that an adapter fits the installed ROS type.

    The hash of the installed type is read from the type description that ROS installs for it, in
    `share/<package>/<namespace>/<Name>.json` of the prefix that the Python class was imported from. Without that file
    a warning is logged, and nothing is checked. Adapters without `type_hash`, written by hand, are not checked.

    Args:
        adapter: Adapter of a message, service or action.
        ros_type: The ROS class that it converts to.
        logger: Is told of a check that cannot be done.

    Raises:
        TypeHashError: They differ.
    """
    expected = getattr(adapter, "type_hash", None)
    if expected is None:
        return
    package = ros_type.__module__.partition(".")[0]
    installed, where = _installed_type_hash(adapter.type_name, package)
    if installed is None:
        logger.warning(
            f"cannot check that the adapter of {adapter.type_name} fits the installed type: no type description "
            f"{where} in a folder above the Python package {package}; make sure that both are of one version"
        )
    elif installed != expected:
        raise TypeHashError(
            f"{adapter.type_name}: the adapter was generated for the type with hash {expected}, "
            f"but {where} has {installed}; generate it again from what is installed: rosidl-proto generate {package}"
        )


@cache
def _installed_type_hash(type_name: str, package: str) -> tuple[str | None, Path]:
    """Return the hash of an installed type, and the file that has it."""
    namespace, name = type_name.split("/")[-2:]
    folder = Path("share", package, namespace)
    module_file = getattr(sys.modules[package], "__file__", None) or ""
    for prefix in Path(module_file).parents:
        for owner in _possible_owners(name):
            file = prefix / folder / f"{owner}.json"
            try:
                description = json.loads(file.read_bytes())
            except OSError:
                continue
            hashes = {each["type_name"]: each["hash_string"] for each in description["type_hashes"]}
            if type_name in hashes:
                return hashes[type_name], file
    return None, folder / f"{name}.json"


def _possible_owners(name: str) -> Iterator[str]:
    """Yield the interfaces that a type may be, or be a part of: `SetBool_Request` is described with `SetBool`."""
    while name:
        yield name
        name = name.rpartition("_")[0]


def publishers_of_other_versions(node: Node, topic: str, adapter: Any) -> list[str]:
    """Return the publishers of a topic that announce another type hash than an adapter has, for people."""
    type_hash = getattr(adapter, "type_hash", None)
    if type_hash is None:
        return []
    try:
        publishers = node.get_publishers_info_by_topic(node.resolve_topic_name(topic))
    except InvalidHandle:  # the node is being destroyed
        return []
    return [
        f"{info.node_namespace.rstrip('/')}/{info.node_name} ({info.topic_type_hash})"
        for info in publishers
        if str(info.topic_type_hash) not in (type_hash, "INVALID")
    ]
