from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from rosidl_adapter_proto.errors import DefinitionError
from rosidl_adapter_proto.interfaces import store
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.closure import closure, type_closure
from rosidl_adapter_proto.interfaces.find import (
    file_source,
    folder_source,
    installed_sources,
    interface_source,
    prefix_sources,
    store_source,
    text_source,
)
from rosidl_adapter_proto.interfaces.model import Action, Message, Service, TypeName

SERVICE, ACTION = "int8 a\n---\nint8 b\n", "int8 a\n---\nint8 b\n---\nint8 c\n"


def write(folder: Path, files: Mapping[str, str]) -> Path:
    """Write files, given by their paths below `folder`."""
    for path, text in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    return folder


def read(folder: Path, files: Mapping[str, str]) -> Catalog:
    return Catalog((folder_source(write(folder, files)),))


def name(text: str) -> TypeName:
    return TypeName.parse(text)


def message_idl(type_name: str, members: str) -> str:
    package, namespace, last = type_name.split("/")
    return f"module {package} {{ module {namespace} {{ struct {last} {{ {members} }}; }}; }};"


def error_of(function: object, *arguments: object, **options: object) -> str:
    assert callable(function)
    with pytest.raises(DefinitionError) as caught:
        function(*arguments, **options)
    return str(caught.value)


# Folders


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        # A package folder; its name is in package.xml
        ({"msg/A.msg": "", "package.xml": "<package><name> pkg </name></package>"}, ["pkg/msg/A"]),
        (
            {
                "msg/A.msg": "",
                "package.xml": '<?xml version="1.0"?>\n<!-- <name>x</name> -->\n<package format="3">'
                "<author><name>y</name></author><name>pkg</name></package>",
            },
            ["pkg/msg/A"],
        ),
        # A folder of packages, at any depth; without package.xml, a package has the name of its folder
        ({"a/msg/A.msg": "", "b/msg/B.msg": ""}, ["a/msg/A", "b/msg/B"]),
        ({"src/deep/a/msg/A.msg": "", "src/b/srv/B.srv": SERVICE}, ["b/srv/B", "a/msg/A"]),
        ({"x/package.xml": "<package><name>a</name></package>", "x/msg/A.msg": ""}, ["a/msg/A"]),
        # Every kind of interface, in its folder
        (
            {"a/msg/A.msg": "", "a/srv/B.srv": SERVICE, "a/action/C.action": ACTION},
            ["a/action/C", "a/msg/A", "a/srv/B"],
        ),
        ({"a/msg/A.idl": message_idl("a/msg/A", "long x;")}, ["a/msg/A"]),
        # The suffix decides and not the folder, wherever in a package a file is; of an .idl, its folder
        (
            {
                "a/msg/A.msg": "",
                "a/msg/B.srv": SERVICE,
                "a/srv/C.msg": "",
                "a/D.msg": "",
                "a/srv/E.action": ACTION,
            },
            ["a/action/E", "a/msg/A", "a/msg/C", "a/msg/D", "a/srv/B"],
        ),
        (
            {"a/msg/sub/A.msg": "", "a/msg/sub/deep/B.msg": "", "a/srv/s/C.srv": ""},
            ["a/msg/A", "a/msg/B", "a/srv/C"],
        ),
        (
            {
                "x/package.xml": "<package><name>a</name></package>",
                "x/types/A.msg": "",
                "x/api/srv/B.srv": SERVICE,
            },
            ["a/msg/A", "a/srv/B"],
        ),
        (
            {"a/msg/A.idl": "", "a/msg/sub/B.idl": "", "a/D.idl": "", "a/api/srv/C.idl": ""},
            ["a/msg/A", "a/srv/C"],
        ),
        # What is not a definition
        (
            {"a/msg/A.msg": "", "a/msg/A.json": "", "a/msg/B.msg~": "", "a/msg/msg": "", "a/msg/.msg": ""},
            ["a/msg/A"],
        ),
        # A package does not have another one, hidden folders, what is for its tests, and what was built
        ({"a/msg/A.msg": "", "a/b/msg/B.msg": "", "a/b/package.xml": "<package/>"}, ["a/msg/A"]),
        (
            {"a/msg/A.msg": "", "a/test/b/msg/B.msg": "", "a/tests/B.msg": "", "a/msg/.b/B.msg": ""},
            ["a/msg/A"],
        ),
        ({"a/msg/A.msg": "", "a/build/msg/B.msg": "", "a/build/CMakeCache.txt": ""}, ["a/msg/A"]),
        ({"a/msg/A.msg": "", "a/CMakeCache.txt": ""}, ["a/msg/A"]),
        ({"a/msg/A.msg": "", "a/msg/old/B.msg": "", "a/msg/old/COLCON_IGNORE": ""}, ["a/msg/A"]),
        # Packages are not looked for in hidden folders, or where colcon does not look either
        ({"a/msg/A.msg": "", ".b/msg/B.msg": ""}, ["a/msg/A"]),
        ({"a/msg/A.msg": "", "b/msg/B.msg": "", "b/COLCON_IGNORE": ""}, ["a/msg/A"]),
        ({"a/msg/A.msg": "", "b/c/msg/B.msg": "", "b/AMENT_IGNORE": ""}, ["a/msg/A"]),
        ({"a/msg/A.msg": "", "copy/a/msg/A.msg": "", "copy/COLCON_IGNORE": ""}, ["a/msg/A"]),
        # A package without definitions is none
        ({"a/msg/A.msg": "", "b/package.xml": "<package><name>b</name></package>"}, ["a/msg/A"]),
        ({"a/msg/A.msg": "", "other/a/msg/A.h": ""}, ["a/msg/A"]),
    ],
)
def test_folders(files: dict[str, str], expected: list[str], tmp_path: Path) -> None:
    source = folder_source(write(tmp_path, files))
    assert [str(each) for package in source.packages.values() for each in package] == expected
    assert source.origin == str(tmp_path)


