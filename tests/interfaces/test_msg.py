from __future__ import annotations

import math
import random
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rosidl_adapter_proto.errors import DefinitionError
from rosidl_adapter_proto.interfaces.idl import parse_idl
from rosidl_adapter_proto.interfaces.model import (
    EMPTY_STRUCT_FIELD,
    Action,
    ArrayType,
    BasicType,
    Constant,
    Field,
    FieldType,
    Interface,
    Location,
    Message,
    SequenceType,
    Service,
    StringType,
    TypeName,
)
from rosidl_adapter_proto.interfaces.msg import ROS1, parse_action, parse_msg, parse_srv
from tests import oracle
from tests.pipeline import facts, official, parts

FOO = TypeName("pkg", "msg", "Foo")
DO = TypeName("pkg", "srv", "Do")
GO = TypeName("pkg", "action", "Go")
BOOL, BYTE, UINT8, INT8, UINT16, INT32, INT64, UINT64, FLOAT, DOUBLE = (
    BasicType(name)
    for name in ("boolean", "octet", "uint8", "int8", "uint16", "int32", "int64", "uint64", "float", "double")
)
STRING, WSTRING = StringType(), StringType(wide=True)
EMPTY = (Field(EMPTY_STRUCT_FIELD, UINT8),)

PARSERS: dict[str, Callable[[str, TypeName, str], Interface]] = {
    "msg": parse_msg,
    "srv": parse_srv,
    "action": parse_action,
}


def parse(text: str, name: TypeName = FOO) -> Interface:
    return PARSERS[name.namespace](text, name, f"{name.name}.{name.namespace}")


def parse_message(text: str) -> Message:
    message = parse(text)
    assert isinstance(message, Message)
    return message


def error_of(text: str, name: TypeName = FOO) -> str:
    with pytest.raises(DefinitionError) as caught:
        parse(text, name)
    return str(caught.value)


# What ROS installs


@pytest.mark.parametrize(
    "path",
    [path for suffix in (".msg", ".srv", ".action") for path in oracle.installed_definitions(suffix)],
    ids=lambda path: str(oracle.type_name(path)),
)
def test_installed_definitions_are_read_as_ros_reads_them(path: Path, tmp_path: Path) -> None:
    name, text = oracle.type_name(path), path.read_text("utf-8")
    ours = PARSERS[name.namespace](text, name, str(path))
    theirs = official(text, name, tmp_path)
    assert theirs is not None
    assert facts(ours) == facts(theirs)
    idl = path.with_suffix(".idl")
    if idl.exists():  # test_interface_files has none
        assert ours == parse_idl(idl.read_text("utf-8"), name, str(idl))


def test_there_are_installed_definitions(ros_prefix: Path) -> None:
    assert len(oracle.installed_definitions(".msg")) > 150
    assert len(oracle.installed_definitions(".srv")) > 25
    assert len(oracle.installed_definitions(".action")) > 1


# Fields

