"""The contract with generated code, which outlives the version of this project that made it.

Generated modules import what `rosidl_adapter_proto.adapter.__all__` lists, and each states the version of that which it
needs. What is listed is only ever added to, with a new version, for as long as the versions before it are served.
"""

from __future__ import annotations

import sys
from typing import Any

from rosidl_adapter_proto.adapter.loading import descriptor_modules

CONTRACT_VERSION = 1
"""What modules that are generated now need; modules of version 0 state none."""

SERVED_VERSIONS = range(CONTRACT_VERSION + 1)

RESERVED_NAMES = frozenset(
    {
        "codec",
        "convert_to_custom",
        "convert_to_ros_message",
        "custom_type",
        "defaults",
        "fields",
        "fill_custom",
        "fill_ros_message",
        "from_cdr",
        "has_defaults",
        "mro",  # of every class
        "new",
        "ros_class",
        "ros_message_type",
        "to_cdr",
        "transcoder",
        "type_description",
        "type_hash",
        "type_name",
    }
)
"""The attributes of an adapter class, which no constant of a message can be called; nor what begins with `_`."""


def constant_name(name: str) -> str:
    """Return the attribute that a constant of a message is called; an `.idl` may give it a name that is taken."""
    return f"{name}_" if name in RESERVED_NAMES else name


_stated: set[str] = set()


def require_contract(version: int, module: str) -> None:
    """State that a generated module needs a version of the contract.

    Args:
        version: The version.
        module: The name of the module.

    Raises:
        ImportError: It is not served here.
    """
    if version not in SERVED_VERSIONS:
        raise ImportError(
            f"{module} needs contract version {version}, and the installed rosidl-adapter-proto serves "
            f"{SERVED_VERSIONS[0]} to {SERVED_VERSIONS[-1]}; upgrade rosidl-adapter-proto, "
            "or generate the module again with the installed one",
            name=module,
        )
    _stated.add(module)


def is_generated(function: Any) -> bool:
    """Return whether a function stands in a generated module, or in this package."""
    module = str(getattr(function, "__module__", None))
    if module in _stated or module.startswith("rosidl_adapter_proto."):
        return True
    # In version 0: `<Name>_adapter`, beside a `<Name>_pb2` that has brought a descriptor.
    messages = sys.modules.get(f"{module.removesuffix('_adapter')}_pb2")
    return getattr(messages, "__file__", None) in descriptor_modules