def test_symbolic_links_that_lead_back(tmp_path: Path) -> None:
    write(tmp_path, {"a/msg/A.msg": ""})
    (tmp_path / "loop").symlink_to(tmp_path)
    (tmp_path / "again").symlink_to(tmp_path / "a")
    assert list(folder_source(tmp_path).packages) == ["a"]


def test_a_msg_wins_over_the_idl_made_from_it(tmp_path: Path) -> None:
    files = {"a/msg/A.msg": "int8 x", "a/msg/A.idl": message_idl("a/msg/A", "long x;")}
    files |= {
        "a/srv/B.srv": SERVICE,
        "a/srv/B.idl": "broken",
        "a/msg/C.idl": message_idl("a/msg/C", "long x;"),
    }
    package = read(tmp_path, files).package("a")
    assert {str(each): definition.format for each, definition in package.items()} == {
        "a/msg/A": ".msg",
        "a/msg/C": ".idl",
        "a/srv/B": ".srv",
    }


def test_what_a_definition_says(tmp_path: Path) -> None:
    catalog = read(tmp_path, {"a/msg/A.msg": "int8 x", "a/srv/B.srv": SERVICE, "a/action/C.action": ACTION})
    kinds = {"a/msg/A": Message, "a/srv/B": Service, "a/action/C": Action}
    for type_name, kind in kinds.items():
        definition = catalog.definition(name(type_name))
        assert isinstance(definition.interface, kind)
        assert definition.interface.name == definition.name == name(type_name)
        assert definition.origin == str(tmp_path)
        assert definition.file == str(tmp_path / f"{type_name}{definition.format}")
        assert definition.text == definition.interface.text


@pytest.mark.parametrize("suffix", [".msg", ".idl"])
def test_a_byte_order_mark_is_no_part_of_the_definition(suffix: str, tmp_path: Path) -> None:
    # ROS 2 itself refuses such a .msg.
    text = {".msg": "int32 x", ".idl": message_idl("a/msg/A", "long x;")}[suffix]
    catalog = read(tmp_path, {f"a/msg/A{suffix}": "\ufeff" + text})
    assert [each.name for each in catalog.message(name("a/msg/A")).fields] == ["x"]


@pytest.mark.parametrize(
    ("files", "error"),
    [
        (
            {},
            "no interface definitions in {}: give the folder of a package, which has a package.xml or folders "
            "named msg, srv and action, or a folder of such packages",
        ),
        (
            {"x/a/msg/A.msg": "", "y/a/msg/B.msg": ""},
            "package 'a' is in both {}/x/a and {}/y/a; "
            "put a file named COLCON_IGNORE into the one to leave out",
        ),
        (
            {"a/msg/A.msg": "", "a/package.xml": "<package><name/></package>"},
            "{}/a/package.xml has no <name>; give the package one",
        ),
        (
            {"a/msg/A.msg": "", "a/package.xml": "<package>"},
            "{}/a/package.xml is not valid XML: no element found: line 1, column 9",
        ),
    ],
)
def test_errors_of_folders(files: dict[str, str], error: str, tmp_path: Path) -> None:
    assert error_of(folder_source, write(tmp_path, files)) == error.replace("{}", str(tmp_path))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("a/msg/A.msg", "a/msg/deep/A.msg"),
        ("a/msg/b/A.msg", "a/msg/c/A.msg"),
        ("a/api/msg/A.idl", "a/msg/A.idl"),
    ],
)
def test_two_files_of_one_name(one: str, other: str, tmp_path: Path) -> None:
    """Whoever needs neither is not bothered."""
    catalog = read(tmp_path, {one: "", other: "", "a/msg/Other.msg": ""})
    assert catalog.message(name("a/msg/Other")).name == name("a/msg/Other")
    error = (
        f"a/msg/A is defined by both {tmp_path}/{one} and {tmp_path}/{other}: the name of a file makes the name of its "
        "type, whatever folder it is in; rename or remove one"
    )
    assert error_of(lambda: catalog.definition(name("a/msg/A")).text) == error
    assert error_of(closure, catalog, ["a"]) == error
    # A file that is named counts.
    source, type_name = file_source(tmp_path / other)
    assert source.packages["a"][type_name].file == f"{tmp_path}/{other}"
    assert source.packages["a"][type_name].text == ""