TYPES: dict[str, FieldType] = {
    "bool": BOOL,
    "byte": BYTE,
    "char": UINT8,
    "int8": INT8,
    "uint8": UINT8,
    "int16": BasicType("int16"),
    "uint16": UINT16,
    "int32": INT32,
    "uint32": BasicType("uint32"),
    "int64": INT64,
    "uint64": UINT64,
    "float32": FLOAT,
    "float64": DOUBLE,
    "string": STRING,
    "wstring": WSTRING,
    "string<=5": StringType(bound=5),
    "wstring<=1_000": StringType(True, 1000),
    "string<=+5": StringType(bound=5),
    "Foo": FOO,
    "Bar": TypeName("pkg", "msg", "Bar"),
    "other/Bar": TypeName("other", "msg", "Bar"),
    "o2_x/B1": TypeName("o2_x", "msg", "B1"),
    "Sample_Bar": TypeName("pkg", "msg", "Sample_Bar"),
    "other/Bar_Request": TypeName("other", "msg", "Bar_Request"),
    "Bar_Feedback_Response": TypeName("pkg", "msg", "Bar_Feedback_Response"),
    "Int32": TypeName("pkg", "msg", "Int32"),
    "int32[]": SequenceType(INT32),
    "int32[3]": ArrayType(INT32, 3),
    "int32[+3]": ArrayType(INT32, 3),
    "int32[<=3]": SequenceType(INT32, 3),
    "byte[]": SequenceType(BYTE),
    "string<=5[]": SequenceType(StringType(bound=5)),
    "string<=5[2]": ArrayType(StringType(bound=5), 2),
    "wstring<=5[<=2]": SequenceType(StringType(True, 5), 2),
    "wstring<=5[]": SequenceType(StringType(True, 5), 5),
    "wstring<=5[2]": ArrayType(StringType(True, 5), 2),
    "wstring[]": SequenceType(WSTRING),
    "Bar[2]": ArrayType(TypeName("pkg", "msg", "Bar"), 2),
    "other/Bar[<=2]": SequenceType(TypeName("other", "msg", "Bar"), 2),
}
FIELDS: list[tuple[str, Field]] = [
    *((f"{spelling} x", Field("x", type_)) for spelling, type_ in TYPES.items()),
    # Names
    *(
        (f"string {name}", Field(name, STRING))
        for name in ("module", "string", "int8", "x1", "a_b_c", "x_1", "default")
    ),
    (f"int8 {EMPTY_STRUCT_FIELD}", Field(EMPTY_STRUCT_FIELD, INT8)),
    # White space
    ("int32\tx\t5", Field("x", INT32, 5)),
    ("int32    x    5   ", Field("x", INT32, 5)),
    ("int32 x \N{IDEOGRAPHIC SPACE}", Field("x", INT32)),
    # Integers
    ("int32 x 10", Field("x", INT32, 10)),
    ("int32 x 010", Field("x", INT32, 10)),
    ("int32 x -0", Field("x", INT32, 0)),
    ("int32 x +5", Field("x", INT32, 5)),
    ("int32 x 1_000", Field("x", INT32, 1000)),
    ("int32 x 0xff", Field("x", INT32, 255)),
    ("int32 x -0XF_F", Field("x", INT32, -255)),
    ("int32 x 0o17", Field("x", INT32, 15)),
    ("int32 x 0b101", Field("x", INT32, 5)),
    ("int8 x -128", Field("x", INT8, -128)),
    ("uint16 x 65535", Field("x", UINT16, 65535)),
    ("uint64 x 18446744073709551615", Field("x", UINT64, 2**64 - 1)),
    ("int64 x -9223372036854775808", Field("x", INT64, -(2**63))),
    ("byte x 0xff", Field("x", BYTE, 255)),
    ("char x 65", Field("x", UINT8, 65)),
    # Booleans
    *((f"bool x {text}", Field("x", BOOL, True)) for text in ("true", "True", "TRUE", "tRuE", "1")),
    *((f"bool x {text}", Field("x", BOOL, False)) for text in ("false", "False", "FALSE", "fAlSe", "0")),
    # Numbers
    ("float32 x 1", Field("x", FLOAT, 1.0)),
    ("float64 x .5", Field("x", DOUBLE, 0.5)),
    ("float64 x 5.", Field("x", DOUBLE, 5.0)),
    ("float64 x -1.5e-3", Field("x", DOUBLE, -0.0015)),
    ("float64 x 1e-7", Field("x", DOUBLE, 1e-7)),
    ("float64 x 1E22", Field("x", DOUBLE, 1e22)),
    ("float64 x -0.0", Field("x", DOUBLE, -0.0)),
    ("float64 x 1_0.5", Field("x", DOUBLE, 10.5)),
    ("float64 x 123456789012345678901234567890", Field("x", DOUBLE, 1.2345678901234568e29)),
    ("float32 x 1e400", Field("x", FLOAT, math.inf)),
    ("float64 x inf", Field("x", DOUBLE, math.inf)),
    ("float64 x Infinity", Field("x", DOUBLE, math.inf)),
    ("float64 x NaN", Field("x", DOUBLE, math.nan)),
    # Strings
    ("string  x   a", Field("x", STRING, "a")),
    ("string x a b  c", Field("x", STRING, "a b  c")),
    ('string x " a "', Field("x", STRING, " a ")),
    ("string x ' a '", Field("x", STRING, " a ")),
    ('string x ""', Field("x", STRING, "")),
    ("string x ''", Field("x", STRING, "")),
    ('string x "', Field("x", STRING, "")),
    ('string x "a', Field("x", STRING, '"a')),
    ("string x a'", Field("x", STRING, "a'")),
    ('string x "it\'s"', Field("x", STRING, "it's")),
    (r"string x 'it\'s'", Field("x", STRING, "it's")),
    (r'string x "say \"a\""', Field("x", STRING, 'say "a"')),
    ('string x "say "', Field("x", STRING, "say ")),
    ("string x 'say \"a\"'", Field("x", STRING, 'say "a"')),
    ('string x a"b', Field("x", STRING, 'a"b')),
    ("string x grün €", Field("x", STRING, "grün €")),
    ("wstring x 'grün €'", Field("x", WSTRING, "grün €")),
    ("string<=5 x abcde", Field("x", StringType(bound=5), "abcde")),
    ("string x a\tb", Field("x", STRING, "a b")),
    ("string x 1", Field("x", STRING, "1")),
    ("string x [a]", Field("x", STRING, "[a]")),
    ("string x // a", Field("x", STRING, "// a")),
    ("string x @(a) @@ %s {0}", Field("x", STRING, "@(a) @@ %s {0}")),
    # A '#' begins a comment even inside quotes
    ('string x "a#b"', Field("x", STRING, '"a', ('b"',))),
    ("string x 'a # b' # c", Field("x", STRING, "'a", ("b' # c",))),
    # Escape sequences are replaced twice
    (r"string x a\\nb", Field("x", STRING, "a\nb")),
    (r"string x \\n\\t\\v\\b\\r\\f\\a\\'\\x41\\101", Field("x", STRING, "\n\t\v\b\r\f\a'AA")),
    (r"string x \t\v\b\f\a\'\x41\101", Field("x", STRING, "\t\v\b\f\a'AA")),
    (r"string x \\\\", Field("x", STRING, "\\")),
    (r"string x \\\\\\\\", Field("x", STRING, "\\")),
    (r"string x \\\\n", Field("x", STRING, r"\n")),
    (r"string x C:\\\\dir", Field("x", STRING, r"C:\dir")),
    (r"string x \d\?", Field("x", STRING, r"\d\?")),
    (r"string x \\d\\?", Field("x", STRING, r"\d\?")),
    (r"string x \xc3\xb6", Field("x", STRING, "ö")),
    (r"string x \\xf6", Field("x", STRING, "ö")),
    (r"string x \\777", Field("x", STRING, "ǿ")),
    (r"string x \N{DIGIT ONE}", Field("x", STRING, "1")),
    (r"string x \\u20ac", Field("x", STRING, r"\u20ac")),
    (r"wstring x \\u20ac", Field("x", WSTRING, r"\u20ac")),
    # Arrays
    ("int32[]  x   []", Field("x", SequenceType(INT32), ())),
    ("int32[] x []", Field("x", SequenceType(INT32), ())),
    ("int32[] x [1]", Field("x", SequenceType(INT32), (1,))),
    ("int32[3] x [1, 0x2 ,-3]", Field("x", ArrayType(INT32, 3), (1, 2, -3))),
    ("int32[<=3] x [1,2]", Field("x", SequenceType(INT32, 3), (1, 2))),
    ("bool[2] x [true, 0]", Field("x", ArrayType(BOOL, 2), (True, False))),
    ("byte[] x [255]", Field("x", SequenceType(BYTE), (255,))),
    ("char[] x [65]", Field("x", SequenceType(UINT8), (65,))),
    ("float32[2] x [1, -2.5e3]", Field("x", ArrayType(FLOAT, 2), (1.0, -2500.0))),
    ("string[] x []", Field("x", SequenceType(STRING), ())),
    ("string[] x [a b, c]", Field("x", SequenceType(STRING), ("a b", "c"))),
    ("string[] x [\"a, b\", 'c']", Field("x", SequenceType(STRING), ("a, b", "c"))),
    ('string[] x ["a",]', Field("x", SequenceType(STRING), ("a",))),
    ('string[] x ["a" "b"]', Field("x", SequenceType(STRING), ("a", "b"))),
    ("string[] x ['''a''']", Field("x", SequenceType(STRING), ("", "a", ""))),
    ('string[] x [""]', Field("x", SequenceType(STRING), ("",))),
    ('string[] x [" a "]', Field("x", SequenceType(STRING), ("a",))),
    ("string[] x [\"it's\", 'a\"b']", Field("x", SequenceType(STRING), ("it's", 'a"b'))),
    (r'string[] x ["a\"b"]', Field("x", SequenceType(STRING), ('a"b',))),
    (r"string[] x ['a\'b']", Field("x", SequenceType(STRING), ("a'b",))),
    (r'string[] x ["a\"b\"c"]', Field("x", SequenceType(STRING), ('a"', '"c"'))),
    (r'string[] x ["\n", \\t]', Field("x", SequenceType(STRING), ("\n", "\\t"))),
    ('string[2] x ["[", "]"]', Field("x", ArrayType(STRING, 2), ("[", "]"))),
    ("string<=3[] x [abc]", Field("x", SequenceType(StringType(bound=3)), ("abc",))),
    ('wstring[] x ["a"]', Field("x", SequenceType(WSTRING), ("a",))),
    # Comments and units
    ("int32 x # a", Field("x", INT32, None, ("a",))),
    ("int32 x#a", Field("x", INT32, None, ("a",))),
    ("int32 x 5#a", Field("x", INT32, 5, ("a",))),
    ("int32 x ### a", Field("x", INT32, None, ("a",))),
    ("int32 x #", Field("x", INT32)),
    ("int32 x # grün €", Field("x", INT32, None, ("grün €",))),
    ('int32 x # "quoted" @(a) // b */', Field("x", INT32, None, ('"quoted" @(a) // b */',))),
    ("int32 x # [m]", Field("x", INT32, None, (), "m")),
    ("int32 x # in [m/s^2] upwards", Field("x", INT32, None, ("in upwards",), "m/s^2")),
    ("int32 x # [m] or [s]", Field("x", INT32, None, ("[m] or [s]",))),
    ("int32 x # in [0, 1]", Field("x", INT32, None, ("in [0, 1]",))),
    ("int32 x # [rad] in [0, 1]", Field("x", INT32, None, ("in [0, 1]",), "rad")),
    ("int32 x # []", Field("x", INT32, None, ("[]",))),
    ("int32 x # [m", Field("x", INT32, None, ("[m",))),
    ("int32[3] x # [ m ]", Field("x", ArrayType(INT32, 3), None, (), " m ")),
]


