"""Messages of bags as JSON (https://protobuf.dev/programming-guides/json/), with the names of ROS."""

from __future__ import annotations

import inspect
import json
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

from google.protobuf import json_format
from google.protobuf.descriptor import Descriptor

from rosidl_adapter_proto.bags.message import BagMessage
from rosidl_adapter_proto.errors import BagError

# Fields that are 0 or empty are printed too; protobuf 26 has another name for that.
_ARGUMENTS = ("always_print_fields_with_no_presence", "including_default_value_fields")
_PRINT_ALL: dict[str, Any] = {
    name: True for name in _ARGUMENTS if name in inspect.signature(json_format.MessageToDict).parameters
}

Chosen = Mapping[str, Any]
"""Chosen fields by their names, and in messages those of them; none means all of it."""


ALL: Chosen = MappingProxyType({})


def chosen_fields(fields: Iterable[str]) -> Chosen:
    """Return chosen fields, such as `header.stamp`, as a tree."""
    tree: dict[str, Any] = {}
    for path in sorted(fields):  # a message that is chosen itself comes before fields in it
        place = tree
        *outer, last = path.split(".")
        for name in outer:
            if place.get(name) == {}:
                break
            place = place.setdefault(name, {})
        else:
            place[last] = {}
    return tree


def message_json(recorded: BagMessage, chosen: Chosen = ALL) -> str:
    """Return a message as a line of JSON, with its topic and its times.

    Args:
        recorded: The message.
        chosen: The fields of it to have.

    Raises:
        BagError: The message is not valid.
    """
    try:
        message = json_format.MessageToDict(recorded.message, preserving_proto_field_name=True, **_PRINT_ALL)
    except (
        json_format.Error,
        TypeError,
        ValueError,
    ) as error:  # such as an Any of a type that is not in the bag
        where = f"a message of {recorded.topic}, recorded at {recorded.log_time}"
        raise BagError(f"{where}: protobuf cannot write it as JSON: {error}") from None
    line = {
        "topic": recorded.topic,
        "log_time": recorded.log_time,
        "publish_time": recorded.publish_time,
        "sequence": recorded.sequence,
        "message": _choose(message, recorded.message.DESCRIPTOR, chosen),
    }
    return json.dumps(line)


def _choose(value: Any, descriptor: Descriptor | None, chosen: Chosen) -> Any:
    """Return chosen fields of the JSON of a message, or all, in the order of the definition."""
    if isinstance(value, list):
        return [_choose(each, descriptor, chosen) for each in value]
    if not isinstance(value, dict) or descriptor is None:
        return value
    fields = {field.name: field for field in descriptor.fields}
    names = [name for name in fields if name in value and (not chosen or name in chosen)]
    # Whatever else there is comes from protobuf's own types, such as maps.
    others = [] if chosen else [name for name in value if name not in fields]
    return {
        name: _choose(
            value[name], fields[name].message_type if name in fields else None, chosen.get(name, {})
        )
        for name in (*names, *others)
    }
