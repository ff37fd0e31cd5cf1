"""Conversions that are killed, interrupted, or have no room; and how much memory they take."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from mcap.writer import CompressionType

from rosidl_adapter_proto.bags.convert import convert_bag
from tests.bags.recordings import START, Recorded, contents, mcap_bytes, string_cdr, strings

pytestmark = pytest.mark.usefixtures("folder")

ROOT = Path(__file__).parent.parent.parent
WAITING = """
import os, select, signal, sys
from rosidl_adapter_proto.bags import mcap_writer, output, sqlite3_writer
from rosidl_adapter_proto.cli import main
place, *arguments = sys.argv[1:]
# A signal that comes before the program waits also ends its waiting.
signalled, wakeup = os.pipe()
os.set_blocking(wakeup, False)
signal.set_wakeup_fd(wakeup)
def waiting(function):
    def wait(*arguments):
        print("waiting", flush=True)
        select.select([sys.stdin, signalled], [], [])
        return function(*arguments)
    return wait
module, _, name = place.partition(":")
owner = {"mcap": mcap_writer.McapWriter, "sqlite3": sqlite3_writer.SqliteWriter, "output": output}[module]
setattr(owner, name, waiting(getattr(owner, name)))
main(["bag", "convert", *arguments])
"""
KILLED = [
    ("mcap:write", "out"),
    ("mcap:finish", "out.mcap"),
    ("sqlite3:write", "out.db3"),
    ("output:_flush", "out"),
    ("output:_rename_to_new", "out.mcap"),
]


def names() -> list[str]:
    return sorted(each.name for each in Path().iterdir())


@contextmanager
def waiting_at(place: str, *arguments: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a conversion that waits at some place for the end of its input."""
    command = [sys.executable, "-c", WAITING, place, *arguments]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, env=environment) as process:
        assert process.stdout is not None and process.stdin is not None
        assert process.stdout.readline() == b"waiting\n"
        yield process


@pytest.mark.parametrize(("place", "out"), KILLED)
def test_a_killed_run_leaves_nothing_but_its_own(place: str, out: str) -> None:
    data = mcap_bytes(strings("/a", 20))
    Path("in.mcap").write_bytes(data)
    with waiting_at(place, "in.mcap", out) as process:
        process.kill()
        assert process.wait() == -signal.SIGKILL
    left, source = names()
    assert re.fullmatch(rf"\.{re.escape(out)}\.partial-[0-9a-f]{{8}}", left) and source == "in.mcap"
    assert Path("in.mcap").read_bytes() == data

    convert_bag("in.mcap", out)
    assert names() == ["in.mcap", out]


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize("threads", ["1", "3"])
def test_an_interrupted_run_leaves_nothing(threads: str) -> None:
    Path("in.mcap").write_bytes(mcap_bytes(strings("/a", 20)))
    with waiting_at("mcap:write", "in.mcap", "out", "--threads", threads) as process:
        process.send_signal(signal.SIGINT)
        assert process.stderr is not None
        assert process.stderr.read().lstrip() == b"interrupted; no half-written output is left\n"
        assert process.wait() == 130
    assert names() == ["in.mcap"]


SMALL_DISK = """
import resource, sys
from rosidl_adapter_proto.cli import main
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
main(["bag", "convert", *sys.argv[1:]])
"""


@pytest.mark.parametrize("out", ["out.mcap", "out.db3", "out"])
def test_no_room(out: str) -> None:
    data = mcap_bytes(
        [Recorded("/a", START + i, string_cdr(str(i) * 1000)) for i in range(100)],
        compression=CompressionType.NONE,
    )
    Path("in.mcap").write_bytes(data)
    ended = subprocess.run(
        [sys.executable, "-c", SMALL_DISK, "in.mcap", out, "--compression", "none"][
            : 7 - 2 * (out == "out.db3")
        ],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 3 and ended.stderr.startswith("Error: ") and out in ended.stderr, ended.stderr
    assert names() == ["in.mcap"]
    assert Path("in.mcap").read_bytes() == data


PEAK = """
import resource, sys
from rosidl_adapter_proto.bags.convert import convert_bag
convert_bag(sys.argv[1], sys.argv[2], threads=2)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.parametrize("out", ["out.mcap", "out.db3"])
def test_memory_does_not_grow_with_the_bag(out: str) -> None:
    def peak(count: int) -> int:
        """Return how much memory a conversion of so many megabytes takes, in KiB."""
        payload = string_cdr("x" * 2**20)
        messages = (Recorded("/a", START + i, payload) for i in range(count))
        Path("in.mcap").write_bytes(mcap_bytes(messages, chunk_size=2**20, compression=CompressionType.NONE))
        Path(out).unlink(missing_ok=True)
        command = [sys.executable, "-c", PEAK, "in.mcap", out]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        return int(subprocess.run(command, env=environment, stdout=subprocess.PIPE, check=True).stdout)

    assert peak(60) - peak(10) < 15 * 2**10


def test_threads_do_not_change_the_result() -> None:
    Path("in.mcap").write_bytes(mcap_bytes(strings("/a", 200)))
    for threads in (1, 2, 7):
        convert_bag("in.mcap", f"{threads}.mcap", threads=threads)
    first = contents(Path("1.mcap"))
    for threads in (2, 7):
        assert contents(Path(f"{threads}.mcap")).messages == first.messages
