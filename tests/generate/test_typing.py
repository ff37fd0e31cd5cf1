"""Type checkers accept generated code, know what it gives, and object to what is wrong with its use."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.generate.conftest import Generated

# Lines that end in a comment must give that error, or that type; all others none.
USES = """\
from rosidl_proto.sensor_msgs.msg import Imu, ImuAdapter
from rosidl_proto.std_srvs.srv import SetBool, SetBool_Request, SetBoolAdapter, Trigger
from rosidl_proto.test_msgs.action import Fibonacci, FibonacciAdapter

message = Imu(linear_acceleration_covariance=[1.0] * 9)
reveal_type(message.header.stamp.sec)  # type: int
reveal_type(message.header.frame_id)  # type: str
reveal_type(ImuAdapter.convert_to_custom(object()))  # type: Imu
reveal_type(ImuAdapter.new())  # type: Imu
reveal_type(SetBoolAdapter.request.new(data=True))  # type: SetBool_Request
reveal_type(SetBoolAdapter.request.custom_type())  # type: SetBool_Request
reveal_type(FibonacciAdapter.goal.convert_to_custom(object()))  # type: Fibonacci_Goal
reveal_type(SetBool.Request())  # type: SetBool_Request
reveal_type(SetBool.response.new())  # type: SetBool_Response
reveal_type(Fibonacci.Goal())  # type: Fibonacci_Goal
request: SetBool.Request = SetBool_Request()
feedback: Fibonacci.Feedback = FibonacciAdapter.feedback.new(sequence=[1])
ImuAdapter.new(linear_acceleration_covariance=[1.0] * 9)
ImuAdapter.new(fram_id="imu")  # error
ImuAdapter.new(orientation_covariance="text")  # error
ImuAdapter.new(message)  # error
SetBool.request.new(dat=True)  # error
SetBool.Request(dat=True)  # error
request = Trigger.Request()  # error
feedback = Fibonacci.Result()  # error
message.header.frame_id = 3  # error
message.header = message.header  # error
Imu(nonsense=1)  # error
SetBool_Request(data="yes")  # error
message.HasField("angular_velocity_covariance")  # error
message.ClearField("nonsense")  # error
"""


@pytest.fixture
def uses(tmp_path: Path) -> Path:
    file = tmp_path / "uses.py"
    file.write_text(USES)
    return file


def expected_lines(kind: str) -> dict[int, str]:
    pattern = re.compile(rf"# {kind}:? ?(.*)$")
    matches = {number: pattern.search(line) for number, line in enumerate(USES.splitlines(), 1)}
    return {number: match[1] for number, match in matches.items() if match}


def check_report(report: str, error: str, revealed: str) -> None:
    errors = {int(number) for number in re.findall(error, report)}
    assert errors == set(expected_lines("error")), report
    types = {int(number): text for number, text in re.findall(revealed, report)}
    assert types == expected_lines("type"), report


def test_mypy_strict(ros_install: Generated, uses: Path) -> None:
    checkout = Path(__file__).parents[2]
    config = uses.with_name("mypy.ini")
    config.write_text(
        "[mypy]\nstrict = true\nnamespace_packages = true\nexplicit_package_bases = true\n"
        f"mypy_path = {ros_install.folder / 'python'}:{checkout}\ncache_dir = {uses.with_name('cache')}\n"
    )
    command = [sys.executable, "-m", "mypy", "--config-file", str(config), str(uses)]
    command += [str(ros_install.folder / "python/rosidl_proto")]
    report = subprocess.run(command, capture_output=True, check=False, text=True).stdout
    assert not re.search(r"rosidl_proto/.*error", report), report
    check_report(
        report, r"uses\.py:(\d+): error", r'uses\.py:(\d+): note: Revealed type is "(?:[\w.]*\.)?(\w+)"'
    )


def test_pyright(ros_install: Generated, uses: Path) -> None:
    checkout = Path(__file__).parents[2]
    paths = [str(ros_install.folder / "python"), str(checkout)]
    uses.with_name("pyrightconfig.json").write_text(
        f'{{"include": ["uses.py", "{paths[0]}"], "extraPaths": {paths!r}}}'.replace("'", '"')
    )
    command = [sys.executable, "-m", "pyright", "--pythonpath", sys.executable, "-p", str(uses.parent)]
    report = subprocess.run(command, capture_output=True, check=False, text=True).stdout
    assert not re.search(r"rosidl_proto/.*error", report), report
    check_report(
        report, r"uses\.py:(\d+):\d+ - error", r'uses\.py:(\d+):\d+ - information: Type of ".*" is "(\w+)"'
    )
