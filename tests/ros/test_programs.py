"""Whole programs: the examples, what they leave behind, and the page for people who have an rclpy node today."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.ros.support import ROOT, SECONDS, wait_until

PAGE = ROOT / "docs" / "rclpy.md"
STAND_IN = ROOT / "tests" / "ros" / "stand_in"


def environment(generated: Path) -> dict[str, str]:
    stand_in = [] if find_spec("message_filters") else [str(STAND_IN)]
    python_path = os.pathsep.join([str(ROOT), str(generated), *stand_in])
    return {
        **os.environ,
        "PYTHONPATH": python_path,
        "RCUTILS_LOGGING_USE_STDOUT": "1",
        "PYTHONUNBUFFERED": "1",
    }


@contextmanager
def running(example: str, generated: Path) -> Iterator[subprocess.Popen[str]]:
    """Run an example until it is interrupted, as with Ctrl-C."""
    process = subprocess.Popen(
        [sys.executable, "-W", "error", str(ROOT / "examples" / example)],
        env=environment(generated),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout
    try:
        yield process
        process.send_signal(signal.SIGINT)
        rest = process.communicate(timeout=SECONDS)[0]
        assert process.returncode == 0, rest
        assert "Traceback" not in rest
    finally:
        process.kill()
        process.stdout.close()


def shared_memory_of(process: subprocess.Popen[str]) -> set[Path]:
    """Return the files that Fast DDS has in shared memory for a running process."""
    maps = Path(f"/proc/{process.pid}/maps").read_text()
    return {Path(name) for name in re.findall(r"/dev/shm/fast\S+", maps)}


def test_a_talker_and_a_listener(ros: None, generated: Path) -> None:
    of_others = set(Path("/dev/shm").iterdir())
    with running("ros_listener.py", generated) as listener, running("ros_talker.py", generated) as talker:
        assert listener.stdout
        first = re.search(r'I heard: \{"data": "Hello World: (\d+)"\}', listener.stdout.readline())
        assert first
        assert f'"Hello World: {int(first[1]) + 1}"' in listener.stdout.readline()
        files = (shared_memory_of(talker) | shared_memory_of(listener)) - of_others

    assert files
    wait_until(lambda: not [file for file in files if file.exists()], "shared memory to be removed")


@pytest.mark.parametrize(
    "example, expected",
    [
        (
            "ros_service.py",
            ["The light is on; changed: True", "is on; changed: False", "is off; changed: True"],
        ),
        (
            "ros_action.py",
            ["Feedback: [0, 1, 1, 2, 3, 5, 8]", "Result: [0, 1, 1, 2, 3, 5, 8, 13, 21, 34, 55]"],
        ),
        ("ros_lifecycle.py", ["I heard: I am active"]),
        ("port/with_rclpy.py", ["2026-01-01 12:00:00.500000+00:00: 45 degrees, 2000000 ns apart"]),
        ("port/with_protobuf.py", ["2026-01-01 12:00:00.500000+00:00: 45 degrees, 2000000 ns apart"]),
    ],
)
def test_examples(ros: None, generated: Path, example: str, expected: list[str]) -> None:
    result = subprocess.run(
        [sys.executable, "-W", "error", str(ROOT / "examples" / example)],
        env=environment(generated),
        capture_output=True,
        text=True,
        timeout=SECONDS,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    for text in expected:
        assert text in result.stdout


def test_without_rclpy() -> None:
    code = "import sys; sys.modules['rclpy'] = None; import rosidl_adapter_proto.ros"
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert "ImportError: rosidl_adapter_proto.ros needs rclpy (" in result.stderr
    assert "source a ROS 2 installation, or install it with pip" in result.stderr


def test_the_page(ros: None, tmp_path: Path) -> None:
    """Every block of Python of the page, run one after the other in one program, with what the page generates."""
    command = re.search(r"^rosidl-proto (generate .* --output generated)$", PAGE.read_text(), re.MULTILINE)
    assert command
    program = [sys.executable, "-m", "rosidl_adapter_proto", *command[1].split()]
    subprocess.run(program, cwd=tmp_path, check=True, capture_output=True)
    blocks = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(), re.DOTALL | re.MULTILINE)
    assert len(blocks) > 5
    result = subprocess.run(
        [sys.executable, "-W", "error", "-c", "\n".join(blocks)],
        env=environment(tmp_path / "generated" / "python"),
        capture_output=True,
        text=True,
        timeout=SECONDS,
        check=False,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    said = re.search(r"^```text\n(.*?)^```$", PAGE.read_text(), re.DOTALL | re.MULTILINE)
    assert said
    for line in said[1].splitlines():
        assert line in result.stdout
