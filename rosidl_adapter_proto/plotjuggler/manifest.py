"""The manifest of a plugin of PlotJuggler 3: YAML, which `pj_plugin_manifest` returns.

It is what PlotJuggler's page on WebAssembly plugins describes, with its widgets for parameters. The released program
reads it without YAML: `released_members` does as it does.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias

from rosidl_adapter_proto.bags.yaml_text import Node, read_yaml
from rosidl_adapter_proto.errors import BagError, PluginError

MAXIMUM_SIZE = 1 << 16
PLUGIN_TYPE = "MessageParser"
_RELEASED_MEMBERS = ("plugin_type", "name", "encoding")
_TEXTS = ("version", "description", "author", "license", "url")
_MAXIMUM_PARAMETERS = 1000
_MAXIMUM_REGEXP = 1000


@dataclass(frozen=True, slots=True)
class Label:
    """A text that is only shown.

    Attributes:
        identifier: What it is called, its `ID`.
        label: The text.
    """

    identifier: str
    label: str


@dataclass(frozen=True, slots=True)
class LineEdit:
    """A text that the user types.

    Attributes:
        identifier: What it is called, its `ID`.
        label: What stands before it.
        default_value: What it is at first.
        description: What it is for.
        regexp_validation: What it must match.
    """

    identifier: str
    label: str
    default_value: str | None
    description: str | None
    regexp_validation: str | None


@dataclass(frozen=True, slots=True)
class SpinBoxInt:
    """An integer that the user chooses.

    Attributes:
        identifier: What it is called, its `ID`.
        label: What stands before it.
        default_value: What it is at first.
        description: What it is for.
        range: The smallest and the largest.
    """

    identifier: str
    label: str
    default_value: int | None
    description: str | None
    range: tuple[int, int] | None


@dataclass(frozen=True, slots=True)
class SpinBoxDouble:
    """A number that the user chooses.

    Attributes:
        identifier: What it is called, its `ID`.
        label: What stands before it.
        default_value: What it is at first.
        description: What it is for.
        range: The smallest and the largest.
    """

    identifier: str
    label: str
    default_value: float | None
    description: str | None
    range: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class CheckBox:
    """Yes or no.

    Attributes:
        identifier: What it is called, its `ID`.
        label: What stands before it, if anything does.
        default_value: What it is at first.
        description: What it is for.
    """

    identifier: str
    label: str | None
    default_value: bool
    description: str | None


@dataclass(frozen=True, slots=True)
class ComboBox:
    """One of several texts.

    Attributes:
        identifier: What it is called, its `ID`.
        label: What stands before it, if anything does.
        values: The texts.
        default_value: Which it is at first.
        description: What it is for.
    """

    identifier: str
    label: str | None
    values: tuple[str, ...]
    default_value: str | None
    description: str | None


Widget: TypeAlias = "Label | LineEdit | SpinBoxInt | SpinBoxDouble | CheckBox | ComboBox"


@dataclass(frozen=True, slots=True)
class Manifest:
    """What a plugin says of itself.

    Attributes:
        name: What it is called.
        encoding: The encoding of the messages that it parses, such as `ros2msg`; several with `;` between them.
        version: Its version; this and what follows may be empty.
        description: What it does.
        author: Who wrote it.
        license: What one may do with it.
        url: Where it comes from.
        parameters: What users can choose.
    """

    plugin_type: ClassVar[str] = PLUGIN_TYPE

    name: str
    encoding: str
    version: str = ""
    description: str = ""
    author: str = ""
    license: str = ""
    url: str = ""
    parameters: tuple[Widget, ...] = ()

    @property
    def encodings(self) -> tuple[str, ...]:
        """The encodings of the messages that it parses."""
        return tuple(each.strip() for each in self.encoding.split(";") if each.strip())


def read_manifest(text: str) -> Manifest:
    """Read a manifest as YAML.

    Args:
        text: What `pj_plugin_manifest` returns.

    Raises:
        PluginError: It breaks a rule; the text says which line or which parameter.
    """
    if len(text) > MAXIMUM_SIZE:
        raise PluginError(f"manifest: {len(text)} characters; at most {MAXIMUM_SIZE} are read")
    try:
        document = read_yaml(text, "manifest")
    except BagError as error:
        raise PluginError(str(error)) from None
    members = _Members(document, "")
    plugin_type = members.text("plugin_type")
    if plugin_type != PLUGIN_TYPE:
        raise members.error("plugin_type", f"{plugin_type!r}; the only one is {PLUGIN_TYPE}")
    name, encoding = members.text("name"), members.text("encoding")
    if not encoding.replace(";", "").strip():
        raise members.error("encoding", "is empty")
    texts: dict[str, Any] = {each: members.optional_text(each) or "" for each in _TEXTS}
    return Manifest(name, encoding, **texts, parameters=_parameters(members))


def _parameters(members: _Members) -> tuple[Widget, ...]:
    found: dict[str, Widget] = {}
    for index, node in enumerate(members.entries("parameters_model")):
        entry = _Members(node, f"parameters_model[{index}]: ")
        identifier = entry.text("ID")
        entry.path = f"parameter {identifier}: "
        kind = entry.text("type")
        if kind not in _WIDGETS:
            raise entry.error("type", f"{kind!r} is none of {', '.join(_WIDGETS)}")
        widget = _WIDGETS[kind](entry)
        entry.refuse_others(kind)
        if identifier in found:
            raise entry.error("ID", "a second parameter of that name")
        found[identifier] = widget
    return tuple(found.values())


def _label(entry: _Members) -> Label:
    return Label(entry.text("ID"), entry.text("label"))


def _line_edit(entry: _Members) -> LineEdit:
    expression = entry.optional_text("regexp_validation")
    if expression is not None:
        if len(expression) > _MAXIMUM_REGEXP:
            raise entry.error("regexp_validation", f"has more than {_MAXIMUM_REGEXP} characters")
        try:
            re.compile(expression)
        except (re.error, OverflowError, RecursionError) as error:
            raise entry.error(
                "regexp_validation", f"{expression!r} is no regular expression: {error}"
            ) from None
    return LineEdit(
        entry.text("ID"),
        entry.text("label"),
        entry.optional_text("default_value"),
        entry.optional_text("description"),
        expression,
    )


def _spin_box(widget: Callable[..., Widget], read: Callable[[str], Any]) -> Callable[[_Members], Widget]:
    def spin_box(entry: _Members) -> Widget:
        default, limits = entry.number_and_range(read)
        return widget(
            entry.text("ID"), entry.text("label"), default, entry.optional_text("description"), limits
        )

    return spin_box


def _check_box(entry: _Members) -> CheckBox:
    text = entry.optional_text("default_value")
    if text is not None and text.lower() not in _BOOLS:
        raise entry.error("default_value", f"{text!r} is neither true nor false")
    return CheckBox(
        entry.text("ID"),
        entry.optional_text("label"),
        text is not None and _BOOLS[text.lower()],
        entry.optional_text("description"),
    )


def _combo_box(entry: _Members) -> ComboBox:
    values = tuple(entry.text("values").split(";"))
    default = entry.optional_text("default_value")
    if default is not None and default not in values:
        raise entry.error("default_value", f"{default!r} is none of {', '.join(values)}")
    return ComboBox(
        entry.text("ID"), entry.optional_text("label"), values, default, entry.optional_text("description")
    )


_BOOLS = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}


def _integer(text: str) -> int:
    value = int(text) if re.fullmatch(r"[+-]?[0-9]{1,10}", text) else 2**31
    if not -(2**31) <= value < 2**31:
        raise ValueError("no integer of 32 bits")
    return value


def _double(text: str) -> float:
    if not re.fullmatch(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]{1,3})?", text):
        raise ValueError("no number")
    return float(text)


_WIDGETS: dict[str, Callable[[_Members], Widget]] = {
    "Label": _label,
    "LineEdit": _line_edit,
    "SpinBoxInt": _spin_box(SpinBoxInt, _integer),
    "SpinBoxDouble": _spin_box(SpinBoxDouble, _double),
    "CheckBox": _check_box,
    "ComboBox": _combo_box,
}


class _Members:
    """The members of a mapping of YAML, taken with the types that they must have.

    Attributes:
        path: Where it is, before the names of members in errors.
    """

    def __init__(self, node: Node, path: str) -> None:
        self.path = path
        self._taken: set[str] = {"type"}
        if not isinstance(node, dict):
            raise PluginError(f"manifest: {path}not members with names")
        self._members = node

    def error(self, name: str, reason: str) -> PluginError:
        return PluginError(f"manifest: {self.path}{name}: {reason}")

    def _take(self, name: str) -> Node | None:
        self._taken.add(name)
        return self._members.get(name)

    def text(self, name: str) -> str:
        value = self.optional_text(name)
        if value is None:
            raise self.error(name, "is missing")
        if not value.strip():
            raise self.error(name, "is empty")
        return value

    def optional_text(self, name: str) -> str | None:
        value = self._take(name)
        if value is not None and not isinstance(value, str):
            raise self.error(name, "is not a single value")
        return value

    def entries(self, name: str) -> list[Node]:
        value = self._take(name)
        if value in (None, ""):  # a name without anything
            return []
        if not isinstance(value, list) or len(value) > _MAXIMUM_PARAMETERS:
            raise self.error(name, f"is not a list of at most {_MAXIMUM_PARAMETERS} parameters")
        return value

    def number_and_range(self, read: Callable[[str], Any]) -> tuple[Any, Any]:
        """Return the default value and the range of a number, each None if it is not there."""
        default = self._number("default_value", self._take("default_value"), read)
        node = self._take("range")
        if node is None:
            return default, None
        if not isinstance(node, list) or len(node) != 2:
            raise self.error("range", "is not a smallest and a largest number, such as [0, 10]")
        low, high = (self._number("range", each, read) for each in node)
        if low > high:
            raise self.error("range", f"begins at {low}, which is more than {high}")
        if default is not None and not low <= default <= high:
            raise self.error("default_value", f"{default} is not within {low} and {high}")
        return default, (low, high)

    def _number(self, name: str, node: Node | None, read: Callable[[str], Any]) -> Any:
        if node is None:
            return None
        if not isinstance(node, str):
            raise self.error(name, "is not a single value")
        try:
            return read(node)
        except ValueError as error:
            raise self.error(name, f"{node!r} is {error}") from None

    def refuse_others(self, kind: str) -> None:
        """Refuse members that were not taken."""
        for name in self._members:
            if name not in self._taken:
                raise self.error(name, f"no {kind} has it")


def released_members(text: str) -> dict[str, str]:
    """Return what the released program sees in a manifest: lines with exactly one colon, whatever is in them.

    Quotes and comments stay in the values, and members of parameters stand among the others; of two of one name, the
    last is there.
    """
    parts = (line.split(":") for line in text.split("\n"))
    return {each[0].strip(): each[1].strip() for each in parts if len(each) == 2}


def read_released_manifest(text: str) -> Manifest:
    """Read a manifest as the released program does.

    Raises:
        PluginError: That program would not load the plugin.
    """
    members = released_members(text)
    for name in _RELEASED_MEMBERS:
        if name not in members:
            raise PluginError(f"manifest: the released PlotJuggler sees no {name}{_lost(text, name)}")
    if members["plugin_type"] != PLUGIN_TYPE:
        raise PluginError(
            f"manifest: the released PlotJuggler sees the plugin_type {members['plugin_type']!r} instead of"
            f" {PLUGIN_TYPE!r}: it keeps quotes and comments"
        )
    texts: dict[str, Any] = {each: members.get(each, "") for each in _TEXTS}
    return Manifest(members["name"], members["encoding"], **texts)


def unseen_by_released(text: str) -> list[str]:
    """Return what the released program does not see of a manifest, or sees otherwise than YAML has it.

    Args:
        text: A manifest that is valid YAML.

    Raises:
        PluginError: It is not.
    """
    manifest = read_manifest(text)
    members = released_members(text)
    found = []
    for name in (*_RELEASED_MEMBERS, *_TEXTS):
        value = getattr(manifest, name)
        seen = members.get(name)
        if seen is None and value:
            found.append(f"{name} is not seen{_lost(text, name)}")
        elif seen is not None and seen != value:
            found.append(f"{name} is seen as {seen!r}")
    if manifest.parameters:
        found.append("parameters_model is not seen")
    return found


def _lost(text: str, name: str) -> str:
    """Say which line has a member that the released program does not see."""
    for number, line in enumerate(text.split("\n"), 1):
        if line.partition(":")[0].strip() == name and line.count(":") != 1:
            return f": line {number} has {line.count(':')} colons"
    return ""
