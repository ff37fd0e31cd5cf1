"""What annotations say: comments, units, default values, and all others."""

from __future__ import annotations

from typing import NamedTuple

from rosidl_adapter_proto.interfaces.idl.expressions import named_value, parameter_value
from rosidl_adapter_proto.interfaces.idl.file import File, FullName, Node
from rosidl_adapter_proto.interfaces.idl.names import plain_name
from rosidl_adapter_proto.interfaces.model import Annotation, ScalarValue


class Notes(NamedTuple):
    """What the annotations of a definition say; a default value comes with the place where it stands."""

    comment: tuple[str, ...] = ()
    unit: str | None = None
    default: tuple[ScalarValue, Node] | None = None
    others: tuple[Annotation, ...] = ()


def read_notes(file: File, scope: FullName, node: Node, mask: int | None = None) -> Notes:
    """Read the annotations of a definition; `mask` is that of `evaluated`."""
    comment: list[str] = []
    unit: str | None = None
    default: tuple[ScalarValue, Node] | None = None
    others: list[Annotation] = []
    for each in node.children:
        annotation = _annotation(file, scope, each, mask)
        parameters = dict(annotation.parameters)
        if annotation.name == "verbatim" and parameters.get("language") == "comment" and "text" in parameters:
            comment += str(parameters["text"]).splitlines()
        elif annotation.name == "unit" and "value" in parameters:
            unit = str(parameters["value"])
        elif annotation.name == "default":
            if "value" not in parameters or default:
                raise file.problem("expected one default value: write @default(value=...) once", each)
            default = parameters["value"], each.children[-1]
        else:
            others.append(annotation)
    return Notes(tuple(comment), unit, default, tuple(others))


def _annotation(file: File, scope: FullName, node: Node, mask: int | None) -> Annotation:
    name, *parameters = node.children
    return Annotation(
        "".join(name.children), tuple(_parameter(file, scope, each, mask) for each in parameters)
    )


def _parameter(file: File, scope: FullName, node: Node, mask: int | None) -> tuple[str, ScalarValue]:
    """Return the name and value of a parameter; a name that is no constant, as `FINAL` may be, is text."""
    name, expression = ("value", node) if node.data == "const_expr" else node.children
    single = expression.children[0] if len(expression.children) == 1 else None
    if not isinstance(single, str) and single is not None and single.data == "scoped_name":
        value = named_value(file, scope, single)
        return plain_name(name), "".join(single.children) if value is None else value
    return plain_name(name), parameter_value(file, scope, expression, mask)