def shown(field: Field) -> tuple[object, ...]:
    return field.name, field.type, repr(field.default), field.comment, field.unit


@pytest.mark.parametrize(("line", "expected"), FIELDS, ids=[line for line, _ in FIELDS])
def test_fields(line: str, expected: Field, tmp_path: Path) -> None:
    message = parse_message(line)
    assert [shown(each) for each in message.fields] == [shown(expected)]
    assert message.constants == ()
    theirs = official(line, FOO, tmp_path)
    assert theirs is not None
    assert facts(message) == facts(theirs)


# Constants

CONSTANTS: list[tuple[str, Constant]] = [
    *(
        (f"{spelling} X=1", Constant("X", type_, 1))
        for spelling, type_ in {"byte": BYTE, "char": UINT8, "int8": INT8, "uint16": UINT16}.items()
    ),
    ("int32 X = 5", Constant("X", INT32, 5)),
    ("int32 X\t=\t0x1F", Constant("X", INT32, 31)),
    ("uint64 MAX_2=18446744073709551615", Constant("MAX_2", UINT64, 2**64 - 1)),
    ("bool X=True", Constant("X", BOOL, True)),
    ("bool X=0", Constant("X", BOOL, False)),
    ("float32 X=1", Constant("X", FLOAT, 1.0)),
    ("float64 X=-.5", Constant("X", DOUBLE, -0.5)),
    ("float64 X=nan", Constant("X", DOUBLE, math.nan)),
    ("string X=", Constant("X", STRING, "")),
    ("string X=a b", Constant("X", STRING, "a b")),
    ('string X=" a "', Constant("X", STRING, " a ")),
    ("string X==", Constant("X", STRING, "=")),
    ("string X=a=b", Constant("X", STRING, "a=b")),
    ('string X="grün"', Constant("X", STRING, "grün")),
    (r"string X=a\\nb", Constant("X", STRING, "a\nb")),
    ("string X='a # b'", Constant("X", STRING, "'a", ("b'",))),
    ("wstring X=grün €", Constant("X", WSTRING, "grün €")),
    ("int32 X=1 # at most [m/s]", Constant("X", INT32, 1, ("at most",), "m/s")),
    ("# above\n\nint32 Y=2\n# before\nint32 X=1 # behind", Constant("X", INT32, 1, ("before", "behind"))),
]


@pytest.mark.parametrize(("text", "expected"), CONSTANTS, ids=[text for text, _ in CONSTANTS])
def test_constants(text: str, expected: Constant, tmp_path: Path) -> None:
    message = parse_message(text)
    found = message.constants[-1]
    assert (repr(found), found.comment, found.unit) == (repr(expected), expected.comment, expected.unit)
    assert message.fields == EMPTY
    theirs = official(text, FOO, tmp_path)
    assert theirs is not None
    assert facts(message) == facts(theirs)


# Lines, comments and the places of fields

