"""Shows the main job on the real definitions of this Python's ROS installation, or on the embedded ones without.

Run it with `make demo`.
"""

from __future__ import annotations

import importlib.util
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
MESSAGES_TO_HEAR = 3


def announce(title: str, *command: str | Path) -> None:
    """Show a command before it runs."""
    print(f"\n--- {title}\n$ {' '.join(Path(part).name for part in command)}", flush=True)


def run(title: str, *command: str | Path, python_path: Path | None = None) -> None:
    """Run a command."""
    announce(title, *command)
    environment = {**os.environ, "PYTHONPATH": str(python_path)} if python_path else None
    subprocess.run(command, env=environment, check=True)


def talk_and_listen(python_path: Path) -> None:
    """Run a talker and a listener in processes of their own, until the listener has heard a few messages."""
    environment = {**os.environ, "PYTHONPATH": str(python_path), "RCUTILS_LOGGING_USE_STDOUT": "1"}
    talker, listener = (
        subprocess.Popen(
            [sys.executable, "-u", HERE / name], env=environment, stdout=subprocess.PIPE, text=True
        )
        for name in ("ros_talker.py", "ros_listener.py")
    )
    try:
        assert listener.stdout is not None
        for _ in range(MESSAGES_TO_HEAR):
            print(listener.stdout.readline(), end="", flush=True)
    finally:
        for process in (talker, listener):
            process.send_signal(signal.SIGINT)
            process.communicate()


def main() -> None:
    """Generate std_msgs and sensor_msgs, look at a message, and use the protobuf types."""
    tool = (sys.executable, "-m", "rosidl_adapter_proto")
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder, "generated")
        packages = output / "python"
        run("what ROS calls a Header is this in protobuf", *tool, "show", "std_msgs/msg/Header")
        run("generate protobuf types and adapters", *tool, "generate", "sensor_msgs", "--output", output)
        run("use protobuf types without ROS", sys.executable, HERE / "without_ros.py", python_path=packages)
        if importlib.util.find_spec("rclpy") is None:
            print("\nthere is no ROS in this environment, which the rest of the demonstration needs")
            return
        run("convert to ROS messages and back", sys.executable, HERE / "with_ros.py", python_path=packages)
        announce("a talker and a listener, both with protobuf messages", "ros_talker.py & ros_listener.py")
        talk_and_listen(packages)


if __name__ == "__main__":
    main()
