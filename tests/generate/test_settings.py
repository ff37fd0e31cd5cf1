"""Every option, through every entrance: a row of the table is tested as soon as it is there."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from rosidl_adapter_proto.cli import main
from rosidl_adapter_proto.cli.commands import generate as generate_command
from rosidl_adapter_proto.cli.commands import show as show_command
from rosidl_adapter_proto.errors import RequestError
from rosidl_adapter_proto.generate import Options, Request, Result, generate
from rosidl_adapter_proto.generate.configuration import read_configuration
from rosidl_adapter_proto.generate.output_tree import Changes
from rosidl_adapter_proto.generate.settings import OPTIONS, SETTINGS, Kind, Setting
from rosidl_adapter_proto.generate.targets.index import GeneratedPackage, generated_packages
from rosidl_adapter_proto.hooks import ament
from rosidl_adapter_proto.hooks.cmake import cmake_folder
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source, store_source
from tests.folders import write_package

each_option = pytest.mark.parametrize("option", OPTIONS, ids=[each.name for each in OPTIONS])


@pytest.fixture(autouse=True)
def some_package(folder: Path) -> None:
    """A package in the current folder."""
    write_package(folder / "my_msgs", {"msg/A.msg": "bool a\n", "srv/S.srv": "---\n"})


def other(option: Setting) -> Any:
    """Return a value that is not the default."""
    if option.choices:
        return next(each for each in option.choices if each != option.default)
    values: dict[Kind, Callable[[Any], Any]] = {
        Kind.FLAG: lambda default: not default,
        Kind.TEXT: lambda default: f"other_{default}",
        Kind.PATH: lambda default: Path("other", default),
    }
    return values[option.kind](option.default)


def in_toml(value: Any) -> str:
    return json.dumps(str(value) if isinstance(value, Path) else value)


def values_for(option: Setting) -> dict[Setting, Any]:
    """Return a value of an option that is not the default, and the options without which it is refused."""
    needed = [each for each in OPTIONS if (option.name, each.name) == ("lock-file", "numbering")]
    return {each: other(each) for each in (*needed, option)}


def set_to(values: dict[Setting, Any]) -> Options:
    return replace(Options(), **{option.attribute: value for option, value in values.items()})


def test_the_table_is_that_of_the_options() -> None:
    assert [each.attribute for each in OPTIONS] == list(vars(Options()))
    for each in OPTIONS:
        assert each.default == getattr(Options(), each.attribute)
        assert other(each) != each.default
        assert each.help.endswith(".")


@each_option
@pytest.mark.parametrize("file", ["pyproject.toml", "setup.cfg"])
def test_configuration(file: str, option: Setting, folder: Path) -> None:
    values = values_for(option)
    in_file = in_toml if file == "pyproject.toml" else str
    text = "\n".join(f"{each.name} = {in_file(value)}" for each, value in values.items())
    packages = '["./my_msgs"]' if file == "pyproject.toml" else "./my_msgs"
    Path(file).write_text(f"[tool.rosidl-proto]\npackages = {packages}\n{text}\n")

    configuration = read_configuration(folder)

    assert configuration is not None
    assert configuration.request()[2] == set_to(values)


def on_command_line(values: dict[Setting, Any]) -> list[str]:
    arguments: list[str] = []
    for option, value in values.items():
        if option.kind is Kind.FLAG:
            arguments.append(f"--{option.name}" if value else f"--no-{option.name}")
        else:
            arguments += [f"--{option.name}", str(value)]
    return arguments


@each_option
def test_generate_command(option: Setting, monkeypatch: pytest.MonkeyPatch) -> None:
    received: list[Options] = []

    def record(request: Request, catalog: Catalog, output: Path, options: Options, **others: Any) -> Result:
        received.append(options)
        return Result((), Changes((), (), 0))

    monkeypatch.setattr(generate_command, "generate", record)
    values = values_for(option)

    with pytest.raises(SystemExit):
        main(["generate", "my_msgs", *on_command_line(values)])

    assert received == [set_to(values)]


@pytest.mark.parametrize("option", [each for each in OPTIONS if each.is_for_schema])
def test_show_command(option: Setting, monkeypatch: pytest.MonkeyPatch) -> None:
    received: list[Options] = []

    def record(*given: Any) -> str:
        received.append(given[-1])
        return ""

    monkeypatch.setattr(show_command, "proto_text", record)
    values = values_for(option)

    with pytest.raises(SystemExit):
        main(["show", "my_msgs/A", "-I", "my_msgs", *on_command_line(values)])

    assert received == [set_to(values)]


SCRIPT = """
cmake_minimum_required(VERSION 3.20)
include("{folder}/rosidl_generator_proto_arguments.cmake")
set(PROJECT_NAME my_msgs)
set(_interface_tuples "{package}:msg/A.msg" "{package}:srv/S.srv")
set(ROSIDL_PROTO_PYTHON python)
{variables}
_rosidl_generator_proto_arguments(build)
list(JOIN _proto_arguments "\\n" text)
file(WRITE arguments "${{text}}\\n")
"""


@each_option
def test_cmake(option: Setting, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A variable of CMake becomes an argument, and that an option; paths are relative to the package."""
    cmake = pytest.importorskip("cmake", reason="needs cmake")
    values = values_for(option)
    variables = "\n".join(
        f'set(ROSIDL_PROTO_{each.attribute.upper()} "{value}")' for each, value in values.items()
    )
    text = SCRIPT.format(folder=cmake_folder(), package=folder / "my_msgs", variables=variables)
    Path("script.cmake").write_text(text)
    received: list[Options] = []
    monkeypatch.setattr(ament, "check_definitions", lambda *given: received.append(given[-1]))

    subprocess.run([Path(cmake.CMAKE_BIN_DIR, "cmake"), "-P", "script.cmake"], check=True)
    code = ament.main(["check", "@arguments"])

    assert code == 0
    options = set_to(values)
    assert received == [replace(options, lock_file=folder / options.lock_file)]


