"""`rosidl-proto bag convert`."""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import Any

import pytest

from rosidl_adapter_proto.bags.conversion import Progress
from rosidl_adapter_proto.cli import conversion_report as report
from rosidl_adapter_proto.cli.texts import size_text
from tests.bags.recordings import START, STRING, contents, mcap_bytes, strings
from tests.cli.conftest import Outcome, Run

BAD = b"\0\1\0\0\xff\0\0\0xy\0"
TIMES = re.compile(r"in \d+\.\d s \([\d.]+ [kMG]?B/s\)")


def convert(run: Run, *arguments: str, wrong: int = 0, count: int = 14, **options: Any) -> Outcome:
    """Convert a bag with some messages, the last of which are wrong; times in what is printed are `TIME`."""
    messages = strings("/a", count - wrong)
    messages += [each._replace(data=BAD) for each in strings("/a", wrong, count - wrong)]
    Path("in.mcap").write_bytes(mcap_bytes(messages, **options))
    ended = run("bag", "convert", "in.mcap", *arguments)
    return Outcome(ended.code, TIMES.sub("in TIME", ended.out), ended.err)


def size(path: str) -> str:
    return size_text(Path(path).stat().st_size)


def test_all_is_well(run: Run) -> None:
    ended = convert(run, "out.mcap")
    sizes = f"{size('in.mcap')} became {size('out.mcap')}"
    assert ended == Outcome(0, f"out.mcap: 14 converted; {sizes}, in TIME\n", "")


def test_what_is_not_selected(run: Run) -> None:
    ended = convert(
        run, "out.mcap", "--topic", "/*", "--start", "2023-11-14T22:13:22Z", "--end", f"{START + 5 * 10**9}"
    )
    assert ended.code == 0 and ended.out.startswith("out.mcap: 3 converted, 11 not selected; ")
    assert [each.log_time for each in contents(Path("out.mcap")).messages] == [
        START + i * 10**9 for i in (2, 3, 4)
    ]


@pytest.mark.parametrize(
    ("on_error", "counts"), [("skip", "2 converted, 12 skipped"), ("copy", "2 converted, 12 copied")]
)
def test_messages_that_are_wrong(run: Run, on_error: str, counts: str) -> None:
    ended = convert(run, "out.mcap", "--on-error", on_error, wrong=12)

    assert ended.code == 1 and ended.out.startswith(f"out.mcap: {counts}; ")
    *lines, last = ended.err.splitlines()
    assert len(lines) == 10 and last == "Cannot convert 2 more messages"
    assert lines[0].startswith(
        f"Cannot convert in.mcap: message 3 of /a, recorded at {START + 2 * 10**9}: {STRING}.data at byte "
    )


def test_it_stops(run: Run) -> None:
    ended = convert(run, "out.mcap", wrong=1)
    assert (ended.code, ended.out) == (3, "")
    assert ended.err.startswith(
        f"Error: in.mcap: message 14 of /a, recorded at {START + 13 * 10**9}: {STRING}"
    )
    assert not Path("out.mcap").exists()


def test_names_of_rosbag2(run: Run) -> None:
    long = ("--input-serialization-format", "cdr", "--output-serialization-format", "protobuf")
    assert convert(run, "long.mcap", *long).code == 0
    assert convert(run, "short.mcap", "--from", "cdr", "--to", "protobuf").code == 0
    assert contents(Path("long.mcap")) == contents(Path("short.mcap"))._replace(
        metadata=contents(Path("long.mcap")).metadata
    )


def test_a_warning(run: Run) -> None:
    ended = convert(run, "out.mcap", "--to", "protobuf", formats={"/a": "protobuf"})
    assert ended.code == 0 and ended.out.startswith("out.mcap: 14 copied; ")
    assert ended.err == (
        "Warning: topic /a says protobuf, but its messages do not look like it; "
        "if they are cdr, `--from cdr` says so\n"
    )


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["out", "--to", "ros1"], "Error: Could not find converter for format ros1"),
        (["in.mcap"], "Error: in.mcap exists, and nothing is overwritten; choose another name, or remove it"),
        (["out", "--plugin", "tests.converters.plugins:Nameless"], "Error: plugin"),
    ],
)
def test_errors(run: Run, arguments: list[str], text: str) -> None:
    ended = convert(run, *arguments)
    assert (ended.code, ended.out) == (3, "") and ended.err.startswith(text), ended.err
    assert [each.name for each in Path().iterdir()] == ["in.mcap"]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (
            ["--start", "yesterday"],
            "'yesterday' is neither like 2026-05-01T12:00:00Z nor a number of nanoseconds",
        ),
        (
            ["--end", "2026-05-01T12:00:00"],
            "'2026-05-01T12:00:00' has no time zone; write 2026-05-01T12:00:00Z",
        ),
        (["--threads", "0"], "0 is not in the range"),
        (["--on-error", "ignore"], "'ignore' is not one of 'stop', 'skip', 'copy'"),
        (["--topic", "/b"], "there is no topic /b; there are /a"),
    ],
)
def test_usage(run: Run, arguments: list[str], text: str) -> None:
    ended = convert(run, "out", *arguments)
    assert ended.code == 2 and text in ended.err, ended.err


def test_plugins(run: Run) -> None:
    plugin = ("--plugin", "tests.converters.plugins:JsonConverter")
    assert convert(run, "there.mcap", "--to", "json", *plugin).code == 0
    assert contents(Path("there.mcap")).messages[0].data == b'{"data": "/a 0"}'


def test_progress(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    now = iter([100.0, 110.0, 110.05, 120.0])
    monkeypatch.setattr(time, "monotonic", lambda: next(now))
    line = report.ProgressLine(next(now))
    line(Progress(0, 4_000_000_000, 0))
    line(Progress(10, 4_000_000_000, 3))  # too soon
    line(Progress(1_000_000_000, 4_000_000_000, 5000))
    line.clear()
    assert capsys.readouterr().err == (
        "\r  0%  0 messages, 0 B/s" "\r 25%  5000 messages, 50.0 MB/s, 1:00 left" "\r"
    )
