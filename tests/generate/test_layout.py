"""Generated Python is laid out as black would: each form of statement at every length, and whole modules."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from functools import cache

import black
import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from rosidl_adapter_proto.errors import DefinitionError
from rosidl_adapter_proto.generate import Options, Request
from rosidl_adapter_proto.generate.targets import Generation, python
from rosidl_adapter_proto.generate.targets.python import layout as layout_module
from rosidl_adapter_proto.generate.targets.python.layout import LINE_LENGTH, Layout, quoted
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import Source, prefix_sources, store_source, text_source
from rosidl_adapter_proto.interfaces.model import TypeName
from rosidl_adapter_proto.interfaces.store import distributions
from rosidl_adapter_proto.schema.descriptor import file_descriptor
from rosidl_adapter_proto.schema.numbering import HashNumbering, Numbering, SequentialNumbering
from rosidl_adapter_proto.schema.proto import proto_file

STORE = store_source("kilted")

HEAD = "{}\n    pass\n"
CLASS = "class A:\n{}\n"
METHOD = "class A:\n    def f(self):\n        try:\n{}\n        except E:\n            pass\n"
ARGUMENTS = "class A:\n    def f(\n        self,\n{}\n    ) -> None: ...\n"
STUB = "class A:\n    @property\n{}\n"

Form = tuple[str, Callable[[Layout, str], str]]


def statement(text: str) -> Form:
    """A line of a conversion; N is the name that has every length."""
    return METHOD, lambda layout, name: layout.statement(text.replace("N", name), " " * 12)


LONG = "some_other_name_that_is_long_by_itself_already"

FORMS: Mapping[str, Form] = {
    "value": statement("message.N = source.N"),
    "call": statement("message.N = float32(source.N)"),
    "calls": statement("message.N = text(string(source.N), 30)"),
    "range": statement("message.N = in_range(source.N, -128, 127)"),
    "keyword": statement('setattr(message, "from", in_range(getattr(source, "from"), -128, 127), N)'),
    "keyword alone": statement('setattr(message, "from", N)'),
    "nested": statement("NAdapter.fill_custom(source.N, message.N)"),
    "nested, one long": statement(f"N.fill_ros_message(source.{LONG}, message.{LONG})"),
    "each": statement("fill_each(NAdapter.fill_custom, at_most(source.N, 3), message.N)"),
    "messages": statement("message.N = ros_messages(NAdapter, absent_or_exactly(source.N, 3))"),
    "message array": statement(f"message.N = ros_message_array({LONG}, source.N, 3)"),
    "bytes": statement('message.N = numbers(exactly(source.N, 32), "B").tobytes()'),
    "unchecked bytes": statement('message.N = numbers(source.N, "B").tobytes()'),
    "packed": statement('message.MergeFromString(packed(149849856, numbers(exactly(source.N, 3), "f")))'),
    "packed, hidden": statement(
        'type(message).MergeFromString(message, packed(149849856, numbers(exactly(source.N, 3), "f")))'
    ),
    "varints": statement('message.N.extend(numbers(at_most(source.N, 3), "h").tolist())'),
    "fill": statement('fill_array(message.N, array_of(arrays[12], "f"))'),
    "fill from elements": statement('fill_array(message.N, elements(source.N, "h"))'),
    "from bytes": statement('message.N.frombytes(elements(source.N, "h").tobytes())'),
    "from packed": statement("message.N.frombytes(arrays[0])"),
    "check": statement("at_most(source.N, 3)"),
    "delete": statement("del message.N[:]"),
    "values": statement("message.N.extend(each(string, sequence(exactly(source.N, 3))))"),
    "values, in order": statement(
        "message.N.extend(each(lambda value: in_range(value, 0, 255), sequence(source.N)))"
    ),
    "list": statement("message.N = list(at_most(source.N, 3))"),
    "or zeros": statement("message.N = list(absent_or_exactly(source.N, 3)) or [False] * 3"),
    "or zeros, converted": statement(
        'message.N = each(lambda value: text(ros_wide(value), 2), absent_or_exactly(source.N, 3)) or [""] * 3'
    ),
    "keyword or zeros": statement('setattr(message, "from", list(exactly(source.N, 3)) or [b"\\0"] * 3)'),
    "arrays": statement("arrays = packed_fields(source, N, 2, 3)"),
    "finish": statement("return finish_ros_message(message, destination, NAdapter)"),
    "field": (METHOD, lambda layout, name: layout.assignment("field", quoted(name), " " * 12)),
    "in progress": (METHOD, lambda layout, name: layout.field_in_progress(name, " " * 12)),
    "class": (HEAD, lambda layout, name: layout.statement(f"class B(adapter.A[{name}, typing.Any]):")),
    "class, both": (
        HEAD,
        lambda layout, name: layout.statement(f"class {name}(adapter.A[{name}, typing.Any]):"),
    ),
    "group": (
        HEAD,
        lambda layout, name: layout.statement(f"class N(adapter.A[{name}_Goal, {name}_Result, {name}_X]):"),
    ),
    "message": (HEAD, lambda layout, name: layout.statement(f"class {name}(_message.Message):")),
    "part": (CLASS, lambda layout, name: layout.statement(f"goal: type[{name}] = {name}", "    ")),
    "alias": (CLASS, lambda layout, name: layout.statement(f"Request: typing.TypeAlias = {name}", "    ")),
    "other name": ("{}\n", lambda layout, name: layout.statement(f"{name} = {name}Adapter")),
    "name": (CLASS, lambda layout, name: layout.assignment("type_name", quoted(name), "    ")),
    "constant": (CLASS, lambda layout, name: layout.assignment(f"{name}: typing.Final", "1.5", "    ")),
    "string": (CLASS, lambda layout, name: layout.assignment("NAME: typing.Final", quoted(name), "    ")),
    "both": (CLASS, lambda layout, name: layout.assignment(f"{name}: typing.Final", quoted(name), "    ")),
    "infinity": (
        CLASS,
        lambda layout, name: layout.assignment(f"{name}: typing.Final", 'float("inf")', "    "),
    ),
    "number": (CLASS, lambda layout, name: layout.assignment("A: typing.Final", "1" * len(name), "    ")),
    "one default": (
        CLASS,
        lambda layout, name: layout.dictionary("defaults", [('"a"', quoted(name))], "    "),
    ),
    "list of strings": (
        CLASS,
        lambda layout, name: layout.dictionary("defaults", [('"a"', (quoted(name), '"b"'))], "    "),
    ),
    "list of one": (
        CLASS,
        lambda layout, name: layout.dictionary("defaults", [('"a"', (quoted(name),))], "    "),
    ),
    "defaults": (
        CLASS,
        lambda layout, name: layout.dictionary(
            "defaults", [(quoted(name), "1"), ('"b"', quoted(name)), ('"c"', (quoted(name), '""'))], "    "
        ),
    ),
    "one field": (
        CLASS,
        lambda layout, name: layout.tuple_of("fields", [f'adapter.FieldInfo("{name}", 15)'], "    "),
    ),
    "one nested field": (
        CLASS,
        lambda layout, name: layout.tuple_of("fields", [f'adapter.FieldInfo("a", 1, 0, 0, {name})'], "    "),
    ),
    "fields": (
        CLASS,
        lambda layout, name: layout.tuple_of(
            "fields", [f'adapter.FieldInfo("{name}", 145, 0, 0, {name})', 'adapter.FieldInfo("a", 1)'], "    "
        ),
    ),
    "scalar argument": (
        ARGUMENTS,
        lambda layout, name: layout.argument(name, "_builtins.int", "...", " " * 8),
    ),
    "message argument": (ARGUMENTS, lambda layout, name: layout.argument("a", name, "None", " " * 8)),
    "repeated argument": (
        ARGUMENTS,
        lambda layout, name: layout.argument(name, f"_typing.Iterable[{name}]", "...", " " * 8),
    ),
    "repeated argument, short": (
        ARGUMENTS,
        lambda layout, name: layout.argument("a", f"_typing.Iterable[_a.{name}]", "...", " " * 8),
    ),
    "property": (STUB, lambda layout, name: layout.definition(name, "self", "_b.A", " ...", "    ")),
    "message property": (
        STUB,
        lambda layout, name: layout.definition("a", "self", f"_b.{name}", " ...", "    "),
    ),
    "repeated property": (
        STUB,
        lambda layout, name: layout.definition(name, "_self", "_containers.R[_builtins.int]", " ...", "    "),
    ),
    "repeated messages": (
        STUB,
        lambda layout, name: layout.definition("a", "self", f"_containers.R[_b.{name}]", " ...", "    "),
    ),
    "described property": (
        STUB + '        """\n        Text.\n        """\n',
        lambda layout, name: layout.definition(name, "self", "_containers.R[_b.C]", "", "    "),
    ),
    "import": ("{}\n", lambda layout, name: layout.import_from("a.b.c", name)),
    "import as": ("{}\n", lambda layout, name: layout.import_from(f"a.b.{name}", f"{name} as other")),
    "indented import": ("if A:\n{}\n", lambda layout, name: layout.import_from("a.b", name, "    ")),
}

# What nobody has, and what becomes of it only black knows.
LEFT_TO_BLACK = {"number", "keyword or zeros"}


@cache
def formatted(text: str, *, stub: bool = False) -> str:
    """Return Python as black has it."""
    return black.format_str(text, mode=black.Mode(is_pyi=stub))


@pytest.mark.parametrize("form", FORMS)
def test_every_form_at_every_length(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    frame, laid_out = FORMS[form]
    stub = frame in (ARGUMENTS, STUB)
    longest_complete = 0
    for length in range(1, LINE_LENGTH + 20):
        name = "x" * length
        layout = Layout()
        text = frame.format(laid_out(layout, name))
        with monkeypatch.context() as context:
            context.setattr(layout_module, "LINE_LENGTH", 10**6)
            in_one_line = frame.format(laid_out(Layout(), name))
        if layout.is_complete(text):
            assert text == formatted(in_one_line, stub=stub), length
            longest_complete = length
    assert form in LEFT_TO_BLACK or longest_complete > 40


TEXTS = st.text(st.characters(exclude_categories=["Cs"]) | st.sampled_from("'\"\\ \0ä字"))


@given(TEXTS | st.binary() | TEXTS.map(lambda text: text.encode("utf-16-le")))
def test_quotes(value: str | bytes) -> None:
    assert f"a = {quoted(value)}\n" == formatted(f"a = {value!r}\n") or len(quoted(value)) > LINE_LENGTH - 4
    assert ast.literal_eval(quoted(value)) == value


# What may stand in a line of a comment, and what black heeds there.
WORDS = st.sampled_from(
    (
        *(
            "",
            " ",
            "  ",
            "\t",
            "#",
            "'",
            '"',
            '"""',
            "\\",
            "\\\\",
            "\\x4F",
            "\\N{DASH}",
            "\N{NO-BREAK SPACE}",
        ),
        *("type:", "type: ignore", "fmt: off", "fmt: on", "fmt: skip", "noqa", "!", ":", "{{", "%}"),
        *("字" * 50, "word", "word " * 20),
    )
)
COMMENTS = st.lists(st.lists(WORDS, max_size=4).map("".join), max_size=4)
NAMES = st.integers(1, 100).map(lambda length: ("name" * 25)[:length]) | st.sampled_from(
    ["from", "self", "int", "property", "none", "fields", "source", "a", "type", "cls"]
)
TYPES = st.sampled_from(
    (
        *("bool", "byte", "char", "uint8", "int16", "float32", "int64", "string", "wstring", "string<=3"),
        *("std_msgs/Header", "visualization_msgs/InteractiveMarkerControl", "geometry_msgs/Point"),
    )
)
SUFFIXES = st.sampled_from(["", "[]", "[3]", "[<=3]"])
STRINGS = st.text(st.sampled_from("ab '\"xä字#="), max_size=100).map(
    lambda text: '"' + text.replace('"', '\\"') + '"'
)
DEFAULTS = {
    "string": STRINGS,
    "wstring": STRINGS,
    "int16[]": st.lists(st.integers(-5, 5), max_size=40).map(str),
    "string[3]": st.lists(STRINGS, min_size=3, max_size=3).map(lambda values: f"[{', '.join(values)}]"),
    "float32": st.floats(-(2.0**100), 2.0**100, width=32).map(str),
    "float64": st.sampled_from(["1e300", "1e-9", "inf", "-1.0"]),
}