A_AND_B: dict[str, tuple[str, ...]] = {"a": (), "b": ()}
LAYOUTS: list[tuple[str, dict[str, tuple[str, ...]], tuple[str, ...]]] = [
    # Each row: the text, the comments of its fields, the comment of the message
    ("", {EMPTY_STRUCT_FIELD: ()}, ()),
    ("   \n\n\t\n", {EMPTY_STRUCT_FIELD: ()}, ()),
    ("#", {EMPTY_STRUCT_FIELD: ()}, ()),
    ("# only a comment", {EMPTY_STRUCT_FIELD: ()}, ("only a comment",)),
    ("int8 a\nint8 b", A_AND_B, ()),
    ("int8 a\nint8 b\n", A_AND_B, ()),
    ("int8 a\r\nint8 b\r\n", A_AND_B, ()),
    ("int8 a\rint8 b", A_AND_B, ()),
    ("int8 a\fint8 b", A_AND_B, ()),
    ("int8 a\vint8 b", A_AND_B, ()),
    ("int8 a\x1cint8 b", A_AND_B, ()),
    ("int8 a\u2028int8 b", A_AND_B, ()),
    ("\nint8 a\n\n\n  \nint8 b  \n\n", A_AND_B, ()),
    ("# file\nint8 a\nint8 b", A_AND_B, ("file",)),
    ("# file\n\n# first\nint8 a\n# second\nint8 b", {"a": ("first",), "b": ("second",)}, ("file",)),
    ("\n# first\nint8 a # behind\nint8 b", {"a": ("first", "behind"), "b": ()}, ()),
    ("\n# first\n\n# again\nint8 a\nint8 b", {"a": ("first", "again"), "b": ()}, ()),
    ("\n#\n# 1\n#\n#\n# 2\n#\nint8 a\nint8 b", {"a": ("1", "", "2"), "b": ()}, ()),
    ("\n#  1\n#    2\n#   3\nint8 a\nint8 b", {"a": ("1", "  2", " 3"), "b": ()}, ()),
    ("\n#1\n# 2\nint8 a\nint8 b", {"a": ("1", " 2"), "b": ()}, ()),
    ("\n####\n## 1 ##\n####\nint8 a\nint8 b", {"a": ("1 ##",), "b": ()}, ()),
    ("\n#\t1\t2\nint8 a\nint8 b", {"a": ("1 2",), "b": ()}, ()),
    ("int8 a\n  # more\n\t# again\n# next\nint8 b", {"a": ("more", "again"), "b": ("next",)}, ()),
    ("int8 a # 1\n   #   2\nint8 b", {"a": ("1", "  2"), "b": ()}, ()),
    ("  # indented\nint8 a\nint8 b", A_AND_B, ("indented",)),
    ("# file\n# \n#   more\n\nint8 a\nint8 b\n# end", A_AND_B, ("file", "", "  more", "", "end")),
    ("int8 a\nint8 b\n# end\n\n# of file", A_AND_B, ("end", "of file")),
    ("# speed in [m/s]\nint8 a\nint8 b", A_AND_B, ("speed in [m/s]",)),
]


@pytest.mark.parametrize(("text", "fields", "comment"), LAYOUTS, ids=[repr(row[0]) for row in LAYOUTS])
def test_layouts(
    text: str, fields: dict[str, tuple[str, ...]], comment: tuple[str, ...], tmp_path: Path
) -> None:
    message = parse_message(text)
    assert {each.name: each.comment for each in message.fields} == fields
    assert message.comment == comment
    assert message.text == text
    theirs = official(text, FOO, tmp_path)
    assert theirs is not None
    assert facts(message) == facts(theirs)


@pytest.mark.parametrize("name", [FOO, DO, GO], ids=str)
def test_a_sequence_of_bounded_wide_strings_has_their_bound_and_a_warning(name: TypeName) -> None:
    text = "\n---\n".join(["wstring<=5[] x", "wstring<=6[<=2] x", "string<=5[] x"][: len(parts_of(name))])
    assert parse(text, name).warnings == (
        f"{name.name}.{name.namespace}:1:1: ROS 2 takes the bound of these wide strings for that of the sequence "
        "too, and so it is generated: at most 5 elements; give the sequence a bound of its own",
    )


def parts_of(name: TypeName) -> range:
    return range({"msg": 1, "srv": 2, "action": 3}[name.namespace])


@pytest.mark.parametrize(
    "text",
    [
        "  # before all \\",
        "int8 x\n# behind all \\",
        "int8 X=1 # [\\n]",  # a unit of a constant
    ],
)
def test_comments_that_ros_does_not_look_into(text: str, tmp_path: Path) -> None:
    theirs = official(text, FOO, tmp_path)
    assert theirs is not None
    assert parse(text) == theirs


def test_ros1_definitions_have_backslashes_in_their_comments() -> None:
    message = parse_msg(r"int8 x # C:\new", FOO, "Foo.msg", ROS1)
    assert message.fields[0].comment == (r"C:\new",)


# Comments at random

COMMENT_PIECES = (
    *(
        "word",
        "#",
        "##",
        " ",
        "\t",
        "'",
        '"',
        '"""',
        "@",
        "@(x)",
        "@{",
        "@[",
        "//",
        "/*",
        "*/",
        "$",
        "{",
        "}",
        "%",
    ),
    *(
        "[m]",
        "[\\t]",
        "[a\\b]",
        "[",
        "]",
        ",",
        "=",
        ";",
        "<",
        "---",
        "é",
        "€",
        "😀",
        "\0",
        "\x01",
        "\x1b",
        "\x7f",
    ),
    *(
        "\\",
        "\\\\",
        "\\\\\\\\",
        "\\n",
        "\\t",
        "\\x41",
        "\\x4",
        "\\xe9",
        "\\xc3\\xa9",
        "\\u00e9",
        "\\N{DASH}",
        "\\101",
        "\\0",
    ),
    *('\\"', "\\'", "\\?", "\\q", "C:\\new", "\x0b", "\x0c", "\x1c", "\x85", "\u2028", "\ufeff"),
)
COMMENTS = st.lists(st.sampled_from(COMMENT_PIECES), max_size=4).map(lambda pieces: "#" + "".join(pieces))
COMMENTED_LINES = st.one_of(
    COMMENTS,
    COMMENTS.map("  {}".format),
    st.builds("{} {}".format, st.sampled_from(["int8 x", "string y", "int8 Z=3", 'string w "#"']), COMMENTS),
    st.just(""),
)


@given(st.lists(COMMENTED_LINES, max_size=4, unique=True), st.sampled_from(["\n", "\n", "\r\n"]))
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_random_comments_are_accepted_where_ros_does(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], lines: list[str], end: str
) -> None:
    text = end.join(lines)
    theirs = official(text, FOO, tmp_path)
    try:
        message = parse(text)
    except DefinitionError:
        assert theirs is None
        return
    assert theirs is not None
    if "\\" not in text:  # escape sequences are shown as they were written
        assert facts(message) == facts(theirs)


def test_locations() -> None:
    message = parse_message("# file\r\n\r\nint8 a\r\nint8\t \tb 5 # c\r\nint8  X = 3")
    members: list[Field | Constant] = [*message.fields, *message.constants]
    assert [each.location for each in members] == [
        Location("Foo.msg", 3, 6),
        Location("Foo.msg", 4, 8),
        Location("Foo.msg", 5, 7),
    ]


