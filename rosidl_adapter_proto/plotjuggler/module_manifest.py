"""The manifest of a parser module of PlotJuggler 4: JSON in a custom section of its file.

The rules are those of the SDK that reads it (parser_module_manifest.cpp and parser_claim_catalog.cpp, version 0.22).
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from rosidl_adapter_proto.errors import PluginError

SECTION = "pj_parser_module_manifest"
MAXIMUM_SIZE = 1 << 20
ENCODINGS = (
    "bson",
    "cbor",
    "data_tamer",
    "json",
    "msgpack",
    "omgidl",
    "protobuf",
    "ros1",
    "ros1msg",
    "ros2",
    "ros2msg",
)
ROUTES = ("scalar", "object")
ANY_TYPE = "*"
_CUSTOM, _START = 0, 8  # numbers of sections
_PRIORITIES = range(-1000, 1001)
_NUMBER = r"(?:0|[1-9]\d*)"
_IDENTIFIER = rf"(?:{_NUMBER}|\d*[A-Za-z-][0-9A-Za-z-]*)"
# https://semver.org/#backusnaur-form-grammar-for-valid-semver-versions
_SEMVER = re.compile(
    rf"{_NUMBER}\.{_NUMBER}\.{_NUMBER}(?:-{_IDENTIFIER}(?:\.{_IDENTIFIER})*)?(?:\+[0-9A-Za-z-]+(?:\.[0-9A-Za-z-]+)*)?",
    re.ASCII,
)


_DIGEST = re.compile("sha256:[0-9A-Fa-f]{64}")
_PROTOBUF_NAME = re.compile(r"[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*", re.ASCII)


@dataclass(frozen=True, slots=True)
class Claim:
    """Messages that a module says it parses.

    Attributes:
        claim_id: What the claim is called.
        encoding: Their encoding.
        type_name: Their type; `*` for any.
        routes: What it makes of them: `scalar` values, or an `object`.
        priority: Among claims of the same, the largest comes first.
    """

    claim_id: str
    encoding: str
    type_name: str
    routes: tuple[str, ...]
    priority: int


@dataclass(frozen=True, slots=True)
class ModuleManifest:
    """What a module says of itself.

    Attributes:
        id: What it is called among modules.
        name: What it is called, for people.
        version: Its version.
        claims: What it parses.
    """

    id: str
    name: str
    version: str
    claims: tuple[Claim, ...]

    @property
    def encodings(self) -> tuple[str, ...]:
        """The encodings of the messages that it makes values of."""
        return tuple(dict.fromkeys(claim.encoding for claim in self.claims if "scalar" in claim.routes))

    def claims_of(self, type_name: str) -> list[tuple[int, Claim]]:
        """Return the claims of values of a type with their indices, those first that come first."""
        found = [
            (index, claim)
            for index, claim in enumerate(self.claims)
            if claim.type_name in (type_name, ANY_TYPE) and "scalar" in claim.routes
        ]
        return sorted(found, key=lambda each: (each[1].type_name == ANY_TYPE, -each[1].priority))


def read_module_manifest(data: bytes) -> ModuleManifest:
    """Read the manifest of a module.

    Args:
        data: The file of the module.

    Raises:
        PluginError: There is not exactly one, or it breaks a rule; the text says which member.
    """
    found = _custom_sections(data, SECTION)
    if len(found) != 1:
        raise PluginError(f"{SECTION}: there are {len(found)} such custom sections instead of one")
    return parse_module_manifest(found[0])


def has_start_section(data: bytes) -> bool:
    """Tell whether a WebAssembly file runs something by itself once it is loaded.

    Raises:
        PluginError: A section ends behind the file.
    """
    return any(number == _START for number, _, _ in _sections(data))


def _custom_sections(data: bytes, name: str) -> list[bytes]:
    """Return the content of the custom sections that have a name."""
    found = []
    for number, begin, end in _sections(data):
        if number == _CUSTOM:
            length, text = _varuint32(data, begin)
            if text + length <= end and data[text : text + length] == name.encode():
                found.append(data[text + length : end])
    return found


def _sections(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Return the number of each section of a WebAssembly file, and where its content begins and ends."""
    at = 8
    while at < len(data):
        size, begin = _varuint32(data, at + 1)
        if size > len(data) - begin:
            raise PluginError(f"byte {begin}: a section has {size} bytes, but {len(data) - begin} are left")
        yield data[at], begin, begin + size
        at = begin + size


def _varuint32(data: bytes, at: int) -> tuple[int, int]:
    """Return a number and where what follows it begins."""
    value = 0
    for index, byte in enumerate(data[at : at + 5]):
        value |= (byte & 0x7F) << 7 * index
        if byte < 0x80:
            return value, at + index + 1
    raise PluginError(f"byte {at}: a number does not end")