@st.composite
def definitions(draw: st.DrawFn) -> str:
    """The text of a message: names of every length, comments and values that look like something to black."""
    lines = []
    for name in draw(st.lists(NAMES, unique=True, max_size=8)):
        lines += [f"# {line}" for line in draw(COMMENTS)]
        if draw(st.booleans()):
            kind = draw(st.sampled_from(sorted(DEFAULTS)))
            lines.append(f"{kind} {name} {draw(DEFAULTS[kind])}")
        else:
            lines.append(f"{draw(TYPES)}{draw(SUFFIXES)} {name}")
        if draw(st.booleans()):
            kind = draw(st.sampled_from(["string", "wstring", "float32", "float64"]))
            lines += [f"# {line}" for line in draw(COMMENTS)]
            lines.append(f"{kind} {name.upper()}={draw(DEFAULTS[kind])}")
    return "\n".join([*(f"# {line}" for line in draw(COMMENTS)), "", *lines, ""])


def modules(source: Source, names: Sequence[TypeName], numbering: Numbering) -> dict[str, str]:
    """Return the Python modules of interfaces, by path, without protoc."""
    catalog = Catalog((source, STORE))
    files = tuple(
        proto_file(catalog.definition(name).interface, numbering, catalog.definition_name, events=True)
        for name in names
    )
    descriptors = {file.path: file_descriptor(file).SerializeToString() for file in files}
    generation = Generation(Request(()), Options(), catalog, files, {}, descriptors)
    made = dict(python.package_files(generation))
    for file in files:
        made.update(python.interface_files(generation, file))
    return {path: content.decode() for path, content in made.items()}


