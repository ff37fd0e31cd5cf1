"""`rosidl-proto generate`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from rosidl_adapter_proto.generate import protoc
from rosidl_adapter_proto.interfaces import store
from tests.cli.conftest import Run
from tests.folders import content, write_package

FILES = [
    "proto/my_msgs/msg/A.proto",
    "python/rosidl_proto/my_msgs/msg/A_pb2.py",
    "python/rosidl_proto/my_msgs/msg/A_pb2.pyi",
    "python/rosidl_proto/my_msgs/msg/A_adapter.py",
    "python/rosidl_proto/my_msgs/msg/__init__.py",
    "python/rosidl_proto/my_msgs/msg/py.typed",
    "index/rosidl_proto/my_msgs",
    "pyproject.toml",
]


def lines(verb: str, folder: str = "generated") -> str:
    return "".join(f"{verb} {folder}/{path}\n" for path in FILES)


def test_first_and_second_run(my_msgs: Path, folder: Path, run: Run) -> None:
    first = run("generate", "./src")
    assert (first.code, first.err) == (0, "")
    assert first.out == "generated: 1 interface, files: 8 written, 0 removed, 0 unchanged\n"
    assert all((folder / "generated" / path).is_file() for path in FILES)

    again = run("generate", "./src")
    assert again.out == "generated: 1 interface, files: 0 written, 0 removed, 8 unchanged\n"


@pytest.mark.parametrize(
    "what", ["./src", "src/my_msgs/", "src/my_msgs/msg/shapes/A.msg", "my_msgs/msg/A", "my_msgs"]
)
def test_definitions_in_folders(what: str, folder: Path, run: Run) -> None:
    """As Autoware has them: the folders below `msg` are for people."""
    write_package(folder / "src" / "my_msgs", {"msg/shapes/A.msg": "B b\n", "msg/points/B.msg": "bool b\n"})

    ended = run("generate", what, "--include", "src")

    assert (ended.code, ended.err) == (0, "")
    assert (folder / "generated/proto/my_msgs/msg/A.proto").is_file()
    assert (folder / "generated/python/rosidl_proto/my_msgs/msg/B_adapter.py").is_file()


def test_two_definitions_of_one_name(folder: Path, run: Run) -> None:
    write_package(folder / "src" / "my_msgs", {"msg/a/A.msg": "", "msg/b/A.msg": ""})

    ended = run("generate", "./src")

    assert (ended.code, ended.out) == (3, "")
    assert ended.err == (
        "Error: my_msgs/msg/A is defined by both src/my_msgs/msg/a/A.msg and src/my_msgs/msg/b/A.msg: the name of a "
        "file makes the name of its type, whatever folder it is in; rename or remove one\n"
    )
    assert not (folder / "generated").exists()


def test_verbose(my_msgs: Path, run: Run) -> None:
    ended = run("generate", "./src", "-v", "--output", "out", "--numbering", "sequential")

    assert (ended.code, ended.err) == (0, "")
    assert ended.out == (
        "my_msgs/msg/A from src/my_msgs/msg/A.msg\n"
        + lines("wrote", "out")
        + "wrote rosidl-proto.lock\n"
        + "out: 1 interface, files: 8 written, 0 removed, 0 unchanged\n"
    )


def test_check(my_msgs: Path, folder: Path, run: Run) -> None:
    command = ("generate", "src", "--numbering", "sequential")

    stale = run(*command, "--check")
    assert (stale.code, stale.err) == (1, "")
    assert stale.out == lines("would write") + "would write rosidl-proto.lock\n"
    assert sorted(path.name for path in folder.iterdir()) == ["src"]

    run(*command)
    fresh = run(*command, "--check")
    assert (fresh.code, fresh.out, fresh.err) == (0, "generated is up to date\n", "")

    (folder / "rosidl-proto.lock").unlink()
    stale = run(*command, "--check")
    assert (stale.code, stale.out) == (1, "would write rosidl-proto.lock\n")

    run(*command)
    (my_msgs / "msg" / "A.msg").rename(my_msgs / "msg" / "B.msg")
    stale = run(*command, "--check")
    assert stale.code == 1
    assert "would write generated/proto/my_msgs/msg/B.proto\n" in stale.out
    assert "would remove generated/proto/my_msgs/msg/A.proto\n" in stale.out


def test_sequential_numbers(my_msgs: Path, folder: Path, run: Run) -> None:
    command = ("generate", "src", "--numbering", "sequential", "--lock-file", "numbers.lock")
    assert run(*command).code == 0
    assert "bool a = 1;" in (folder / "generated/proto/my_msgs/msg/A.proto").read_text()
    assert json.loads((folder / "numbers.lock").read_text())["messages"]["my_msgs/msg/A"]["fields"] == {
        "a": "1 bool"
    }
    before = content(folder)

    (my_msgs / "msg" / "A.msg").write_text("int32 a\n")
    refused = run(*command)

    assert (refused.code, refused.out) == (3, "")
    assert refused.err == (
        "Error: my_msgs/msg/A.a: numbers.lock has number 1 for it with type bool, but its type is sfixed32 now; "
        "a number cannot be used for another type: give the field a new name\n"
    )
    (my_msgs / "msg" / "A.msg").write_text("bool a\n")
    assert content(folder) == before


def test_options_reach_the_generator(folder: Path, run: Run) -> None:
    write_package(folder / "my_msgs", {"srv/S.srv": "builtin_interfaces/Time t\n---\n"})
    command = ("generate", "my_msgs", "--no-deps", "--events", "--python-root", "my_protos", "-o", "a/b")

    assert run(*command).code == 0

    assert {path.name for path in (folder / "a/b/proto").iterdir()} == {"my_msgs"}
    assert "message S_Event {" in (folder / "a/b/proto/my_msgs/srv/S.proto").read_text()
    assert [path.name for path in (folder / "a/b/python").iterdir()] == ["my_protos"]


def test_the_distribution(folder: Path, run: Run) -> None:
    for distro in ("noetic", "foxy"):
        assert run("generate", "std_msgs/Header", "--no-deps", "--distro", distro, "-o", distro).code == 0

    proto = "proto/std_msgs/msg/Header.proto"
    assert " seq = " in (folder / "noetic" / proto).read_text()
    assert " seq = " not in (folder / "foxy" / proto).read_text()


def test_two_sources_define_one_type_differently(my_msgs: Path, folder: Path, run: Run) -> None:
    write_package(folder / "other" / "my_msgs", {"msg/A.msg": "int8 a\n"})

    ended = run("generate", "my_msgs", "-I", "other", "-I", "src")

    assert ended.code == 0
    assert ended.err == (
        "Warning: my_msgs/msg/A is defined differently by other/my_msgs/msg/A.msg and src/my_msgs/msg/A.msg; "
        "the first is used, since other comes before src\n"
    )
    assert "int32 a = " in (folder / "generated/proto/my_msgs/msg/A.proto").read_text()


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (
            "",
            2,
            "Error: Missing argument 'WHAT...': name a package, or set `packages` in the configuration.\n",
        ),
        ("./nowhere", 2, "Error: there is no file or folder nowhere"),
        ("src --numbering wild", 2, "'wild' is not one of 'hash', 'sequential'."),
        ("src --wild", 2, "Error: No such option"),
        ("src --output src", 3, "Error: src has files that were not made by rosidl-proto; choose an empty"),
        ("src --output src/my_msgs/msg/A.msg", 3, "Error: src/my_msgs/msg/A.msg is not a folder; choose"),
        (
            "src -o src/my_msgs/msg/A.msg/b",
            3,
            "Error: cannot write to src/my_msgs/msg/A.msg/b: Not a directory",
        ),
        ("src --python-root class", 3, "Error: 'class' cannot be the name of a Python package"),
        ("my_mgs -I src", 3, "Error: package 'my_mgs' was not found; did you mean my_msgs"),
        ("std_msgs/msg/Strin", 3, "did you mean std_msgs/msg/String"),
        ("std_msgs --distro nowhere", 3, "Error: the embedded store has no distribution 'nowhere'; it has "),
        ("src --numbering sequential --lock-file no/lock", 3, "Error: cannot write no/lock: No such file"),
        ("src --numbering sequential --lock-file src", 3, "Error: cannot read src: "),
    ],
)
def test_errors(arguments: str, code: int, message: str, my_msgs: Path, folder: Path, run: Run) -> None:
    before = content(folder)

    ended = run("generate", *arguments.split())

    assert (ended.code, ended.out) == (code, "")
    assert message in ended.err
    assert "Traceback" not in ended.err
    assert content(folder) == before


@pytest.mark.parametrize("path", ["", "nested/"])
def test_an_error_in_a_definition(path: str, my_msgs: Path, folder: Path, run: Run) -> None:
    (my_msgs / "msg" / "A.msg").write_text("bool a\nint32  1b\n")

    ended = run("generate", "./src")

    assert (ended.code, ended.out) == (3, "")
    assert ended.err.startswith("Error: src/my_msgs/msg/A.msg:2:8: ")
    assert "\n  int32  1b\n         ^\n" in ended.err


def test_protoc_fails(my_msgs: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    compile_protos = protoc.compile_protos

    def break_and_compile(protos: dict[str, str], wanted: list[str]) -> dict[str, bytes]:
        return compile_protos({path: f"{text}oops" for path, text in protos.items()}, wanted)

    monkeypatch.setattr(protoc, "compile_protos", break_and_compile)

    ended = run("generate", "./src")

    assert ended.code == 3
    assert ended.err.startswith("Error: protoc failed with exit code 1:\nmy_msgs/msg/A.proto:11:1: ")


@pytest.mark.parametrize("place", [0, 2])
def test_debug(place: int, run: Run) -> None:
    arguments = ["generate", "no_such_package"]
    assert run(*arguments).err.startswith("Error: package 'no_such_package' was not found")

    arguments.insert(place, "--debug")
    ended = run(*arguments)

    assert ended.code == 3
    assert ended.err.startswith("Traceback (most recent call last):\n")
    assert "\nError: package 'no_such_package' was not found" in ended.err


def test_a_fault_of_the_program(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is not taken for something stale."""

    def fail(distribution: str) -> dict[Any, str]:
        raise ZeroDivisionError("oops")

    monkeypatch.setattr(store, "definitions", fail)

    ended = run("generate", "std_msgs", "--check")

    assert (ended.code, ended.out) == (3, "")
    assert ended.err == "Internal error: ZeroDivisionError('oops'); --debug shows where it comes from\n"
    assert run("--debug", "generate", "std_msgs").err.startswith("Traceback")


def test_interrupted(my_msgs: Path, folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(protoc, "compile_protos", interrupt)

    ended = run("generate", "./src")

    assert (ended.code, ended.out) == (130, "")
    assert ended.err == "\ninterrupted; no half-written output is left\n"
    assert not (folder / "generated").exists()
