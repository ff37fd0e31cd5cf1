"""Recorded texts that the native core reads: the plans that Python makes of them, byte for byte."""

from __future__ import annotations

from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rosidl_adapter_proto.errors import Error
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import store_source
from rosidl_adapter_proto.interfaces.recorded import ROS2MSG, recorded_text
from rosidl_adapter_proto.interfaces.scalars import SCALARS
from rosidl_adapter_proto.interfaces.store import distributions, is_ros1
from rosidl_adapter_proto.schema.registry import TypeRegistry
from rosidl_adapter_proto.transcode import _core
from tests import oracle
from tests.interfaces.test_recorded import RULE, TRACK, WAYS, installed_messages, recorded
from tests.transcode.recorded_plans import plan_of_text

TYPE = "my_msgs/msg/Track"
ROS2_DISTRIBUTIONS = [each for each in distributions() if not is_ros1(each)]

PASSED_OVER = (
    "a bool must be true, false",
    "expected a number with",
    "expected a whole number from",
    "does not fit",
    "a quote inside a string",
    "more than its bound of",
    "the default of a",
    "expected a string before",
    "a string has no closing",
    "ROS 2 cannot read",
    "ROS 2 only reads ASCII",
    "ROS 2 replaces escape sequences",
    "an escape sequence",
)
"""What Python says of the values of constants and of default values, which the core passes over."""

NOT_READ = (
    "the text has definitions in IDL, of which only those in .msg are read",
    "the text has definitions of services or actions, of which only those of messages are read",
    "a line `MSG: ` of the text does not have the name of a message behind it",
    "the length of an array or a bound is not a whole number from 1 to 4294967295",
    "the text defines a type twice, not in the same way",
)
"""What the core says of texts that Python may read: it is stricter with lines like those between definitions, with
numbers that have signs, underscores or other digits than ASCII's, and with texts that are not UTF-8.
"""


def check(text: bytes, type_name: str = TYPE) -> bool:
    """Check that the core and Python agree on a text, and return whether both read it."""
    try:
        expected: bytes | Error = plan_of_text(text, type_name).pack()
    except Error as error:
        expected = error
    try:
        found = _core.read_ros2msg(text, type_name)
    except ValueError as refusal:
        assert isinstance(expected, Error) or str(refusal) in NOT_READ
        return False
    if isinstance(expected, Error):
        assert any(each in str(expected) for each in PASSED_OVER), expected
        return False
    assert found == expected
    return True


@pytest.mark.parametrize("distribution", ROS2_DISTRIBUTIONS)
def test_every_message_of_the_store(distribution: str) -> None:
    source = store_source(distribution)
    registry = TypeRegistry(Catalog((source,)))
    names = [str(name) for package in source.packages.values() for name in package]
    assert len(names) > 100
    for name in names:
        encoding, text = recorded_text(registry.definitions(name))
        assert encoding == ROS2MSG
        assert check(text, name), name


@pytest.mark.parametrize("distribution", ROS2_DISTRIBUTIONS)
def test_every_message_as_rosbags_writes_it(distribution: str) -> None:
    from rosbags.typesys import Stores, get_typestore

    typestore = get_typestore(Stores(f"ros2_{distribution}"))
    for name in typestore.fielddefs:
        text, _ = typestore.generate_msgdef(name, ros_version=2)
        assert check(text.encode(), name), name


def test_every_installed_message(ros_prefix: object) -> None:
    for path in installed_messages(".msg"):
        assert check(recorded(path, "MSG").encode(), str(oracle.type_name(path))), path


@pytest.mark.parametrize("text", WAYS)
def test_ways_to_write_the_same_type(text: str) -> None:
    assert _core.read_ros2msg(text.encode(), TYPE) == plan_of_text(TRACK.encode(), TYPE).pack()


@pytest.mark.parametrize(
    ("text", "type_name"),
    [
        ("", "std_msgs/Empty"),
        ("\n \u3000\n", "std_msgs/msg/Empty"),
        ("# nothing\n", "std_msgs/msg/Empty"),
        ("uint8 structure_needs_at_least_one_member\nint8 a", TYPE),
        ("time structure_needs_at_least_one_member", TYPE),
        ("time stamp\nduration[<=3] spans\nbuiltin_interfaces/msg/Time[2] times", TYPE),
        (f"Header header\n{RULE}\nMSG: my_msgs/Header\nint8 a\n", TYPE),
        (
            f"Header header\n{RULE}\nMSG: std_msgs/Header\nHeader2 a\n{RULE}\nMSG: std_msgs/Header2\nbool a\n",
            TYPE,
        ),
        (f"\n\n{RULE}\nMSG: other/Type\nint8 a\n{RULE}\nMSG: my_msgs/Track\nint8 b\n", TYPE),
        (f"{RULE}\nMSG: other/Type\nint8 a\n", TYPE),
        (f"A a\n{RULE}\nMSG: A\n{RULE}\nMSG: my_msgs/A\nint8 b\n", TYPE),
        (f"int8 a\n{RULE}\nMSG: not_needed/A\nthis is = no definition [\n", TYPE),
        ("int8 request", "my_msgs/srv/Find_Request"),
        (
            f"int8 request\n{RULE}\nMSG: my_msgs/srv/Find_Request\nint8 \t request\n\n",
            "my_msgs/srv/Find_Request",
        ),
        ("wstring<=3[] a\nwstring<=3[<=5] b\nstring<=3[] c\nstring<=1[7] d\nwstring<=4294967295 e", TYPE),
        ("int8[4294967295] a\nint8[<=4294967295] b", TYPE),
        ("int8 a\vint8 b\fint8 c\rint8 d\u2028int8 e\x85int8 f\x1cint8 g # \x1d int8 h", TYPE),
        ("int8\t a\t#b\n\t string \u3000 c = # d\n string d '#'", TYPE),
        ("string A = \"x\"\nint8 A\nbool  B=true#\nfloat64 c -1e3\nint8[] d [1, 2]\nstring<=3 e 'f'", TYPE),
        ("Sample_A_Request a\n" + RULE + "\nMSG: Sample_A_Request\nint8 a", TYPE),
        ("".join(f"int8 {''.join(each)}\n" for each in product(("plumless", "buckeroo"), repeat=4)), TYPE),
    ],
)
def test_texts(text: str, type_name: str) -> None:
    assert check(text.encode(), type_name)