@pytest.mark.parametrize(
    "interface", [f"{{}}:{path}" for path in ("msg/A.msg", "msg/sub/A.msg", "types/A.msg", "A.msg")]
)
def test_a_listed_definition(interface: str, tmp_path: Path) -> None:
    """`base:path` as rosidl_generate_interfaces() takes it."""
    text = interface.format(tmp_path)
    (definition,) = interface_source("a", [text, text]).packages["a"].values()
    assert (definition.name, definition.file) == (name("a/msg/A"), text.replace(":", "/"))


def test_listed_definitions_as_rosidl_adapter_takes_them(tmp_path: Path) -> None:
    """What it writes, `msg/A.idl`, tells which type it makes of a file."""
    main = pytest.importorskip("rosidl_adapter.main", reason="needs rosidl_adapter, from the ROS wheels").main
    files = {
        **dict.fromkeys(("msg/A.msg", "msg/deep/er/B.msg", "srv/C.msg", "D.msg", "types/E.msg"), "int8 x"),
        **{
            "msg/F.srv": SERVICE,
            "types/srv/G.srv": SERVICE,
            "msg/H.action": ACTION,
            "action/deep/I.action": ACTION,
        },
    }
    write(tmp_path / "src", files)
    interfaces = [f"{tmp_path}/src:{path}" for path in files]
    write(tmp_path, {"arguments": json.dumps({"non_idl_tuples": interfaces})})
    main(
        [
            *("--package-name", "a", "--arguments-file", f"{tmp_path}/arguments"),
            *("--output-dir", f"{tmp_path}/out", "--output-file", f"{tmp_path}/list/idl"),
        ]
    )
    written = [line.rpartition(":")[2] for line in (tmp_path / "list/idl").read_text().splitlines()]
    ours = interface_source("a", interfaces).packages["a"]
    assert sorted(written) == sorted(f"{each.namespace}/{each.name}.idl" for each in ours)
    assert ours.keys() == folder_source(write(tmp_path / "a", files)).packages["a"].keys()


def test_two_listed_definitions_of_one_name() -> None:
    definitions = interface_source("a", ["/b:msg/A.msg", "/c:msg/A.idl"]).packages["a"]
    assert error_of(lambda: definitions[name("a/msg/A")].text).startswith(
        "a/msg/A is defined by both /b/msg/A.msg and /c/msg/A.idl: "
    )


@pytest.mark.parametrize("path", ["msg/A.txt", "msg/A", "types/A.idl", "msg/sub/A.idl", "A.idl"])
def test_what_is_no_definition_and_listed(path: str) -> None:
    assert error_of(interface_source, "a", [f"/b:{path}"]) == (
        f"/b/{path} is no definition: it has to be a .msg, .srv or .action file, or an .idl file in a folder named "
        "msg, srv or action"
    )


def test_a_folder_that_is_none(tmp_path: Path) -> None:
    assert error_of(folder_source, tmp_path / "x") == f"cannot read {tmp_path}/x: No such file or directory"


# Files that cannot be read


def test_a_definition_that_is_a_folder(tmp_path: Path) -> None:
    (tmp_path / "a" / "msg" / "A.msg").mkdir(parents=True)
    definition = folder_source(tmp_path).packages["a"][name("a/msg/A")]
    assert error_of(lambda: definition.interface) == f"cannot read {tmp_path}/a/msg/A.msg: Is a directory"


def test_a_definition_that_is_gone(tmp_path: Path) -> None:
    catalog = read(tmp_path, {"a/msg/A.msg": ""})
    (tmp_path / "a/msg/A.msg").unlink()
    error = error_of(catalog.message, name("a/msg/A"))
    assert error == f"cannot read {tmp_path}/a/msg/A.msg: No such file or directory"


def test_a_definition_that_is_not_utf_8(tmp_path: Path) -> None:
    catalog = read(tmp_path, {"a/msg/A.msg": ""})
    (tmp_path / "a/msg/A.msg").write_bytes(b"int8 a\nint8 b # gr\xfcn\n")
    error = error_of(catalog.message, name("a/msg/A"))
    assert error == f"{tmp_path}/a/msg/A.msg:2: byte 0xfc is not valid UTF-8; save the file as UTF-8"