def test_ros1_definitions_are_less_strict() -> None:
    message = parse_msg("  float64[9] K\n\tstring childFrame", FOO, "Foo.msg", ROS1)
    assert message.fields == (Field("K", ArrayType(DOUBLE, 9)), Field("childFrame", STRING))


# Where this reader and ROS 2's tools differ on purpose

DIFFERENCES: list[tuple[str, list[object], bool]] = [
    # `rosidl_parser` loses the sign of an infinity.
    ("float64 x -inf", [-math.inf, (), None], True),
    # `rosidl_adapter` replaces escape sequences in comments, which are shown here as they were written.
    (r"int8 x # a\tb", [None, (r"a\tb",), None], True),
    (r"int8 x # C:\\new", [None, (r"C:\\new",), None], True),
]


@pytest.mark.parametrize(("text", "expected", "accepted"), DIFFERENCES, ids=[row[0] for row in DIFFERENCES])
def test_differences(text: str, expected: list[object], accepted: bool, tmp_path: Path) -> None:
    message = parse_message(text)
    (field,) = message.fields
    assert [field.default, field.comment, field.unit] == expected
    theirs = official(text, FOO, tmp_path)
    assert (theirs is not None) == accepted
    if theirs is not None:
        assert facts(message) != facts(theirs)


# Services and actions

A, B, C = Field("a", INT8), Field("b", INT8), Field("c", INT8)


@pytest.mark.parametrize(
    ("text", "request_fields", "response_fields"),
    [
        ("int8 a\n---\nint8 b", (A,), (B,)),
        ("int8 a\r\n---\r\nint8 b\r\n", (A,), (B,)),
        ("---\nint8 b", EMPTY, (B,)),
        ("int8 a\n---", (A,), EMPTY),
        ("---", EMPTY, EMPTY),
        ("\n---\n", EMPTY, EMPTY),
        ("# ---\n---\n# ---", EMPTY, EMPTY),
        ("int8 a\n---\nint8 a", (A,), (A,)),
    ],
)
def test_services(
    text: str, request_fields: tuple[Field, ...], response_fields: tuple[Field, ...], tmp_path: Path
) -> None:
    service = parse(text, DO)
    assert service == Service(
        DO,
        Message(DO.sibling("_Request"), request_fields),
        Message(DO.sibling("_Response"), response_fields),
    )
    assert isinstance(service, Service)
    assert service.text == text
    theirs = official(text, DO, tmp_path)
    assert theirs is not None
    assert facts(service) == facts(theirs)


@pytest.mark.parametrize(
    ("text", "fields"),
    [
        ("int8 a\n---\nint8 b\n---\nint8 c", [(A,), (B,), (C,)]),
        ("---\n---", [EMPTY, EMPTY, EMPTY]),
        ("---\nint8 b\n---\n", [EMPTY, (B,), EMPTY]),
    ],
)
def test_actions(text: str, fields: list[tuple[Field, ...]], tmp_path: Path) -> None:
    action = parse(text, GO)
    goal, result, feedback = (
        Message(GO.sibling(suffix), each)
        for suffix, each in zip(("_Goal", "_Result", "_Feedback"), fields, strict=True)
    )
    assert action == Action(GO, goal, result, feedback)
    assert isinstance(action, Action)
    assert action.text == text
    theirs = official(text, GO, tmp_path)
    assert theirs is not None
    assert facts(action) == facts(theirs)


def test_comments_and_constants_of_the_parts(tmp_path: Path) -> None:
    text = """# request
# [s]

# first
int8 A=1 # [m]
int8 a
# last
---
# response
int8 A=2
int8 b # [s]
  # more
"""
    service = parse(text, DO)
    assert isinstance(service, Service)
    request, response = service.request, service.response
    assert (request.comment, response.comment) == (("request", "[s]", "", "last"), ("response",))
    assert request.constants == (Constant("A", INT8, 1),)
    assert (request.constants[0].comment, request.constants[0].unit) == (("first", "[m]"), "m")
    assert response.constants == (Constant("A", INT8, 2),)
    assert (response.fields[0].comment, response.fields[0].unit) == (("more",), "s")
    assert response.fields[0].location == Location("Do.srv", 11, 6)
    theirs = official(text, DO, tmp_path)
    assert theirs is not None
    assert facts(service) == facts(theirs)


# Errors

LOWER = "use lower case letters, digits and single underscores, beginning with a letter"
UPPER = "use upper case letters, digits and single underscores, beginning with a letter"
CAMEL = "use letters and digits, beginning with an upper case letter"
EQUALS = (
    "a line with '=' defines a constant, and its name has no spaces; "
    "the default value of a field is written without '=' and cannot contain one"
)
BROKEN = (
    r"ROS 2 replaces escape sequences twice, and the string is broken after the "
    r"first time; double each backslash: \\n is a line break, \\\\ a backslash"
)
ESCAPES = (
    r"ROS 2 cannot read the escape sequences of this string; write "
    r"characters as they are, in UTF-8, and a backslash as \\\\"
)
COMMENT = (
    "ROS 2 takes a backslash in a comment for an escape sequence, and cannot read this one; "
    r"write \\\\ for a backslash"
)
ARRAY = (
    "ROS 2 cannot read this default of an array; "
    "it takes finite numbers, and strings without quotes and backslashes"
)
ALONE = (
    "expected 1 line '---', between request and response, found 0; "
    "such a line has nothing else on it, spaces included"
)