@st.composite
def texts(draw: st.DrawFn) -> str:
    """Return the text of `TYPE`, whose messages lie in each other in any way, written in any way."""
    packages = ["my_msgs", "other", "std_msgs"]
    names = ["my_msgs/Track"]
    names += draw(
        st.lists(
            st.builds(
                lambda *parts: "/".join(parts),
                st.sampled_from(packages),
                st.sampled_from(["A", "B", "Header", "c"]),
            ),
            max_size=6,
            unique=True,
        )
    )
    definitions = [draw(definition(name, names[index + 1 :])) for index, name in enumerate(names)]
    first, *others = [
        f"{RULE}\n{draw(heading(name))}\n{text}" if index else text
        for index, (name, text) in enumerate(zip(names, definitions, strict=True))
    ]
    text = "".join(
        [first, *draw(st.permutations(others + draw(st.lists(st.sampled_from(others))) if others else []))]
    )
    return text.replace("\n", draw(st.sampled_from(["\n", "\r\n"])))


def heading(name: str) -> st.SearchStrategy[str]:
    package, _, last = name.partition("/")
    written = [name, f"{package}/msg/{last}", *([last] if package == "my_msgs" else [])]
    return st.builds("MSG:{}{}{}".format, blank(), st.sampled_from(written), blank())


def blank(least: int = 0) -> st.SearchStrategy[str]:
    return st.text(" \t", min_size=least, max_size=2)


@st.composite
def definition(draw: st.DrawFn, name: str, nested: list[str]) -> str:
    fields = draw(
        st.lists(st.from_regex(r"[A-Za-z][A-Za-z0-9_]{0,9}", fullmatch=True), max_size=6, unique=True)
    )
    lines = [
        "".join(
            draw(st.tuples(blank(), field_type(name, nested), blank(1), st.just(field), blank(), COMMENTS))
        )
        for field in fields
    ]
    lines += draw(st.lists(st.sampled_from(CONSTANTS), unique=True))
    return "".join(f"{line}\n" for line in draw(st.permutations(lines)))


COMMENTS = st.sampled_from(
    ["", "# a comment", "#", f"# {RULE}", "# int8 a = \\x", "#\xe4", "\n", "\n# [m/s]"]
)
CONSTANTS = (
    "int8 LOW=-1",
    "string\tNAME = 'it is' # not",
    "bool Yes=True",
    "\tfloat32 PI =3.14",
    "wstring W=",
)
PRIMITIVES = [name for scalar in SCALARS.values() for name in scalar.msg if not scalar.is_string]


def field_type(name: str, nested: list[str]) -> st.SearchStrategy[str]:
    bounds = st.integers(1, 2**32 - 1)
    strings = st.sampled_from(["string", "wstring"])
    elements = [
        st.sampled_from([*PRIMITIVES, "time", "duration"]),
        strings,
        st.builds("{}<={}".format, strings, bounds),
    ]
    if nested:
        elements.append(st.sampled_from(nested).flatmap(lambda each: reference(name, each)))
    shapes = st.one_of(
        st.sampled_from(["", "", "[]"]), st.builds("[{}]".format, bounds), st.builds("[<={}]".format, bounds)
    )
    return st.builds("{}{}".format, st.one_of(elements), shapes)


def reference(name: str, nested: str) -> st.SearchStrategy[str]:
    package, _, last = nested.partition("/")
    is_own = package == name.partition("/")[0] and last != "Track"
    return st.sampled_from([nested, f"{package}/msg/{last}", *([last] if is_own else [])])


@given(texts())
def test_any_text(text: str) -> None:
    assert check(text.encode())


PIECES = [
    "",
    "\n",
    "\r",
    "\0",
    "\xa0",
    "\u2028",
    RULE,
    f"\n{RULE}\n",
    "MSG: ",
    "IDL: ",
    "SRV: ",
    "Track",
    "Header",
]
PIECES += [
    "/msg",
    "time",
    "[9]",
    "[<=",
    "]",
    "<=5",
    "=",
    "#",
    "int8 a",
    "A=1\n",
    " ",
    "\t",
    "string",
    "---",
    "_",
    "0",
    "+",
    "9",
]


@given(st.data())
def test_garbage(data: st.DataObject) -> None:
    start = st.one_of(st.sampled_from([TRACK, *WAYS]), texts())
    content = bytearray(data.draw(start).encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content)))
        end = at + data.draw(st.integers(0, 20))
        piece = data.draw(st.sampled_from([b"\xff", b"\xe2\x80", *(each.encode() for each in PIECES)]))
        content[at:end] = piece
    check(bytes(content))
