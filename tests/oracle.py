"""ROS 2's own parsers as the test oracle: what `rosidl_parser` reads, in the form of the project's model."""

from __future__ import annotations

import ast
import sys
from pathlib import Path
from typing import Any

import pytest

from rosidl_adapter_proto.interfaces.model import (
    Action,
    Annotation,
    ArrayType,
    BasicType,
    Constant,
    Field,
    FieldType,
    Interface,
    Message,
    SequenceType,
    Service,
    StringType,
    TypeName,
    ValueType,
    value_type,
)


def installed_definitions(suffix: str) -> list[Path]:
    """Return every interface definition of one kind, such as `.idl`, in the running Python environment."""
    return sorted(
        path
        for namespace in ("msg", "srv", "action")
        for path in Path(sys.prefix, "share").glob(f"*/{namespace}/*{suffix}")
    )


def type_name(path: Path) -> TypeName:
    """Return what the place of a definition says that it defines."""
    return TypeName(path.parts[-3], path.parts[-2], path.stem)


def parse_idl_with_rosidl(text: str) -> Interface:
    """Return what `rosidl_parser` reads from the text of an .idl file; without it, skip the test."""
    parser = pytest.importorskip("rosidl_parser.parser", reason="needs rosidl_parser, from the ROS wheels")
    definition = pytest.importorskip("rosidl_parser.definition")
    elements = parser.parse_idl_string(text).elements
    return _interface(next(each for each in elements if not isinstance(each, definition.Include)))


def _interface(found: Any) -> Interface:
    if type(found).__name__ == "Message":
        return _message(found)
    if type(found).__name__ == "Service":
        request, response = _message(found.request_message), _message(found.response_message)
        return Service(_named_type(found.namespaced_type), request, response)
    goal, result, feedback = (_message(each) for each in (found.goal, found.result, found.feedback))
    return Action(_named_type(found.namespaced_type), goal, result, feedback)


def _message(found: Any) -> Message:
    return Message(
        _named_type(found.structure.namespaced_type),
        tuple(_field(each) for each in found.structure.members),
        tuple(_constant(each) for each in found.constants),
        tuple(found.structure.get_comment_lines()),
        _annotations(found.structure),
    )


def _constant(found: Any) -> Constant:
    # `rosidl_parser` takes the length of a constant's value for a bound.
    constant_type = value_type(_type(found.type))
    assert isinstance(constant_type, (BasicType, StringType))
    if isinstance(constant_type, StringType):
        constant_type = StringType(constant_type.wide)
    return Constant(found.name, constant_type, found.value, tuple(found.get_comment_lines()), _unit(found))


def _field(found: Any) -> Field:
    field_type = _type(found.type)
    default = found.get_annotation_value("default")["value"] if found.has_annotation("default") else None
    if default is not None and isinstance(field_type, (ArrayType, SequenceType)):
        default = ast.literal_eval(default)
    comment = tuple(found.get_comment_lines())
    return Field(found.name, field_type, default, comment, _unit(found), _annotations(found))


def _unit(found: Any) -> str | None:
    return found.get_annotation_value("unit")["value"] if found.has_annotation("unit") else None


def _annotations(found: Any) -> tuple[Annotation, ...]:
    annotations = (Annotation(each.name, _parameters(each.value)) for each in found.annotations)
    return tuple(
        each
        for each in annotations
        if each.name not in ("default", "unit") and ("language", "comment") not in each.parameters
    )


def _parameters(value: Any) -> tuple[tuple[str, Any], ...]:
    if value is None:
        return ()
    return tuple(value.items()) if isinstance(value, dict) else (("value", value),)


def _named_type(found: Any) -> TypeName:
    package, namespace = found.namespaces
    return TypeName(package, namespace, found.name)


def _type(found: Any) -> FieldType:
    kind = type(found).__name__
    if kind == "Array":
        return ArrayType(_value_type(found.value_type), found.size)
    if kind in ("BoundedSequence", "UnboundedSequence"):
        return SequenceType(_value_type(found.value_type), getattr(found, "maximum_size", None))
    return _value_type(found)


def _value_type(found: Any) -> ValueType:
    kind = type(found).__name__
    if kind == "BasicType":
        return BasicType(found.typename)
    if kind == "NamespacedType":
        return _named_type(found)
    assert kind.endswith("String"), f"{kind} {getattr(found, 'name', '')} was not resolved"
    return StringType("WString" in kind, getattr(found, "maximum_size", None))
