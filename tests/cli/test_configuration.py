"""Settings from `[tool.rosidl-proto]` of a pyproject.toml."""

from __future__ import annotations

from pathlib import Path

import click
import pytest

from rosidl_adapter_proto.cli.commands import generate
from rosidl_adapter_proto.generate.settings import SETTINGS
from tests.cli.conftest import Run
from tests.folders import content, write_package

ALL_SETTINGS = """
[project]
name = "mine"

[tool.rosidl-proto]
packages = ["./src/my_msgs", "builtin_interfaces/msg/Time", "src/two_msgs/msg/T.msg", "more_msgs"]
include = ["src/more"]
output = "out"
deps = false
numbering = "sequential"
lock-file = "numbers.lock"
events = true
python-root = "my_protos"
distro = "humble"
"""
NAMES = ", ".join(sorted(SETTINGS))


def configure(folder: Path, text: str) -> Path:
    (folder / "pyproject.toml").write_text(text, encoding="utf-8")
    return folder / "pyproject.toml"


@pytest.fixture(autouse=True)
def some_packages(my_msgs: Path) -> None:
    """Packages that the configurations refer to."""
    write_package(my_msgs.parent / "two_msgs", {"msg/T.msg": "bool t\n"})
    write_package(my_msgs.parent / "more" / "more_msgs", {"srv/S.srv": "---\nmy_msgs/A a\n"})