def test_a_definition_with_a_mistake(tmp_path: Path) -> None:
    catalog = read(tmp_path, {"a/msg/A.msg": "int8 a\nint9 b"})
    assert error_of(catalog.message, name("a/msg/A")).startswith(f"{tmp_path}/a/msg/A.msg:2:1: 'int9' ")


# Single files


@pytest.mark.parametrize(
    "path",
    ["a/msg/A.msg", "a/srv/A.srv", "a/action/A.action", "a/msg/A.idl", "a/srv/A.idl", "a/action/A.idl"],
)
def test_files(path: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path, {path: "", "a/msg/B.msg": ""})
    expected = TypeName("a", path.split("/")[1], "A")
    source, type_name = file_source(tmp_path / path)
    assert (type_name, source.origin) == (expected, str(tmp_path / path))
    assert set(source.packages["a"]) == {expected, name("a/msg/B")}
    monkeypatch.chdir((tmp_path / path).parent)
    assert file_source(Path(path).relative_to(Path(path).parent))[1] == expected


def test_a_file_wins_over_its_other_format(tmp_path: Path) -> None:
    write(tmp_path, {"a/msg/A.msg": "int8 x", "a/msg/A.idl": message_idl("a/msg/A", "long y;")})
    source, type_name = file_source(tmp_path / "a/msg/A.idl")
    assert [each.name for each in Catalog((source,)).message(type_name).fields] == ["y"]


def test_a_file_of_a_package_with_a_manifest(tmp_path: Path) -> None:
    files = {"x/msg/A.msg": "", "x/api/msg/B.msg": "", "x/C.msg": "", "x/test/D.msg": ""}
    write(tmp_path, {**files, "x/package.xml": "<package><name>a</name></package>"})
    for path in files:
        source, type_name = file_source(tmp_path / path)
        assert type_name == name(f"a/msg/{Path(path).stem}")
        assert set(source.packages["a"]) == {*map(name, ("a/msg/A", "a/msg/B", "a/msg/C")), type_name}


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("a/msg/B.srv", "a/srv/B"),
        ("a/srv/B.msg", "a/msg/B"),
        ("a/msg/deep/B.msg", "a/msg/B"),
        ("a/msg/b/srv/B.srv", "b/srv/B"),
        ("a/msg/b/srv/B.idl", "b/srv/B"),
    ],
)
def test_files_of_a_package_without_a_manifest(path: str, expected: str, tmp_path: Path) -> None:
    """It has the name of the folder that has the next folder named msg, srv or action."""
    assert file_source(write(tmp_path, {path: ""}) / path)[1] == name(expected)


@pytest.mark.parametrize(
    "path", ["A.msg", "a/A.msg", "a/msg/A.txt", "a/msg/A", "a/A.idl", "a/msg/deep/A.idl"]
)
def test_files_outside_a_package(path: str, tmp_path: Path) -> None:
    write(tmp_path, {path: ""})
    assert error_of(file_source, tmp_path / path) == (
        f"{tmp_path}/{path} is not part of a package: a definition is a .msg, .srv or .action file below a folder that "
        "has a package.xml, or below <package>/msg, <package>/srv or <package>/action; an .idl file is in a folder "
        "named msg, srv or action"
    )


# Precedence


def prefix(folder: Path, text: str, package: str = "a") -> Path:
    write(folder, {f"share/{package}/msg/A.msg": text})
    return folder


def test_prefixes_in_their_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    overlay, underlay, python = (tmp_path / each for each in ("overlay", "underlay", "python"))
    prefix(overlay, "int8 a")
    prefix(underlay, "int8 b")
    prefix(underlay, "int8 b", "b")
    prefix(python, "int8 c")
    prefix(python, "int8 c", "c")
    (tmp_path / "empty" / "share").mkdir(parents=True)
    paths = [overlay, tmp_path / "missing", tmp_path / "empty", underlay, overlay]
    monkeypatch.setenv("AMENT_PREFIX_PATH", "::" + ":".join(map(str, paths)))
    monkeypatch.setattr(sys, "prefix", str(python))
    found = prefix_sources()
    assert [each.origin for each in found] == [f"ROS prefix {each}" for each in (overlay, underlay, python)]
    catalog = Catalog(tuple(found))
    fields = {each: catalog.message(name(f"{each}/msg/A")).fields[0].name for each in "abc"}
    assert fields == {"a": "a", "b": "b", "c": "c"}