def parse_module_manifest(text: bytes) -> ModuleManifest:
    """Read the JSON of a manifest.

    Raises:
        PluginError: It breaks a rule; the text says which member.
    """
    if len(text) > MAXIMUM_SIZE:
        raise PluginError(f"{SECTION}: {len(text)} bytes; at most {MAXIMUM_SIZE} are read")
    try:
        document = json.loads(text.decode(), parse_constant=_refuse_constant)
    except UnicodeDecodeError as error:
        raise PluginError(f"{SECTION}: byte {error.start} is not UTF-8") from None
    except json.JSONDecodeError as error:
        raise PluginError(f"{SECTION}: line {error.lineno}: not valid JSON: {error.msg}") from None
    except (RecursionError, ValueError):  # nested without end, and numbers of thousands of digits
        raise PluginError(f"{SECTION}: nested too deep, or a number is too long") from None
    members = _Members(document, "")
    members.forbid("provenance")
    if (abi := members.integer("module_abi")) != 1:
        raise members.error("module_abi", f"{abi} instead of 1")
    identifier, name, version = members.text("id"), members.text("name"), members.text("version")
    if not _SEMVER.fullmatch(version):
        raise members.error("version", f"{version!r} is no semantic version, such as 1.0.0")
    claims: dict[str, Claim] = {}
    for index, entry in enumerate(members.entries("claims")):
        claim_members = _Members(entry, f"claims[{index}].")
        claim = _claim(claim_members)
        if claim.claim_id in claims:
            raise claim_members.error("claim_id", f"a second {claim.claim_id!r}")
        claims[claim.claim_id] = claim
    return ModuleManifest(identifier, name, version, tuple(claims.values()))


def _refuse_constant(name: str) -> None:
    raise json.JSONDecodeError(f"there is no {name}", "", 0)


def _claim(members: _Members) -> Claim:
    members.forbid("provenance")
    claim_id, encoding = members.text("claim_id"), members.text("encoding")
    if encoding not in ENCODINGS:
        raise members.error("encoding", f"{encoding!r} is none of {', '.join(ENCODINGS)}")
    type_name = _normal_type(members, encoding)
    routes = members.entries("routes")
    if not routes:
        raise members.error("routes", "is empty")
    for route in routes:
        if route not in ROUTES:
            raise members.error("routes", f"{route!r} is neither scalar nor object")
    if type_name == ANY_TYPE and "object" in routes:
        raise members.error("type_name", "* is for the route scalar alone")
    if "object" in routes:
        members.text("object_type")
    elif members.has("object_type"):
        raise members.error("object_type", "is for the route object alone")
    priority = members.integer("priority")
    if priority not in _PRIORITIES:
        raise members.error("priority", f"{priority} is not within -1000 and 1000")
    for digest in members.entries("schema_digests") if members.has("schema_digests") else ():
        if not isinstance(digest, str) or not _DIGEST.fullmatch(digest):
            raise members.error("schema_digests", f"{digest!r} is not sha256: and 64 hexadecimal digits")
    return Claim(claim_id, encoding, type_name, tuple(routes), priority)


def _normal_type(members: _Members, encoding: str) -> str:
    """Return the type of a claim as messages have it: ROS types with `msg`, protobuf types without a dot before."""
    name = members.text("type_name")
    if name == ANY_TYPE:
        return name
    if encoding == "ros2msg":
        parts = name.split("/")
        if len(parts) not in (2, 3) or not all(parts) or parts[1:-1] not in ([], ["msg"]):
            raise members.error("type_name", f"{name!r} is neither package/Type nor package/msg/Type")
        return f"{parts[0]}/msg/{parts[-1]}"
    if encoding == "protobuf":
        if not _PROTOBUF_NAME.fullmatch(name.removeprefix(".")):
            raise members.error("type_name", f"{name!r} is no full name of a protobuf message")
        return name.removeprefix(".")
    return name


class _Members:
    """The members of an object of JSON, taken with the types that they must have."""

    def __init__(self, value: Any, path: str) -> None:
        self._path = path
        if not isinstance(value, dict):
            raise PluginError(f"{SECTION}: {path.rstrip('.') or 'the document'}: not an object")
        self._members = value

    def error(self, name: str, reason: str) -> PluginError:
        return PluginError(f"{SECTION}: {self._path}{name}: {reason}")

    def has(self, name: str) -> bool:
        return name in self._members

    def forbid(self, name: str) -> None:
        if name in self._members:
            raise self.error(name, "is for the host to say")

    def _take(self, name: str, kind: type, what: str) -> Any:
        if name not in self._members:
            raise self.error(name, "is missing")
        value = self._members[name]
        if type(value) is not kind:  # a bool is no integer
            raise self.error(name, f"not {what}")
        return value

    def text(self, name: str) -> str:
        value: str = self._take(name, str, "a text")
        if not value:
            raise self.error(name, "is empty")
        return value

    def integer(self, name: str) -> int:
        value: int = self._take(name, int, "an integer")
        return value

    def entries(self, name: str) -> list[Any]:
        value: list[Any] = self._take(name, list, "a list")
        return value