@pytest.mark.parametrize("below", ["", "a/b"])
def test_every_setting(below: str, folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """Paths are relative to the file, wherever the program runs."""
    configure(folder, ALL_SETTINGS)
    (folder / below).mkdir(parents=True, exist_ok=True)
    monkeypatch.chdir(folder / below)

    ended = run("generate", "-v")

    lock_file = "numbers.lock" if not below else str(folder / "numbers.lock")
    assert (ended.code, ended.err) == (
        0,
        f"Warning: {lock_file} is new: it keeps the numbers of fields, so commit it\n",
    )
    protos = {path: data for path, data in content(folder / "out" / "proto").items() if data}
    assert set(protos) == {
        "my_msgs/msg/A.proto",
        "builtin_interfaces/msg/Time.proto",
        "two_msgs/msg/T.proto",
        "more_msgs/srv/S.proto",
    }
    assert b"message S_Event {" in protos["more_msgs/srv/S.proto"]
    assert b"Field numbers: sequential." in protos["my_msgs/msg/A.proto"]
    assert "builtin_interfaces/msg/Time from embedded store humble" in ended.out
    assert [path.name for path in (folder / "out" / "python").iterdir()] == ["my_protos"]
    assert (folder / "numbers.lock").is_file()
    assert sorted(path.name for path in folder.iterdir() if path.name != "a") == [
        "numbers.lock",
        "out",
        "pyproject.toml",
        "src",
    ]


def test_paths_that_are_not_set_are_beside_the_configuration(
    folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A lock file for each folder that the program is started in would give a field several numbers."""
    configure(folder, '[tool.rosidl-proto]\npackages = ["./src/my_msgs"]\nnumbering = "sequential"\n')
    (folder / "below").mkdir()
    monkeypatch.chdir(folder / "below")

    assert run("generate").code == 0

    assert (folder / "generated" / "proto").is_dir()
    assert (folder / "rosidl-proto.lock").is_file()
    assert not list(Path.cwd().iterdir())


def test_the_command_line_comes_first(folder: Path, run: Run) -> None:
    configure(folder, ALL_SETTINGS)

    ended = run(
        *("generate", "more_msgs", "--output", "other", "--deps", "--numbering", "hash", "--no-events"),
        *("--python-root", "py", "--distro", "foxy", "--include", "src", "-v"),
    )

    assert (ended.code, ended.err) == (0, "")
    assert ended.out.startswith("my_msgs/msg/A from src/my_msgs/msg/A.msg\nmore_msgs/srv/S from src/more/")
    protos = {path: data for path, data in content(folder / "other" / "proto").items() if data}
    assert set(protos) == {"my_msgs/msg/A.proto", "more_msgs/srv/S.proto"}
    assert b"S_Event" not in protos["more_msgs/srv/S.proto"]
    assert b"Field numbers: hash." in protos["my_msgs/msg/A.proto"]
    assert [path.name for path in (folder / "other" / "python").iterdir()] == ["py"]
    assert not (folder / "numbers.lock").exists()
    assert not (folder / "out").exists()


def test_list_and_show(folder: Path, run: Run) -> None:
    configure(folder, ALL_SETTINGS)

    assert run("list", "more_msgs").out == "more_msgs/srv/S  .srv  src/more/more_msgs/srv/S.srv\n"
    assert "embedded store humble" in run("list").out
    shown = run("show", "more_msgs/S", "-I", "src").out
    assert ".my_msgs.msg.pb.A a = 1;" in shown
    assert "message S_Event {" in shown
    run("generate", "src", "--numbering", "sequential", "--lock-file", "numbers.lock")
    (folder / "numbers.lock").write_text((folder / "numbers.lock").read_text().replace('"1 bool', '"5 bool'))
    assert "bool a = 5;" in run("show", "my_msgs/A", "-I", "src").out


def test_the_nearest_one_counts(folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    configure(folder, '[tool.rosidl-proto]\npackages = ["no_such_package"]\n')
    (folder / "a" / "b").mkdir(parents=True)
    configure(folder / "a", '[tool.rosidl-proto]\npackages = ["../src/my_msgs"]\n')
    configure(folder / "a" / "b", "[tool.other]\nx = 1\n")
    monkeypatch.chdir(folder / "a" / "b")

    assert run("generate").code == 0
    assert (folder / "a" / "generated" / "proto" / "my_msgs").is_dir()


def test_help_shows_what_is_set(folder: Path, run: Run) -> None:
    configure(folder, ALL_SETTINGS)

    assert "[default: my_protos]" in " ".join(run("generate", "--help").out.split())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "[tool.rosidl-proto]\noutptu = 'x'",
            "[tool.rosidl-proto] has no setting 'outptu'; it has " + NAMES,
        ),
        (
            "[tool.rosidl-proto]\nlock_file = 'x'",
            "[tool.rosidl-proto] has no setting 'lock_file'; it has " + NAMES,
        ),
        (
            "[tool.rosidl-proto]\ncheck = true",
            "[tool.rosidl-proto] has no setting 'check'; it has " + NAMES,
        ),
        (
            "[tool.rosidl-proto]\npackages = 'std_msgs'",
            "[tool.rosidl-proto] packages must be a list of strings",
        ),
        ("[tool.rosidl-proto]\npackages = [1]", "[tool.rosidl-proto] packages must be a list of strings"),
        ("[tool.rosidl-proto]\ninclude = 'src'", "[tool.rosidl-proto] include must be a list of strings"),
        ("[tool.rosidl-proto]\noutput = ['x']", "[tool.rosidl-proto] output must be a string"),
        ("[tool.rosidl-proto]\noutput = 1", "[tool.rosidl-proto] output must be a string"),
        ("[tool.rosidl-proto]\nlock-file = 1", "[tool.rosidl-proto] lock-file must be a string"),
        ("[tool.rosidl-proto]\npython-root = true", "[tool.rosidl-proto] python-root must be a string"),
        ("[tool.rosidl-proto]\ndistro = 1.0", "[tool.rosidl-proto] distro must be a string"),
        ("[tool.rosidl-proto]\ndeps = 'no'", "[tool.rosidl-proto] deps must be true or false"),
        ("[tool.rosidl-proto]\nevents = 1", "[tool.rosidl-proto] events must be true or false"),
        (
            "[tool.rosidl-proto]\nnumbering = 'wild'",
            "[tool.rosidl-proto] numbering must be 'hash' or 'sequential', not 'wild'",
        ),
        ("[tool]\nrosidl-proto = 1", "[tool.rosidl-proto] must be a table"),
    ],
)
def test_a_wrong_setting(text: str, message: str, folder: Path, run: Run) -> None:
    file = configure(folder, text)

    for arguments in (("generate", "std_msgs"), ("list",), ("show", "std_msgs/String")):
        ended = run(*arguments)

        assert (ended.code, ended.out) == (2, "")
        assert ended.err == f"Error: {file}: {message}\n"


def test_a_file_that_cannot_be_read(folder: Path, run: Run) -> None:
    file = configure(folder, "[tool.rosidl-proto]\nx =\n")

    ended = run("list")

    assert ended.code == 2
    assert ended.err.startswith(f"Error: cannot read {file}: Invalid value (at line 2, column 4)")
    assert run("--help").code == 0
    assert run("completion", "bash").code == 2


def test_setup_cfg(folder: Path, run: Run) -> None:
    """It says the same in its own way: lists have an entry a line, or commas; a pyproject.toml with settings wins."""
    (folder / "setup.cfg").write_text(
        "[metadata]\nname = mine\n\n[tool.rosidl-proto]\n"
        "packages =\n  ./src/my_msgs\n  builtin_interfaces/msg/Time, src/two_msgs/msg/T.msg\n"
        "output = out\ndeps = no\nevents = true\npython-root = my_protos\n"
    )
    configure(folder, "[project]\nname = 'mine'\n")

    assert run("generate").code == 0

    protos = {path: data for path, data in content(folder / "out" / "proto").items() if data}
    assert set(protos) == {
        "my_msgs/msg/A.proto",
        "builtin_interfaces/msg/Time.proto",
        "two_msgs/msg/T.proto",
    }
    assert [path.name for path in (folder / "out" / "python").iterdir()] == ["my_protos"]
    configure(folder, '[tool.rosidl-proto]\npackages = ["more_msgs"]\ninclude = ["src/more", "src"]\n')
    assert run("generate").code == 0
    assert (folder / "generated" / "proto" / "more_msgs").is_dir()


def test_a_wrong_setup_cfg(folder: Path, run: Run) -> None:
    file = folder / "setup.cfg"
    file.write_text("[tool.rosidl-proto]\ndeps = maybe\n")
    assert run("list").err == f"Error: {file}: [tool.rosidl-proto] deps must be true or false\n"
    file.write_text("[tool.rosidl-proto\n")
    ended = run("list")
    assert (ended.code, ended.out) == (2, "")
    assert ended.err.startswith(f"Error: cannot read {file}: File contains no section headers.")


def test_the_settings_are_the_options_of_the_commands() -> None:
    names = {
        "packages" if isinstance(parameter, click.Argument) else parameter.opts[0].removeprefix("--")
        for parameter in generate.command.params
    }

    assert names - {"check", "from-bag", "renumber", "verbose"} == set(SETTINGS)


@pytest.mark.parametrize("text", ["", "tool = 1", "[tool]\nother = 1", "[tool.rosidl-proto]"])
def test_a_file_without_settings(text: str, folder: Path, run: Run) -> None:
    configure(folder, text)

    assert run("generate").code == 2
    assert run("generate", "./src/my_msgs").code == 0


def test_a_wrong_package(folder: Path, run: Run) -> None:
    configure(folder, '[tool.rosidl-proto]\npackages = ["./nowhere"]\n')

    ended = run("generate")

    assert ended.code == 2
    assert ended.err == "Error: there is no file or folder nowhere\n"