def test_folders_of_an_installed_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An .idl is in `msg`, and the source where it was: in the last folder of its path, or from Lyrical on in all."""
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    idl_files = {f"share/{each}.idl": "" for each in ("a/msg/A", "a/msg/B", "a/srv/C")}
    sources = {
        "share/a/shapes/A.msg": "",
        "share/a/msg/deep/shapes/B.msg": "",
        "share/a/api/srv/C.srv": SERVICE,
    }
    # What has no such folder is no package of interfaces, and may be large.
    write(tmp_path, {**idl_files, **sources, "share/doc/other/D.msg": ""})
    (source,) = prefix_sources()
    assert {str(each): definition.file for each, definition in source.packages["a"].items()} == {
        "a/msg/A": f"{tmp_path}/share/a/shapes/A.msg",
        "a/msg/B": f"{tmp_path}/share/a/msg/deep/shapes/B.msg",
        "a/srv/C": f"{tmp_path}/share/a/api/srv/C.srv",
    }
    assert list(source.packages) == ["a"]


def test_installed_packages_are_read_when_they_are_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    write(tmp_path, {"share/a/msg/A.msg": "", "share/b/msg/B.msg": "", "share/doc/D.msg": ""})
    (source,) = prefix_sources()
    write(tmp_path, {"share/b/msg/C.msg": ""})
    assert [str(each) for each in source.packages["b"]] == ["b/msg/B", "b/msg/C"]
    assert "doc" not in source.packages
    assert len(source.packages) == 2


def test_everything_that_is_installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    monkeypatch.setattr(sys, "prefix", str(prefix(tmp_path, "int8 a")))
    origins = [each.origin for each in installed_sources("kilted")]
    assert origins == [f"ROS prefix {tmp_path}", "embedded store kilted"]


def test_texts() -> None:
    texts = {"a/msg/A": "int8 a", "a/srv/Do": "---\nint8 b", "b/action/Go": "---\n---\nint8 c"}
    source = text_source({name(each): text for each, text in texts.items()})
    assert {package: [str(each) for each in found] for package, found in source.packages.items()} == {
        "a": ["a/msg/A", "a/srv/Do"],
        "b": ["b/action/Go"],
    }
    catalog = Catalog((source,))
    assert catalog.message(name("b/action/Go_Feedback")).fields[0].name == "c"
    with pytest.raises(DefinitionError, match=r"^a/msg/B:1:1: expected a type and a name, found only 'int8'"):
        _ = text_source({name("a/msg/B"): "int8"}).packages["a"][name("a/msg/B")].interface


def test_without_ament_prefix_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    monkeypatch.setattr(sys, "prefix", str(prefix(tmp_path, "")))
    assert [each.origin for each in prefix_sources()] == [f"ROS prefix {tmp_path}"]
    monkeypatch.setattr(sys, "prefix", str(tmp_path / "nothing"))
    assert prefix_sources() == []


def test_the_first_source_provides_the_whole_package(tmp_path: Path) -> None:
    first = folder_source(write(tmp_path / "1", {"a/msg/A.msg": "int8 first"}))
    second = folder_source(
        write(tmp_path / "2", {"a/msg/A.msg": "int8 second", "a/msg/B.msg": "", "b/msg/B.msg": ""})
    )
    catalog = Catalog((first, second))
    assert list(catalog.package("a")) == [name("a/msg/A")]
    assert catalog.message(name("a/msg/A")).fields[0].name == "first"
    assert catalog.definition(name("b/msg/B")).origin == str(tmp_path / "2")
    assert error_of(catalog.definition, name("a/msg/B")) == (
        f"type 'a/msg/B' was not found in package 'a' of {tmp_path}/1; {tmp_path}/2 has it, but comes later"
    )


def test_shadowed_definitions(tmp_path: Path) -> None:
    mine = folder_source(
        write(
            tmp_path / "1",
            {"std_msgs/msg/String.msg": "string text", "a/msg/A.msg": "int8 a", "a/msg/B.msg": ""},
        )
    )
    other = folder_source(
        write(
            tmp_path / "2",
            {"std_msgs/msg/String.msg": "string data", "a/msg/A.msg": "int8  a # same", "a/msg/B.msg": "?"},
        )
    )
    names = [name("std_msgs/msg/String"), name("a/msg/A"), name("a/msg/B")]
    shadowed = Catalog((mine, other)).shadowed(names)
    assert [(winner.file, loser.file) for winner, loser in shadowed] == [
        (f"{tmp_path}/1/{each}.msg", f"{tmp_path}/2/{each}.msg")
        for each in ("std_msgs/msg/String", "a/msg/B")
    ]
    # The store only stands in for what is nowhere else.
    assert list(Catalog((mine, store_source("kilted"))).shadowed(names)) == []


# Names

PKG = {
    "a/msg/Same.msg": "",
    "a/srv/Same.srv": SERVICE,
    "a/msg/Only.msg": "",
    "a/srv/Do.srv": SERVICE,
    "a/action/Go.action": ACTION,
}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a/Only", "a/msg/Only"),
        ("a/Do", "a/srv/Do"),
        ("a/Go", "a/action/Go"),
        ("a/msg/Only", "a/msg/Only"),
        ("a/srv/Same", "a/srv/Same"),
        ("a/srv/Do_Request", "a/srv/Do"),
        ("a/Do_Response", "a/srv/Do"),
        ("a/srv/Do_Event", "a/srv/Do"),
        *(
            (f"a/action/Go_{part}", "a/action/Go")
            for part in (
                *(
                    "Goal",
                    "Result",
                    "Feedback",
                    "FeedbackMessage",
                    "SendGoal",
                    "GetResult",
                    "SendGoal_Request",
                ),
                *(
                    "SendGoal_Response",
                    "SendGoal_Event",
                    "GetResult_Request",
                    "GetResult_Response",
                    "GetResult_Event",
                ),
            )
        ),
    ],
)
def test_names(text: str, expected: str, tmp_path: Path) -> None:
    catalog = read(tmp_path, PKG)
    assert catalog.interface_name(text) == name(expected)
    found = catalog.type_name(text)
    assert (found.package, found.name) == (text.partition("/")[0], text.rpartition("/")[2])
    assert catalog.definition_name(found) == name(expected)
    if text.count("/") == 2:
        assert found == name(text)
        assert catalog.owner(found) == name(expected)
        assert catalog.message(name(text)).name == name(text)


PLACE = "; looked in {}"


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("a/Same", "'a/Same' could be any of a/msg/Same, a/srv/Same; give the full name"),
        ("a/only", "type 'a/msg/only' was not found in package 'a' of {}; did you mean a/msg/Only?"),
        ("a/msg/Onl", "type 'a/msg/Onl' was not found in package 'a' of {}; did you mean a/msg/Only?"),
        ("a/msg/Zzz", "type 'a/msg/Zzz' was not found in package 'a' of {}"),
        ("a/", "type 'a/msg/' was not found in package 'a' of {}"),
        ("b/Only", "package 'b' was not found" + PLACE),
        ("aa/Only", "package 'aa' was not found; did you mean a?" + PLACE),
        ("b", "package 'b' was not found" + PLACE),
        ("a/b/c/d", "'a/b/c/d' is not of the form package/namespace/Name"),
        ("a//Only", "'a//Only' is not of the form package/namespace/Name"),
        # What looks like a part of an interface but is none
        (
            "a/msg/Only_Request",
            "type 'a/msg/Only_Request' was not found in package 'a' of {}",
        ),
        ("a/srv/Do_Goal", "type 'a/srv/Do_Goal' was not found in package 'a' of {}"),
        ("a/action/Go_Request", "type 'a/action/Go_Request' was not found in package 'a' of {}"),
    ],
)
def test_errors_of_names(text: str, error: str, tmp_path: Path) -> None:
    catalog = read(tmp_path, PKG)
    assert (
        error_of(catalog.interface_name, text)
        == error_of(catalog.type_name, text)
        == error.replace("{}", str(tmp_path))
    )


# What belongs together

CHAIN = {
    "a/msg/A.msg": "b/B b",
    "a/msg/Z.msg": "",
    "b/msg/B.msg": "c/C[] c",
    "b/msg/Other.msg": "d/D d",
    "c/msg/C.msg": "",
    "d/msg/D.msg": "",
    "e/msg/E.msg": "",
}


@pytest.mark.parametrize(
    ("packages", "types", "expected"),
    [
        # A package comes whole, and so do those it needs, what is needed first
        (["e"], [], "e/msg/E"),
        (["a"], [], "c/msg/C b/msg/B a/msg/A a/msg/Z d/msg/D b/msg/Other"),
        (["a", "e", "a"], [], "c/msg/C b/msg/B a/msg/A a/msg/Z e/msg/E d/msg/D b/msg/Other"),
        # A single type does not bring its own package along, but the whole of those it needs
        ([], ["c/msg/C"], "c/msg/C"),
        ([], ["a/msg/Z"], "a/msg/Z"),
        ([], ["a/msg/A"], "c/msg/C b/msg/B a/msg/A d/msg/D b/msg/Other"),
        ([], ["a/msg/A", "b/msg/B"], "c/msg/C b/msg/B a/msg/A"),
        (["c"], ["a/msg/Z"], "c/msg/C a/msg/Z"),
        (["a"], ["a/msg/Z"], "c/msg/C b/msg/B a/msg/A a/msg/Z d/msg/D b/msg/Other"),
        ([], [], ""),
    ],
)
def test_closure(packages: list[str], types: list[str], expected: str, tmp_path: Path) -> None:
    catalog = read(tmp_path, CHAIN)
    assert " ".join(map(str, closure(catalog, packages, map(name, types)))) == expected


@pytest.mark.parametrize(
    ("type_name", "expected"),
    [
        ("a/msg/A", "c/msg/C b/msg/B a/msg/A"),
        ("c/msg/C", "c/msg/C"),
        ("b/msg/Other", "d/msg/D b/msg/Other"),
        ("s/srv/Do_Response", "c/msg/C b/msg/B s/srv/Do"),
    ],
)
def test_closure_of_a_type(type_name: str, expected: str, tmp_path: Path) -> None:
    """Nothing is read but what the type refers to: other definitions may be wrong."""
    files = {**CHAIN, "s/srv/Do.srv": "---\nb/B b", "a/msg/Wrong.msg": "!", "b/msg/Lost.msg": "lost/A a"}
    catalog = read(tmp_path, files)
    assert " ".join(map(str, type_closure(catalog, name(type_name)))) == expected


def test_a_type_that_needs_what_there_is_not(tmp_path: Path) -> None:
    catalog = read(tmp_path, {"a/msg/A.msg": "b/B b\nc/C c"})
    with pytest.raises(DefinitionError) as caught:
        type_closure(catalog, name("a/msg/A"))
    assert str(caught.value).splitlines()[:-1] == [
        f"b/msg/B was not found, but a/msg/A.b ({tmp_path}/a/msg/A.msg:1:5) needs it",
        f"c/msg/C was not found, but a/msg/A.c ({tmp_path}/a/msg/A.msg:2:5) needs it",
    ]


def test_closure_of_services_and_actions(tmp_path: Path) -> None:
    files = {"a/srv/Do.srv": "c/C c\n---", "a/action/Go.action": "---\nc/C c\n---", "c/msg/C.msg": ""}
    catalog = Catalog((folder_source(write(tmp_path, files)), store_source("kilted")))

    def packages(type_name: str, events: bool) -> set[str]:
        return {each.package for each in closure(catalog, [], [name(type_name)], events=events)}

    assert packages("a/srv/Do", False) == {"a", "c"}
    assert packages("a/srv/Do", True) == {"a", "c", "service_msgs", "builtin_interfaces"}
    assert packages("a/action/Go", False) == {"a", "c", "builtin_interfaces", "unique_identifier_msgs"}
    assert packages("a/srv/Do_Request", False) == {"a", "c"}


def test_dependencies_come_first(ros_prefix: Path) -> None:
    catalog = Catalog(tuple(prefix_sources()))
    order = closure(catalog, catalog.packages, events=True)
    position = {each: index for index, each in enumerate(order)}
    assert set(order) == {each for package in catalog.packages.values() for each in package}
    for each in order:
        # A type description refers to everything, directly or not.
        for needed in catalog.describe(each)["referenced_type_descriptions"]:
            assert position[catalog.definition_name(name(needed["type_name"]))] <= position[each]


@pytest.mark.parametrize(
    ("files", "error"),
    [
        (
            {"a/msg/A.msg": "int8 x\nb/B  b"},
            "b/msg/B was not found, but a/msg/A.b ({}/a/msg/A.msg:2:6) needs it\nlooked in {}",
        ),
        # All of them at once
        (
            {
                "a/msg/A.msg": "b/B b\ngeometry/Pose pose",
                "a/srv/S.srv": "b/B[] b\n---\nb/B[3] c",
                "geometry_msgs/msg/Pose.msg": "Pont x",
                "geometry_msgs/msg/Point.msg": "",
                "geometry_msgs/msg/Unrelated.msg": "",
            },
            "b/msg/B was not found, but a/msg/A.b ({}/a/msg/A.msg:1:5) and 2 more need it\n"
            "geometry/msg/Pose was not found, but a/msg/A.pose ({}/a/msg/A.msg:2:15) needs it; "
            "did you mean geometry_msgs?\n"
            "geometry_msgs/msg/Pont was not found, but geometry_msgs/msg/Pose.x "
            "({}/geometry_msgs/msg/Pose.msg:1:6) needs it; did you mean geometry_msgs/msg/Point?\n"
            "looked in {}",
        ),
        (
            {"a/msg/A.msg": "Do_Request x", "a/srv/Do.srv": "---", "a/msg/Do.msg": ""},
            "a/msg/Do_Request was not found, but a/msg/A.x ({}/a/msg/A.msg:1:12) needs it\n" "looked in {}",
        ),
        # Messages that contain each other
        (
            {"a/msg/A.msg": "int8 x\nA a"},
            "a message cannot contain itself: a/msg/A.a ({}/a/msg/A.msg:2:3)",
        ),
        (
            {"a/msg/A.msg": "A[] a"},
            "a message cannot contain itself: a/msg/A.a ({}/a/msg/A.msg:1:5)",
        ),
        (
            {"a/msg/A.msg": "B b", "a/msg/B.msg": "c/C c", "c/msg/C.msg": "a/B b"},
            "messages cannot contain each other:\n"
            "  a/msg/B.c ({}/a/msg/B.msg:1:5) is a c/msg/C\n"
            "  c/msg/C.b ({}/c/msg/C.msg:1:5) is a a/msg/B",
        ),
        (
            {
                "a/srv/S.idl": "module a { module srv { struct S_Request { S_Response x; };\n"
                "struct S_Response { S_Request y; }; }; };"
            },
            "messages cannot contain each other:\n"
            "  a/srv/S_Request.x ({}/a/srv/S.idl:1:55) is a a/srv/S_Response\n"
            "  a/srv/S_Response.y ({}/a/srv/S.idl:2:31) is a a/srv/S_Request",
        ),
        (
            {f"a/msg/A{i}.msg": f"A{(i + 1) % 30} a" for i in range(30)},
            "messages cannot contain each other:\n"
            + "".join(
                f"  a/msg/A{i}.a ({{}}/a/msg/A{i}.msg:1:{4 + (i > 8)}) is a a/msg/A{i + 1}\n"
                for i in range(9)
            )
            + "  ... 20 more\n"
            "  a/msg/A29.a ({}/a/msg/A29.msg:1:4) is a a/msg/A0",
        ),
    ],
)
def test_errors_of_closure(files: dict[str, str], error: str, tmp_path: Path) -> None:
    catalog = read(tmp_path, files)
    assert error_of(closure, catalog, catalog.packages) == error.replace("{}", str(tmp_path))


def test_a_service_whose_response_holds_its_request(tmp_path: Path) -> None:
    text = "module a { module srv { struct S_Request { long x; }; struct S_Response { S_Request y; }; }; };"
    assert closure(read(tmp_path, {"a/srv/S.idl": text}), ["a"]) == [name("a/srv/S")]


def test_missing_packages_that_were_asked_for(tmp_path: Path) -> None:
    catalog = read(tmp_path, {"sensor_msgs/msg/Imu.msg": ""})
    assert error_of(closure, catalog, ["sensors_msgs"]) == (
        f"package 'sensors_msgs' was not found; did you mean sensor_msgs?; looked in {tmp_path}"
    )
    assert error_of(closure, catalog, [], [name("sensor_msgs/msg/IMUU")]) == (
        f"type 'sensor_msgs/msg/IMUU' was not found in package 'sensor_msgs' of {tmp_path}; "
        "did you mean sensor_msgs/msg/Imu?"
    )


def test_definitions_nested_deeper_than_the_stack(tmp_path: Path) -> None:
    depth = 3000
    files = {f"a/msg/A{i}.msg": f"A{i + 1} a" for i in range(depth)} | {f"a/msg/A{depth}.msg": ""}
    catalog = read(tmp_path, files)
    order = closure(catalog, ["a"])
    assert order == [name(f"a/msg/A{i}") for i in range(depth, -1, -1)]
    assert len(catalog.describe(order[-1])["referenced_type_descriptions"]) == depth


# The embedded store as a source


@pytest.mark.parametrize(
    ("ros_distro", "given", "expected"),
    [
        (None, None, store.newest_distribution()),
        ("humble", None, "humble"),
        ("humble", "jazzy", "jazzy"),
        ("rolling", None, store.newest_distribution()),
        ("", None, store.newest_distribution()),
    ],
)
def test_which_distribution(
    ros_distro: str | None, given: str | None, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ROS_DISTRO", raising=False)
    if ros_distro is not None:
        monkeypatch.setenv("ROS_DISTRO", ros_distro)
    source = store_source(given)
    assert source.origin == f"embedded store {expected}"
    definition = source.packages["std_msgs"][name("std_msgs/msg/String")]
    assert definition.file == f"embedded store {expected}: std_msgs/msg/String"
    assert (definition.text, definition.origin) == ("string data\n", source.origin)


def test_the_store_is_read_when_it_is_needed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[str] = []

    def definitions(distribution: str) -> dict[TypeName, str]:
        read.append(distribution)
        return {name("std_msgs/msg/Empty"): ""}

    monkeypatch.setattr(store, "definitions", definitions)
    mine = folder_source(write(tmp_path, {"a/msg/A.msg": "", "a/msg/B.msg": "A a"}))
    catalog = Catalog((mine, store_source("humble")))

    order = closure(catalog, ["a"])
    assert list(catalog.shadowed(order)) == []
    assert ("a" in catalog.packages, read) == (True, [])

    assert "std_msgs" in catalog.packages
    assert read == ["humble", store.newest_distribution()]


def test_packages_before_the_store(tmp_path: Path) -> None:
    mine = folder_source(write(tmp_path, {"std_msgs/msg/String.msg": "string text"}))
    catalog = Catalog((mine, store_source("kilted")))
    assert list(catalog.package("std_msgs")) == [name("std_msgs/msg/String")]
    assert catalog.definition(name("sensor_msgs/msg/Imu")).origin == "embedded store kilted"
    assert error_of(catalog.definition, name("std_msgs/msg/Bool")) == (
        f"type 'std_msgs/msg/Bool' was not found in package 'std_msgs' of {tmp_path}; "
        "embedded store kilted has it, but comes later"
    )
    assert error_of(catalog.package, "std_msg") == (
        f"package 'std_msg' was not found; did you mean std_msgs or tf2_msgs or stereo_msgs?; "
        f"looked in {tmp_path}, embedded store kilted (messages only)"
    )