def test_a_wrong_value_from_cmake(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        ament.main(["check", "--package", "p", "--interface", "i", "--output", "o", "--events", "maybe"])

    assert ended.value.code == 2
    assert capsys.readouterr().err.endswith(" error: argument --events: must be true or false\n")


NO_USE = (
    "is for numbering 'sequential', and numbering is 'hash'; "
    "set that numbering as well, or leave the lock file out"
)


@pytest.mark.parametrize("command", ["generate my_msgs", "show my_msgs/A -I my_msgs"])
def test_a_lock_file_without_a_use_on_the_command_line(
    command: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also where the configuration has a use for one, and the command line takes it away."""
    Path("pyproject.toml").write_text("[tool.rosidl-proto]\nnumbering = 'sequential'\nlock-file = 'a'\n")

    with pytest.raises(SystemExit) as ended:
        main([*command.split(), "--lock-file", "a", "--numbering", "hash"])

    assert (ended.value.code, capsys.readouterr().err) == (2, f"Error: --lock-file {NO_USE}\n")
    assert not Path("generated").exists()


def test_a_lock_file_without_a_use_in_a_configuration(folder: Path) -> None:
    file = folder / "pyproject.toml"
    file.write_text("[tool.rosidl-proto]\nlock-file = 'a'\n")

    with pytest.raises(RequestError) as caught:
        read_configuration(folder)

    assert str(caught.value) == f"{file}: [tool.rosidl-proto] lock-file {NO_USE}"


def test_a_lock_file_without_a_use_from_cmake(capsys: pytest.CaptureFixture[str]) -> None:
    code = ament.main(["check", "--package", "p", "--interface", "i", "--output", "o", "--lock-file", "a"])

    assert (code, capsys.readouterr().err) == (1, f"ROSIDL_PROTO_LOCK_FILE {NO_USE}\n")


@each_option
def test_what_changes_the_output_is_noticed(option: Setting, folder: Path) -> None:
    """A run with another value does not take the output for its own, and the index tells the value."""
    catalog = Catalog((folder_source(folder / "my_msgs"), store_source("kilted")))
    request = Request(("my_msgs",))
    generate(request, catalog, folder / "out")
    options = set_to({option: other(option)})

    result = generate(request, catalog, folder / "out", options, check=True, renumber=True)

    assert result.is_stale == option.changes_output
    package = generated_packages(catalog.packages["my_msgs"], catalog, options)["my_msgs"]
    assert json.loads(package.to_json()).get(option.attribute) == (
        other(option) if option.changes_output else None
    )
    assert GeneratedPackage.from_json(package.to_json()) == package


@each_option
def test_the_documents_have_it(option: Setting) -> None:
    docs = Path(__file__).parents[2] / "docs"

    assert f"`--{option.name}`" in (docs / "command-line.md").read_text(encoding="utf-8")
    variable = f"`ROSIDL_PROTO_{option.attribute.upper()}`"
    assert variable in (docs / "build-colcon.md").read_text(encoding="utf-8")


def test_the_documents_have_all_settings() -> None:
    text = (Path(__file__).parents[2] / "docs/command-line.md").read_text(encoding="utf-8")
    configuration = text.partition("## Configuration\n")[2].partition("\n## ")[0]

    assert re.findall(r"^\| `([a-z-]+)` \|", configuration, re.MULTILINE) == list(SETTINGS)


@pytest.mark.parametrize(
    ("file", "section"),
    [
        ("pyproject.toml", "tool.rosidl_proto"),
        ("pyproject.toml", "rosidl-proto"),
        ("setup.cfg", "tool.rosidl_proto"),
        ("setup.cfg", "tool:rosidl-proto"),
        ("setup.cfg", "rosidl-proto"),
    ],
)
@pytest.mark.parametrize("also", ["", "[tool.rosidl-proto]\n"])
def test_a_section_that_is_not_read(file: str, section: str, also: str, folder: Path) -> None:
    Path(file).write_text(f"{also}[{section}]\n")

    with pytest.raises(RequestError) as caught:
        read_configuration(folder)

    assert str(caught.value) == (
        f"{folder / file}: [{section}] is not read; did you mean [tool.rosidl-proto]?"
    )


@pytest.mark.parametrize("section", ["tool.rosidl", "proto", "tool", "tool.rosidl_adapter_proto"])
def test_a_section_of_others(section: str, folder: Path) -> None:
    for file in ("pyproject.toml", "setup.cfg"):
        Path(file).write_text(f"[{section}]\n")

    assert read_configuration(folder) is None
