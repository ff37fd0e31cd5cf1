"""ROS 2's own way from `.msg`, `.srv` and `.action` to the model: `rosidl_adapter` and `rosidl_parser`."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from rosidl_adapter_proto.interfaces.model import (
    Action,
    BasicType,
    Interface,
    Message,
    Service,
    TypeName,
    Value,
    value_type,
)
from tests import oracle


def official(text: str, name: TypeName, folder: Path) -> Interface | None:
    """Return what ROS 2's tools read from a definition, or None if they refuse it; without them, skip the test.

    Args:
        text: The definition.
        name: What it defines; its namespace says how it is written.
        folder: An empty folder to work in.
    """
    adapter = pytest.importorskip("rosidl_adapter", reason="needs rosidl_adapter, from the ROS wheels")
    file = Path(name.namespace, f"{name.name}.{name.namespace}")
    (folder / file).parent.mkdir(parents=True, exist_ok=True)
    (folder / file).write_bytes(text.encode())
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the tools' own, about escape sequences
            adapter.convert_to_idl(folder, name.package, file, folder)
            idl = (folder / file).with_suffix(".idl").read_text("utf-8")
            interface = oracle.parse_idl_with_rosidl(idl)
    except (
        Exception,
        SystemExit,
    ):  # they have no exception of their own, and templates that fail end the program
        return None
    # The .idl does not have the units of constants.
    units = _constant_units(text, name)
    return _with_messages(interface, [_with_units(each, units) for each in parts(interface)])


def parts(interface: Interface) -> list[Message]:
    """Return the messages that a definition spells out."""
    if isinstance(interface, Message):
        return [interface]
    if isinstance(interface, Service):
        return [interface.request, interface.response]
    return [interface.goal, interface.result, interface.feedback]


def facts(interface: Interface) -> list[object]:
    """Return all that a definition says, comments and units of fields and constants included, to be compared.

    Values are given as text, in which `1`, `1.0` and `True` differ, and NaN equals itself.
    """
    return [
        (
            str(message.name),
            [(f.name, f.type, _shown(f.default, f.type), f.comment, f.unit) for f in message.fields],
            [(c.name, c.type, _shown(c.value, c.type), c.comment, c.unit) for c in message.constants],
        )
        for message in parts(interface)
    ]


def _shown(value: Value | None, type_: Any) -> str:
    element = value_type(type_)
    if isinstance(element, BasicType) and element.name in ("float", "double") and value in ("inf", "nan"):
        return repr(float(str(value)))  # the names by which .idl has them
    return repr(value)


def _constant_units(text: str, name: TypeName) -> dict[tuple[str, str], str]:
    parser = pytest.importorskip("rosidl_adapter.parser")
    parse = {
        "msg": parser.parse_message_string,
        "srv": parser.parse_service_string,
        "action": parser.parse_action_string,
    }[name.namespace]
    found = parse(name.package, name.name, text)
    messages = {
        "msg": lambda: [found],
        "srv": lambda: [found.request, found.response],
        "action": lambda: [found.goal, found.result, found.feedback],
    }[name.namespace]()
    return {
        (message.msg_name, constant.name): constant.annotations["unit"]
        for message in messages
        for constant in message.constants
        if "unit" in constant.annotations
    }


def _with_units(message: Message, units: dict[tuple[str, str], str]) -> Message:
    constants = (replace(each, unit=units.get((message.name.name, each.name))) for each in message.constants)
    return replace(message, constants=tuple(constants))


def _with_messages(interface: Interface, messages: list[Message]) -> Interface:
    if isinstance(interface, Message):
        return messages[0]
    if isinstance(interface, Service):
        request, response = messages
        return Service(interface.name, request, response)
    goal, result, feedback = messages
    return Action(interface.name, goal, result, feedback)
