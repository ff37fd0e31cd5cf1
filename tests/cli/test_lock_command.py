"""`rosidl-proto lock`, and the numbers of an output folder as the command line shows them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Run

SEQUENTIAL = ("generate", "src", "--numbering", "sequential")
LOCK_FILE = Path("rosidl-proto.lock")
ONCE = "a folder generated before needs --renumber once\n"


def locked() -> dict[str, dict[str, str]]:
    fields: dict[str, dict[str, str]] = json.loads(LOCK_FILE.read_text())["messages"]["my_msgs/msg/A"]
    return fields


def test_a_field_that_was_never_released(my_msgs: Path, run: Run) -> None:
    """What the error says to run helps."""
    (my_msgs / "msg/A.msg").write_text("uint8[] a\nbool b\n")
    run(*SEQUENTIAL)
    (my_msgs / "msg/A.msg").write_text("wstring a\nbool b\n")
    refused = run(*SEQUENTIAL)
    assert (refused.code, refused.out) == (3, "")
    assert refused.err == (
        "Error: my_msgs/msg/A.a: rosidl-proto.lock has number 1 for it with type uint8[], but its type is wstring "
        "now; a number cannot be used for another type: give the field a new name, or, if it was never released, "
        "run: rosidl-proto lock drop my_msgs/msg/A.a --lock-file rosidl-proto.lock\n"
    )

    dropped = run(*refused.err.rstrip().partition("run: rosidl-proto ")[2].split())

    assert (dropped.code, dropped.err) == (0, "")
    assert dropped.out == "dropped my_msgs/msg/A.a, which had number 1\n" + ONCE
    assert locked() == {"fields": {"b": "2 bool (bool)"}, "removed": {}}
    refused = run(*SEQUENTIAL)
    assert (refused.code, refused.out) == (3, "")
    assert refused.err == (
        "Error: my_msgs/msg/A.a has number 1 in generated/.rosidl-proto.json, but rosidl-proto.lock has 3 for it; "
        "restore rosidl-proto.lock from version control; or, if nothing is left that was serialized with the old "
        "numbers, give --renumber, or remove generated and generate it again\n"
    )
    assert run(*SEQUENTIAL, "--renumber").code == 0
    assert locked()["fields"] == {"b": "2 bool (bool)", "a": "3 bytes (wstring)"}
    assert run(*SEQUENTIAL, "--check").out == "generated is up to date\n"


def test_a_whole_message(my_msgs: Path, run: Run) -> None:
    (my_msgs / "msg/A.msg").write_text("bool a\nbool gone\n")
    run(*SEQUENTIAL)
    (my_msgs / "msg/A.msg").write_text("bool a\n")
    run(*SEQUENTIAL)

    dropped = run("lock", "drop", "my_msgs/msg/A")

    assert dropped.out == (
        "dropped my_msgs/msg/A.a, which had number 1\ndropped my_msgs/msg/A.gone, which had number 2\n" + ONCE
    )
    assert json.loads(LOCK_FILE.read_text())["messages"] == {}


def test_the_lock_file_of_the_configuration(
    my_msgs: Path, folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "pyproject.toml").write_text(
        '[tool.rosidl-proto]\nlock-file = "my.lock"\nnumbering = "sequential"\n'
    )
    run("generate", "src")
    (folder / "below").mkdir()
    monkeypatch.chdir(folder / "below")

    assert run("lock", "drop", "my_msgs/msg/A.a").code == 0
    assert "bool" not in (folder / "my.lock").read_text()


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ("", 2, "Error: Missing argument 'NAME...'"),
        ("my_msgs/msg/A.a", 2, "Error: there is no rosidl-proto.lock; name the lock file with --lock-file\n"),
        (
            "my_msgs/msg/A.a --lock-file src",
            3,
            "Error: cannot read src: Is a directory; name the lock file with --lock-file\n",
        ),
        (
            "my_msgs/msg/B.a --lock-file my.lock",
            3,
            "Error: my.lock has no message 'my_msgs/msg/B'; did you mean ",
        ),
        (
            "my_msgs/msg/A.b --lock-file my.lock",
            3,
            "Error: my.lock has no field 'b' of my_msgs/msg/A; it has a\n",
        ),
        (
            "my_msgs/msg/A.a my_msgs/msg/A.a --lock-file my.lock",
            3,
            "has no field 'a' of my_msgs/msg/A; it has none",
        ),
    ],
)
def test_errors(arguments: str, code: int, message: str, my_msgs: Path, run: Run) -> None:
    run(*SEQUENTIAL, "--lock-file", "my.lock")
    before = Path("my.lock").read_bytes()

    ended = run("lock", "drop", *arguments.split())

    assert (ended.code, ended.out) == (code, "")
    assert message in ended.err
    assert Path("my.lock").read_bytes() == before