# Each row: what is defined, the text, line and column of the error, its message
ERRORS: list[tuple[TypeName, str, str, str]] = [
    (FOO, "int32", "1:1", "expected a type and a name, found only 'int32'"),
    (FOO, "int32  # only a type", "1:1", "expected a type and a name, found only 'int32'"),
    (
        FOO,
        " int32 x",
        "1:2",
        "ROS 2 does not accept an indented field or constant; begin it in the first column",
    ),
    (
        FOO,
        "\tint32 x",
        "1:2",
        "ROS 2 does not accept an indented field or constant; begin it in the first column",
    ),
    (
        FOO,
        "int32 x\n  int32 y",
        "2:3",
        "ROS 2 does not accept an indented field or constant; begin it in the first column",
    ),
    (FOO, "---", "1:1", "expected a type and a name, found only '---'"),
    (FOO, "int32\tX", "1:7", f"'X' is not a valid field name; {LOWER}"),
    (FOO, "int32 xY", "1:7", f"'xY' is not a valid field name; {LOWER}"),
    (FOO, "int32 x_", "1:7", f"'x_' is not a valid field name; {LOWER}"),
    (FOO, "int32 x__y", "1:7", f"'x__y' is not a valid field name; {LOWER}"),
    (FOO, "int32 _x", "1:7", f"'_x' is not a valid field name; {LOWER}"),
    (FOO, "int32 1x", "1:7", f"'1x' is not a valid field name; {LOWER}"),
    (FOO, "int32 x-y", "1:7", f"'x-y' is not a valid field name; {LOWER}"),
    (FOO, "int32 é", "1:7", f"'é' is not a valid field name; {LOWER}"),
    (FOO, "int32[] x\nstring x", "2:8", "'x' is defined twice, first in line 1"),
    (FOO, "int32 A=1\nint32 B=2\nint8 A=3", "3:6", "'A' is defined twice, first in line 1"),
    (FOO, "int32 a=1", "1:7", f"'a' is not a valid constant name; {UPPER}"),
    (FOO, "int32 Aa=1", "1:7", f"'Aa' is not a valid constant name; {UPPER}"),
    (FOO, "int32 A_=1", "1:7", f"'A_' is not a valid constant name; {UPPER}"),
    (FOO, "int32 A__B=1", "1:7", f"'A__B' is not a valid constant name; {UPPER}"),
    (FOO, "int32 =1", "1:7", "expected the name of a constant before '='"),
    (
        FOO,
        "int32 x 5 = 3",
        "1:7",
        EQUALS,
    ),
    (
        FOO,
        'string x "a=b"',
        "1:8",
        EQUALS,
    ),
    (
        FOO,
        "string<=5 X=a",
        "1:1",
        "a constant cannot be of type 'string<=5'; use a number, bool, string or wstring",
    ),
    (
        FOO,
        "int32[] X=[1]",
        "1:1",
        "a constant cannot be of type 'int32[]'; use a number, bool, string or wstring",
    ),
    (FOO, "Foo X=1", "1:1", "a constant cannot be of type 'Foo'; use a number, bool, string or wstring"),
    (
        FOO,
        "bar/Foo X=1",
        "1:1",
        "a constant cannot be of type 'bar/Foo'; use a number, bool, string or wstring",
    ),
    (FOO, "foo x", "1:1", f"'foo' is neither a primitive type nor the name of a message; {CAMEL}"),
    (FOO, "double x", "1:1", "'double' is not a type in .msg; use float64"),
    (FOO, "uint[] x", "1:1", "'uint' is not a type in .msg; use uint32 or uint64"),
    (
        FOO,
        "foo/Bar/Baz x",
        "1:1",
        f"'foo/Bar/Baz' is not a type: 'foo/Bar' is not a valid package name; {LOWER}",
    ),
    (FOO, "Foo_bar x", "1:1", f"'Foo_bar' is neither a primitive type nor the name of a message; {CAMEL}"),
    (FOO, "foo_/Bar x", "1:1", f"'foo_/Bar' is not a type: 'foo_' is not a valid package name; {LOWER}"),
    (FOO, "Foo/Bar x", "1:1", f"'Foo/Bar' is not a type: 'Foo' is not a valid package name; {LOWER}"),
    (FOO, "/Bar x", "1:1", f"'/Bar' is not a type: '' is not a valid package name; {LOWER}"),
    (FOO, "foo/ x", "1:1", f"'foo/' is neither a primitive type nor the name of a message; {CAMEL}"),
    (
        FOO,
        "std_msgs/msg/Header x",
        "1:1",
        "'std_msgs/msg/Header' is not written with '/msg/' in .msg; use std_msgs/Header",
    ),
    (FOO, "time x", "1:1", "'time' is a ROS 1 type; use builtin_interfaces/Time"),
    (FOO, "duration[] x", "1:1", "'duration' is a ROS 1 type; use builtin_interfaces/Duration"),
    (FOO, "int32[ x", "1:1", "'int32[' is not a type; arrays have one pair of brackets"),
    (FOO, "int32] x", "1:1", "'int32]' is not a type; arrays have one pair of brackets"),
    (FOO, "int32[3][4] x", "1:1", "'int32[3][4]' is not a type; arrays have one pair of brackets"),
    (FOO, "int32[]3 x", "1:1", "'int32[]3' is not a type; arrays have one pair of brackets"),
    (FOO, "int32[0] x", "1:1", "the size of array type 'int32[0]' must be a whole number above 0, not '0'"),
    (
        FOO,
        "int32[-1] x",
        "1:1",
        "the size of array type 'int32[-1]' must be a whole number above 0, not '-1'",
    ),
    (
        FOO,
        "int32[<=0] x",
        "1:1",
        "the size of array type 'int32[<=0]' must be a whole number above 0, not '0'",
    ),
    (FOO, "int32[<=] x", "1:1", "the size of array type 'int32[<=]' must be a whole number above 0, not ''"),
    (
        FOO,
        "int32[<5] x",
        "1:1",
        "the size of array type 'int32[<5]' must be a whole number above 0, not '<5'",
    ),
    (FOO, "int32[n] x", "1:1", "the size of array type 'int32[n]' must be a whole number above 0, not 'n'"),
    (FOO, "string<=0 x", "1:1", "the bound of 'string<=0' must be a whole number above 0, not '0'"),
    (FOO, "string<=x y", "1:1", "the bound of 'string<=x' must be a whole number above 0, not 'x'"),
    (FOO, "string<= y", "1:1", "the bound of 'string<=' must be a whole number above 0, not ''"),
    (FOO, "string<5 x", "1:1", f"'string<5' is neither a primitive type nor the name of a message; {CAMEL}"),
    (FOO, "wstring<=-1 x", "1:1", "the bound of 'wstring<=-1' must be a whole number above 0, not '-1'"),
    (FOO, "int8 x 128", "1:8", "'128' does not fit int8, which goes from -128 to 127"),
    (FOO, "int8 x -129", "1:8", "'-129' does not fit int8, which goes from -128 to 127"),
    (FOO, "uint8 X=256", "1:9", "'256' does not fit uint8, which goes from 0 to 255"),
    (FOO, "uint16 x -1", "1:10", "'-1' does not fit uint16, which goes from 0 to 65535"),
    (FOO, "int32 x 1.0", "1:9", "expected a whole number from -2147483648 to 2147483647, not '1.0'"),
    (FOO, "int32 x 0x", "1:9", "expected a whole number from -2147483648 to 2147483647, not '0x'"),
    (FOO, "int32 x ten", "1:9", "expected a whole number from -2147483648 to 2147483647, not 'ten'"),
    (FOO, "int32 X=", "1:9", "expected a whole number from -2147483648 to 2147483647, not ''"),
    (FOO, "int32 x 1 2", "1:9", "expected a whole number from -2147483648 to 2147483647, not '1 2'"),
    (
        FOO,
        "uint64 X=18446744073709551616",
        "1:10",
        "'18446744073709551616' does not fit uint64, which goes from 0 to 18446744073709551615",
    ),
    (FOO, "byte x -1", "1:8", "'-1' does not fit byte, which goes from 0 to 255"),
    (FOO, "byte x a", "1:8", "expected a whole number from 0 to 255, not 'a'"),
    (FOO, "char X='a'", "1:8", "expected a whole number from 0 to 255, not \"'a'\""),
    (FOO, "bool x yes", "1:8", "a bool must be true, false, 1 or 0, not 'yes'"),
    (FOO, "bool X=2", "1:8", "a bool must be true, false, 1 or 0, not '2'"),
    (FOO, "float32 x 1,5", "1:11", "expected a number with '.' as its decimal point, not '1,5'"),
    (FOO, "float64 X=pi", "1:11", "expected a number with '.' as its decimal point, not 'pi'"),
    (FOO, "float64 x 0x10", "1:11", "expected a number with '.' as its decimal point, not '0x10'"),
    (FOO, "Foo x 1", "1:7", "a field that is a message cannot have a default value"),
    (FOO, "Foo[] x []", "1:9", "a field that is a message cannot have a default value"),
    (FOO, "int32[] x 1", "1:11", "the default of an array must stand in brackets, not '1'"),
    (FOO, "int32[] x [1", "1:11", "the default of an array must stand in brackets, not '[1'"),
    (FOO, "int32[] x [", "1:11", "the default of an array must stand in brackets, not '['"),
    (FOO, "int32[2] x [1]", "1:12", "the default of an array of 2 must have 2 elements, not 1"),
    (FOO, "int32[<=2] x [1, 2, 3]", "1:14", "the default of a sequence of at most 2 cannot have 3 elements"),
    (FOO, "int32[] x [1, a]", "1:11", "expected a whole number from -2147483648 to 2147483647, not 'a'"),
    (FOO, "int32[] x [1,]", "1:11", "expected a whole number from -2147483648 to 2147483647, not ''"),
    (
        FOO,
        "int32[] x [1, 300000000000]",
        "1:11",
        "'300000000000' does not fit int32, which goes from -2147483648 to 2147483647",
    ),
    (FOO, "bool[] x [maybe]", "1:10", "a bool must be true, false, 1 or 0, not 'maybe'"),
    (
        FOO,
        "float64[] x [nan]",
        "1:13",
        ARRAY,
    ),
    (
        FOO,
        "float64[1] x [-inf]",
        "1:14",
        ARRAY,
    ),
    (FOO, "string<=3 x abcd", "1:13", "the string has 4 characters, more than its bound of 3"),
    (FOO, 'string<=3[] x ["abcd"]', "1:15", "the string has 4 characters, more than its bound of 3"),
    (FOO, 'string x "a"b"', "1:10", r"a quote inside a string must be written \""),
    (FOO, "string X='it's'", "1:10", r"a quote inside a string must be written \'"),
    (
        FOO,
        r'string x "a\nb"',
        "1:10",
        BROKEN,
    ),
    (
        FOO,
        r'string x "\u00f6"',
        "1:10",
        ESCAPES,
    ),
    (
        FOO,
        "string X=a\\",
        "1:10",
        ESCAPES,
    ),
    (
        FOO,
        r"string X=\xq",
        "1:10",
        ESCAPES,
    ),
    (FOO, r"string X=\\x4", "1:10", r"an escape sequence '\x' has two digits, not only '4'"),
    (FOO, "string[] x [,]", "1:12", "expected a string before ',' or ']'"),
    (FOO, "string[] x [a,,b]", "1:12", "expected a string before ',' or ']'"),
    (FOO, "string[] x [ ]", "1:12", "expected a string before ',' or ']'"),
    (FOO, 'string[] x ["a", ]', "1:12", "expected a string before ',' or ']'"),
    (FOO, 'string[] x ["a]', "1:12", 'a string has no closing "'),
    (
        FOO,
        'string[] x ["ö"]',
        "1:12",
        "ROS 2 only reads ASCII characters in the default of an array of strings",
    ),
    (FOO, "string[] x ['\"\\\\']", "1:12", "a string has no closing '"),
    (
        FOO,
        "int32 x " + "9" * 100,
        "1:9",
        f"'{'9' * 60}'... does not fit int32, which goes from -2147483648 to 2147483647",
    ),
    (
        FOO,
        "int32 " + "x" * 300 + "é",
        "1:7",
        f"'xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx'... is not a valid field name; {LOWER}",
    ),
    (FOO, "int8 a\rint8 a", "2:6", "'a' is defined twice, first in line 1"),
    (FOO, "int32 X\t=\t\tten", "1:12", "expected a whole number from -2147483648 to 2147483647, not 'ten'"),
    (DO, "", "1:1", "expected 1 line '---', between request and response, found 0"),
    (
        DO,
        "int8 a\n--- \nint8 b",
        "2:1",
        ALONE,
    ),
    (
        DO,
        "int8 a\n ---\n",
        "2:1",
        ALONE,
    ),
    (DO, "---\n---", "2:1", "expected 1 line '---', between request and response, found 2"),
    (
        DO,
        "int8 a\n---\nint8 b\n---\nint8 c\n---",
        "4:1",
        "expected 1 line '---', between request and response, found 3",
    ),
    (DO, "int8 a\n---\nint8 b\nint8 b", "4:6", "'b' is defined twice, first in line 3"),
    (DO, "int8 a\n----\nint8 b", "3:1", "expected 1 line '---', between request and response, found 0"),
    (GO, "", "1:1", "expected 2 lines '---', between goal, result and feedback, found 0"),
    (GO, "int8 a\n---\nint8 b", "3:1", "expected 2 lines '---', between goal, result and feedback, found 1"),
    (GO, "---\n---\n---", "3:1", "expected 2 lines '---', between goal, result and feedback, found 3"),
    # A backslash in a comment
    (FOO, r"int8 x # C:\new", "1:12", COMMENT),
    (FOO, "int8 x # goes on \\", "1:18", COMMENT),
    (FOO, "# of the message \\q\n# \\\n\nint8 x", "2:3", COMMENT),
    (FOO, "# above\nint8 X=1\n# \\x4\nint8 x", "3:3", COMMENT),
    (FOO, "int8 x\n  # below \\u20ac", "2:11", COMMENT),
    (FOO, "int8 x # [\\n]", "1:11", COMMENT),
    (DO, "---\nint8 x # \\N", "2:10", COMMENT),
    (GO, "---\n\n---\nint8 A", "4:6", f"'A' is not a valid field name; {LOWER}"),
]


