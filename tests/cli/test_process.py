"""The program as a process: exit codes, pipes, terminals, signals, locales, a real shell."""

from __future__ import annotations

import os
import pty
import shutil
import signal
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from tests.folders import content, write_package

CHECKOUT = Path(__file__).parents[2]
PROGRAM = [sys.executable, "-m", "rosidl_adapter_proto"]


@pytest.fixture(autouse=True)
def environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the program be found from any folder."""
    monkeypatch.setenv("PYTHONPATH", str(CHECKOUT))


def call(*arguments: str, environment: Mapping[str, str] | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*PROGRAM, *arguments],
        env={**os.environ, **(environment or {})},
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )


def test_exit_codes_and_streams(my_msgs: Path) -> None:
    """Results go to standard output, errors to standard error; there is no progress in a pipe."""
    table = [
        ("generate src --check", 1, True, False),
        ("generate src", 0, True, False),
        ("generate src --check", 0, True, False),
        ("generate", 2, False, True),
        ("generate no_such_package", 3, False, True),
    ]
    for arguments, code, out, err in table:
        ended = call(*arguments.split())

        assert (ended.returncode, bool(ended.stdout), bool(ended.stderr)) == (code, out, err), arguments
        assert "Traceback" not in ended.stderr


def test_a_closed_pipe() -> None:
    """As with `rosidl-proto list | head -1`."""
    reader, writer = os.pipe()
    os.close(reader)
    try:
        ended = subprocess.run([*PROGRAM, "list"], stdout=writer, stderr=subprocess.PIPE, check=False)
    finally:
        os.close(writer)

    assert (ended.returncode, ended.stderr) == (1, b"")


def test_a_full_disk_behind_the_standard_output() -> None:
    with Path("/dev/full").open("wb") as full:
        ended = subprocess.run([*PROGRAM, "list"], stdout=full, stderr=subprocess.PIPE, check=False)

    assert ended.returncode == 3
    assert ended.stderr == (
        b"Error: cannot write to the standard output: No space left on device; make room there\n"
    )


def run_on_terminal(*arguments: str) -> str:
    """Return what the program writes to a terminal."""
    leader, follower = pty.openpty()
    process = subprocess.Popen([*PROGRAM, *arguments], stdin=follower, stdout=follower, stderr=follower)
    os.close(follower)
    shown = b""
    while True:
        try:
            read = os.read(leader, 4096)
        except OSError:  # how Linux tells that the other end is closed
            break
        if not read:
            break
        shown += read
    os.close(leader)
    assert process.wait() == 0
    return shown.decode()


def test_progress_on_a_terminal(my_msgs: Path) -> None:
    write_package(my_msgs, {"msg/B.msg": "bool b\n"})

    shown = run_on_terminal("generate", "src")
    assert "generating" in shown
    assert "100%" in shown
    assert shown.endswith("generated: 2 interfaces, files: 12 written, 0 removed, 0 unchanged\r\n")

    assert run_on_terminal("generate", "src") == (
        "generated: 2 interfaces, files: 0 written, 0 removed, 12 unchanged\r\n"
    )


INTERRUPTED = """
import sys, time
from rosidl_adapter_proto.cli import main
from rosidl_adapter_proto.generate import protoc

def wait(*arguments):
    print("waiting", flush=True)
    time.sleep(60)

protoc.compile_protos = wait
main(["generate", "src"])
"""


def test_control_c(my_msgs: Path, folder: Path, interruptible: None) -> None:
    assert call("generate", "src").returncode == 0
    before = content(folder)
    (my_msgs / "msg" / "A.msg").write_text("int8 a\n")

    process = subprocess.Popen(
        [sys.executable, "-c", INTERRUPTED], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "waiting\n"
    process.send_signal(signal.SIGINT)
    _, err = process.communicate()

    assert (process.returncode, err) == (130, "\ninterrupted; no half-written output is left\n")
    assert content(folder) == before | {"src/my_msgs/msg/A.msg": b"int8 a\n"}


def test_text_that_the_terminal_cannot_show(my_msgs: Path) -> None:
    (my_msgs / "msg" / "A.msg").write_text("# 5 Ω\nbool a\n", encoding="utf-8")

    ended = call("show", "my_msgs/A", "-I", "src", environment={"PYTHONIOENCODING": "latin-1"})

    assert (ended.returncode, ended.stderr) == (0, "")
    assert "# 5 ?   |" in ended.stdout


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("ge", ["generate"]),
        ("generate std_m", ["std_msgs"]),
        ("show builtin_interfaces/msg/T", ["builtin_interfaces/msg/Time"]),
        ("list no_such_package", []),
    ],
)
def test_completion_in_bash(line: str, expected: list[str], folder: Path) -> None:
    bash = shutil.which("bash")
    if bash is None:
        pytest.skip("needs bash")
    program = folder / "bin" / "rosidl-proto"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec {" ".join(PROGRAM)} "$@"\n')
    program.chmod(0o755)
    script = f"""
        set -eu
        eval "$(rosidl-proto completion bash)"
        complete -p rosidl-proto
        COMP_WORDS=(rosidl-proto {line})
        COMP_CWORD={len(line.split())}
        _rosidl_proto_completion rosidl-proto "${{COMP_WORDS[COMP_CWORD]}}" ""
        printf '%s\\n' "${{COMPREPLY[@]-}}"
    """

    ended = subprocess.run(
        [bash, "-c", script],
        env={**os.environ, "PATH": f"{program.parent}{os.pathsep}{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        check=False,
    )

    assert (ended.returncode, ended.stderr) == (0, "")
    registered, *replies = ended.stdout.splitlines()
    assert registered == "complete -o nosort -F _rosidl_proto_completion rosidl-proto"
    assert [each for each in replies if each] == expected