def check_stable(texts: Mapping[str, str]) -> None:
    """Check that black has nothing to change."""
    for path, text in texts.items():
        assert formatted(text, stub=path.endswith("i")) == text, path


@settings(max_examples=100, deadline=None)
@given(definitions(), st.integers(1, 80))
def test_nasty_definitions(text: str, length: int) -> None:
    name = TypeName("a_msgs", "msg", ("Message" * 20)[:length])
    try:
        texts = modules(text_source({name: text}), [name], HashNumbering())
    except DefinitionError:
        reject()
    check_stable(texts)


@pytest.fixture
def left_to_black(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The modules that the layout does not know how to finish."""
    left: list[str] = []

    def remember(text: str, *, stub: bool = False) -> str:
        left.append(text)
        return formatted(text, stub=stub)

    monkeypatch.setattr(python, "format_python", remember)
    return left


@pytest.mark.parametrize("origin", ["installed", *distributions()])
def test_every_interface_there_is(origin: str, left_to_black: list[str]) -> None:
    for source in prefix_sources() if origin == "installed" else [store_source(origin)]:
        names = sorted(name for package in source.packages.values() for name in package)
        for numbering in (HashNumbering(), SequentialNumbering.from_lock("", None)):
            check_stable(modules(source, names, numbering))
    assert not left_to_black