@pytest.mark.parametrize(
    ("name", "text", "place", "message"), ERRORS, ids=[f"{row[0].name}: {row[1][:50]!r}" for row in ERRORS]
)
def test_errors(name: TypeName, text: str, place: str, message: str, tmp_path: Path) -> None:
    first_line, *_ = error_of(text, name).split("\n")
    assert first_line == f"{name.name}.{name.namespace}:{place}: {message}"
    assert official(text, name, tmp_path) is None


@pytest.mark.parametrize(
    ("text", "error"),
    [
        (
            "# file\n\nint8 a\nint8 b 128 # too large",
            "Foo.msg:4:8: '128' does not fit int8, which goes from -128 to 127\n"
            "  int8 b 128 # too large\n"
            "         ^",
        ),
        (
            "int8\t\t1a\r\n",
            f"Foo.msg:1:7: '1a' is not a valid field name; {LOWER}\n  int8\t\t1a\n      \t\t^",
        ),
        (
            "int8 a\fint8 b\rint8 a",
            "Foo.msg:3:6: 'a' is defined twice, first in line 1\n  int8 a\n       ^",
        ),
    ],
)
def test_errors_show_the_line(text: str, error: str) -> None:
    assert error_of(text) == error


@pytest.mark.parametrize(
    ("name", "error"),
    [
        (TypeName("pkg", "msg", "foo"), f"foo.msg: 'foo' is not a valid message name; {CAMEL}"),
        (TypeName("pkg", "msg", "My_Foo"), f"My_Foo.msg: 'My_Foo' is not a valid message name; {CAMEL}"),
        (TypeName("pkg", "srv", "do"), f"do.srv: 'do' is not a valid message name; {CAMEL}"),
        (TypeName("Pkg", "msg", "Foo"), f"Foo.msg: 'Pkg' is not a valid package name; {LOWER}"),
        (TypeName("my-pkg", "msg", "Foo"), f"Foo.msg: 'my-pkg' is not a valid package name; {LOWER}"),
        (TypeName("pkg_", "action", "Go"), f"Go.action: 'pkg_' is not a valid package name; {LOWER}"),
    ],
    ids=str,
)
def test_names_that_are_not_valid(name: TypeName, error: str, tmp_path: Path) -> None:
    text = "---\n" * {"msg": 0, "srv": 1, "action": 2}[name.namespace]
    assert error_of(text, name) == error
    assert official(text, name, tmp_path) is None


