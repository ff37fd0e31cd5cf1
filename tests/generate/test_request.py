"""How arguments become a request."""

from __future__ import annotations

from pathlib import Path

import pytest

from rosidl_adapter_proto.errors import DefinitionError, RequestError
from rosidl_adapter_proto.generate.request import find_request, is_path
from rosidl_adapter_proto.interfaces.closure import closure
from rosidl_adapter_proto.interfaces.model import TypeName
from tests.folders import write_package


@pytest.fixture(autouse=True)
def some_packages(folder: Path) -> None:
    """Some packages in the current folder."""
    write_package(folder / "src" / "one_msgs", {"msg/A.msg": "bool a\n", "msg/B.msg": "bool b\n"})
    write_package(folder / "src" / "deep" / "two_msgs", {"msg/C.msg": "one_msgs/A c\n"})
    write_package(folder / "src" / "renamed", {"msg/D.msg": "bool d\n"}, name="three_msgs")
    write_package(folder / "bare_msgs", {"msg/E.msg": "bool e\n"})
    write_package(folder / "std_msgs", {"msg/F.msg": "bool f\n"})


@pytest.mark.parametrize(
    ("what", "include", "packages", "types", "generated"),
    [
        ("builtin_interfaces", "", "builtin_interfaces", "", "Duration Time"),
        ("builtin_interfaces/msg/Time", "", "", "builtin_interfaces/msg/Time", "Time"),
        ("builtin_interfaces/Time", "", "", "builtin_interfaces/msg/Time", "Time"),
        ("./src/one_msgs", "", "one_msgs", "", "A B"),
        ("src/one_msgs", "", "one_msgs", "", "A B"),
        ("src/one_msgs/", "", "one_msgs", "", "A B"),
        ("{cwd}/src/one_msgs", "", "one_msgs", "", "A B"),
        ("src/renamed", "", "three_msgs", "", "D"),
        ("./src", "", "one_msgs three_msgs two_msgs", "", "A B C D"),
        ("src", "", "one_msgs three_msgs two_msgs", "", "A B C D"),
        (".", "", "bare_msgs one_msgs std_msgs three_msgs two_msgs", "", "A B C D E F"),
        ("bare_msgs", "", "bare_msgs", "", "E"),
        ("./std_msgs", "", "std_msgs", "", "F"),
        ("src/one_msgs/msg/A.msg", "", "", "one_msgs/msg/A", "A"),
        ("./src/one_msgs/msg/A.msg src/one_msgs/msg/B.msg", "", "", "one_msgs/msg/A one_msgs/msg/B", "A B"),
        ("src/one_msgs/msg/A.msg bare_msgs/msg/E.msg", "", "", "bare_msgs/msg/E one_msgs/msg/A", "A E"),
        ("src/renamed/msg/D.msg", "", "", "three_msgs/msg/D", "D"),
        ("src/one_msgs bare_msgs", "", "bare_msgs one_msgs", "", "A B E"),
        ("two_msgs", "src", "two_msgs", "", "A B C"),
        ("two_msgs", "src/one_msgs src/deep", "two_msgs", "", "A B C"),
        ("two_msgs/C", "src", "", "two_msgs/msg/C", "A B C"),
        ("src/deep/two_msgs/msg/C.msg", "src", "", "two_msgs/msg/C", "A B C"),
        ("std_msgs/F", "./std_msgs", "", "std_msgs/msg/F", "F"),
    ],
)
def test_what_is_asked_for(
    what: str, include: str, packages: str, types: str, generated: str, folder: Path
) -> None:
    arguments = what.format(cwd=folder).split()

    request, sources = find_request(arguments, map(Path, include.split()), None, True)

    assert sorted(request.packages) == packages.split()
    assert sorted(map(str, request.types)) == types.split()
    assert request.dependencies
    names = closure(sources, request.packages, request.types)
    assert sorted(each.name for each in names) == generated.split()


def test_a_package_comes_before_a_folder_of_its_name() -> None:
    _, sources = find_request(["std_msgs"], (), None, True)

    assert sources.definition(TypeName("std_msgs", "msg", "String")).origin.startswith("embedded store")


def test_what_is_given_comes_before_what_is_included(folder: Path) -> None:
    write_package(folder / "other" / "one_msgs", {"msg/A.msg": "int8 a\n"})

    _, sources = find_request(["./other/one_msgs"], [Path("src")], None, True)

    assert sources.definition(TypeName("one_msgs", "msg", "A")).text == "int8 a\n"


def test_files_that_are_named_win_over_other_formats(folder: Path) -> None:
    for name in "AB":
        text = f"module one_msgs {{ module msg {{ struct {name} {{ double from_idl; }}; }}; }};"
        write_package(folder / "src" / "one_msgs", {f"msg/{name}.idl": text})

    request, sources = find_request(["src/one_msgs/msg/A.idl", "src/one_msgs/msg/B.idl"], (), None, True)

    assert [sources.definition(name).format for name in request.types] == [".idl", ".idl"]


def test_the_distribution_of_the_store(monkeypatch: pytest.MonkeyPatch) -> None:
    name = TypeName("std_msgs", "msg", "Header")
    for distro, sourced, expected in (
        ("noetic", "humble", "noetic"),
        ("foxy", "", "foxy"),
        (None, "humble", "humble"),
        (None, "no_such", "lyrical"),
    ):
        monkeypatch.setenv("ROS_DISTRO", sourced)
        _, sources = find_request(["std_msgs"], (), distro, True)
        assert sources.definition(name).origin == f"embedded store {expected}"


@pytest.mark.parametrize(
    ("what", "include", "distro", "error", "message"),
    [
        ("./nowhere", "", None, RequestError, "there is no file or folder nowhere"),
        ("nowhere.msg", "", None, RequestError, "there is no file or folder nowhere.msg"),
        ("std_msgs", "nowhere", None, RequestError, "there is no file or folder nowhere"),
        (
            "std_msg",
            "",
            None,
            DefinitionError,
            "package 'std_msg' was not found; did you mean std_msgs",
        ),
        (
            "builtin_interfaces/msg/Tim",
            "",
            None,
            DefinitionError,
            "type 'builtin_interfaces/msg/Tim' was not found in package 'builtin_interfaces' of embedded store "
            "lyrical; did you mean builtin_interfaces/msg/Time?",
        ),
        (
            "std_msgs/msg/too/many",
            "",
            None,
            DefinitionError,
            "'std_msgs/msg/too/many' is not of the form package/namespace/Name",
        ),
        (
            "std_msgs",
            "",
            "kiltd",
            DefinitionError,
            "the embedded store has no distribution 'kiltd'; it has noetic, ",
        ),
        ("./src/one_msgs/msg", "", None, DefinitionError, "no interface definitions in src/one_msgs/msg: "),
    ],
)
def test_what_cannot_be_found(
    what: str, include: str, distro: str | None, error: type[Exception], message: str
) -> None:
    with pytest.raises(error) as caught:
        find_request(what.split(), map(Path, include.split()), distro, True)

    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("std_msgs", False),
        ("std_msgs/msg/String", False),
        ("./std_msgs", True),
        ("../std_msgs", True),
        ("/opt/std_msgs", True),
        ("std_msgs/", True),
        ("msg/A.msg", True),
        ("A.idl", True),
        ("C:\\msgs", True),
    ],
)
def test_is_path(text: str, expected: bool) -> None:
    assert is_path(text) is expected
