"""Helpers of the tests with rclpy that do not need it themselves."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
SECONDS = 30.0
"""How long anything may take on a busy machine. Nothing waits that long if all is well."""

DOMAINS = range(1, 101)
"""Domains whose ports are below the ephemeral ones of Linux ("The ROS_DOMAIN_ID", docs.ros.org)."""


@contextlib.contextmanager
def reserve_domain() -> Iterator[int]:
    """Reserve a ROS domain among all test processes of this machine."""
    for domain in DOMAINS:
        with Path(tempfile.gettempdir(), f"rosidl_adapter_proto_domain_{domain}.lock").open("a") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                continue
            yield domain
            return
    raise RuntimeError("all ROS domains are in use by other tests")


def wait_until(condition: Callable[[], Any], what: str = "it") -> Any:
    """Wait until a condition is true, and return its value."""
    deadline = time.monotonic() + SECONDS
    pause = threading.Event()
    while not (value := condition()):
        assert time.monotonic() < deadline, f"waited {SECONDS} s for {what}"
        pause.wait(0.005)
    return value


class Spinning:
    """A node and an executor that spins it in a thread."""

    def __init__(self, node: Any, executor: Any = None) -> None:
        from rclpy.executors import MultiThreadedExecutor

        self.node = node
        self.executor = executor or MultiThreadedExecutor(num_threads=2)
        self.executor.add_node(node)
        self.error: BaseException | None = None
        self.is_stopping = False
        self.thread = threading.Thread(target=self._spin)
        self.thread.start()

    def _spin(self) -> None:
        # Shutting down an executor while `spin` runs in another thread is a race in rclpy.
        try:
            while not self.is_stopping:
                self.executor.spin_once(timeout_sec=0.05)
        except BaseException as error:
            self.error = error

    def stop(self) -> None:
        self.is_stopping = True
        self.thread.join(SECONDS)
        assert not self.thread.is_alive(), "the executor did not stop"
        self.executor.shutdown(timeout_sec=SECONDS)
        self.node.destroy_node()
        if self.error is not None:
            raise self.error


class Peer:
    """A process that does what it is told: a line of JSON for each command, and one for each answer."""

    def __init__(self, generated: Path) -> None:
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(generated)])}
        self.process = subprocess.Popen(
            [sys.executable, "-W", "error", "-m", "tests.ros.peer"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
            text=True,
        )

    def ask(self, command: str, **arguments: Any) -> Any:
        """Give a command and return the answer."""
        assert self.process.stdin and self.process.stdout
        self.process.stdin.write(json.dumps({"command": command, "arguments": arguments}) + "\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        assert line, "the peer has ended"
        answer = json.loads(line)
        assert "error" not in answer, answer.get("error")
        return answer["answer"]

    def __enter__(self) -> Peer:
        return self

    def __exit__(self, *error: object) -> None:
        assert self.process.stdin and self.process.stdout
        self.process.stdin.close()
        try:
            assert self.process.wait(SECONDS) == 0
        finally:
            self.process.kill()
            self.process.stdout.close()