# Garbage

FRAGMENTS = (
    *("int8", "bool", "string", "wstring<=3", "float64", "Foo", "a/B", "[]", "[3]", "[<=2]", "x", "y_1"),
    *("X", "=", "1", "-5", "true", "nan", "0x1F", "a,b", "[1,2]", "---", "\\", "\\n"),
    *" \t\n\r\f#\"'[]=,",
    "é",
    "\u2028",
    "\ufeff",
    "\x00",
    "['a', \"b\"]",
    '"a\\"b"',
)
GARBAGE = st.one_of(
    st.text(max_size=80),
    st.lists(st.sampled_from(FRAGMENTS), max_size=30).map("".join),
    st.lists(st.sampled_from(FRAGMENTS), max_size=30).map(" ".join),
)
SAMPLES = (
    [text for text, _ in FIELDS] + [text for text, _ in CONSTANTS] + ["int8 a\n---\nint8 b\n---\nint8 c"]
)


def read_or_refuse(text: str) -> None:
    """Check that each reader gives a model, or the error for definitions."""
    for name in (FOO, DO, GO):
        try:
            interface = parse(text, name)
        except DefinitionError as error:
            assert str(error).startswith(f"{name.name}.{name.namespace}:")
            continue
        assert interface.name == name
        for message in parts(interface):
            assert message.fields
            hash(message)


@given(GARBAGE)
@settings(max_examples=1000, deadline=None)
def test_garbage(text: str) -> None:
    read_or_refuse(text)


@given(st.randoms(use_true_random=False))
@settings(max_examples=500, deadline=None)
def test_mutated_definitions(choice: random.Random) -> None:
    text = "\n".join(choice.sample(SAMPLES, 3))
    for _ in range(choice.randrange(1, 4)):
        start = choice.randrange(len(text) + 1)
        text = text[:start] + choice.choice(("", *FRAGMENTS)) + text[start + choice.randrange(3) :]
    read_or_refuse(text)


@pytest.mark.parametrize(
    "text",
    [
        "int32 " + "A" * 100_000 + "b=1",
        "int32 x_" + "_1" * 50_000,
        "int32[" * 50_000 + " x",
        "int32 x " + "9" * 100_000,
        "int32 X=0x" + "f" * 100_000,
        "float64 x 1e" + "9" * 100_000,
        "string x " + "\\" * 100_001,
        "string x " + "\"'" * 50_000,
        "string[] x [" + "'\\'" * 20_000 + "]",
        "int8[] x [" + "[" * 50_000 + "]" * 50_000 + "]",
        "int8 x #" + "[" * 50_000,
        "int8 x #" + " " * 5_000 + "[",
        "\n" * 100_000 + "x",
    ],
    ids=lambda text: repr(text[:12]),
)
def test_long_lines_take_no_long_time(text: str) -> None:
    read_or_refuse(text)
