"""Shows the main job on the real definitions of this Python's ROS installation, or on the embedded ones without.

Run it with `make demo`.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent


def run(title: str, *command: str | Path) -> None:
    """Run a command after showing it."""
    print(
        f"\n--- {title}\n$ {' '.join(Path(part).name if Path(part).is_absolute() else str(part) for part in command)}"
    )
    sys.stdout.flush()
    subprocess.run(command, check=True)


def main() -> None:
    """Generate std_msgs and sensor_msgs, look at a message, and use the protobuf types."""
    tool = (sys.executable, "-m", "rosidl_adapter_proto")
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder, "generated")
        run("what ROS calls a Header is this in protobuf", *tool, "show", "std_msgs/msg/Header")
        run("generate protobuf types and adapters", *tool, "generate", "sensor_msgs", "--output", output)
        python_path = ["env", f"PYTHONPATH={output / 'python'}", sys.executable]
        run("use protobuf types without ROS", *python_path, HERE / "without_ros.py")
        run("convert to ROS messages and back", *python_path, HERE / "with_ros.py")


if __name__ == "__main__":
    main()
