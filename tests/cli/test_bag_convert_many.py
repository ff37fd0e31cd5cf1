"""`rosidl-proto bag convert` for many bags, and for bags that are not on this machine."""

from __future__ import annotations

import re
import shutil
import sys
from io import StringIO
from pathlib import Path

import pytest

from tests.bags.recordings import START, Recorded, mcap_bytes, strings
from tests.cli.conftest import Run

BAD = Recorded("/a", START + 10**12, b"\0\1\0\0bad")
WHY = "Failed: in/b.mcap: message 13 of /a, recorded at 1700001000000000000: std_msgs/msg/String.data at byte 4: "


@pytest.fixture(autouse=True)
def bags(folder: Path) -> None:
    """Two bags, one of them bad."""
    Path("in").mkdir()
    Path("in/a.mcap").write_bytes(mcap_bytes(strings("/a", 12)))
    Path("in/b.mcap").write_bytes(mcap_bytes([*strings("/a", 12), BAD]))


def without_numbers(text: str) -> str:
    """Return a text without sizes and times."""
    return re.sub(r"[\d.]+ (kB|B|s)\b", "N", text)


@pytest.mark.parametrize(
    "sources", [["in/*"], ["in/a.mcap", "in/b.mcap"], ["--list", "list.txt"], ["--list", "-"]]
)
@pytest.mark.parametrize("jobs", [[], ["--jobs", "2"]])
def test_many(run: Run, monkeypatch: pytest.MonkeyPatch, sources: list[str], jobs: list[str]) -> None:
    listed = "in/a.mcap\n\n in/b.mcap\n"
    Path("list.txt").write_text(listed)
    monkeypatch.setattr(sys, "stdin", StringIO(listed))
    ended = run("bag", "convert", *sources, "out", *jobs)
    assert ended.code == 3
    first, last = without_numbers(ended.out).splitlines()
    assert first == "out/a.mcap: 12 converted; N became N"
    assert last == "2 bags: 1 converted, 1 failed; in N (N/s)"
    early, late = ended.err.splitlines()
    assert early == "Failed: in/b.mcap" and late.startswith(WHY)
    assert [each.name for each in Path("out").iterdir()] == ["a.mcap"]


def test_going_on(run: Run) -> None:
    assert run("bag", "convert", "in/*", "out").code == 3
    ended = run("bag", "convert", "in/*", "out", "--on-error", "skip")
    assert ended.code == 1
    assert without_numbers(ended.out).splitlines() == [
        "out/a.mcap: was there already",
        "out/b.mcap: 12 converted, 1 skipped; N became N",
        "2 bags: 1 incomplete, 1 already there; in N (N/s)",
    ]
    assert ended.err.startswith("Cannot convert in/b.mcap: message 13 of /a")
    assert run("bag", "convert", "in/*", "out").code == 0


def test_one_bag_that_fits_a_pattern_goes_into_a_folder_too(run: Run) -> None:
    ended = run("bag", "convert", "in/a*", "out")
    assert (ended.code, ended.err) == (0, "") and "\n1 bag: 1 converted; in " in ended.out
    assert Path("out/a.mcap").is_file()


def test_one_bag_with_jobs(run: Run) -> None:
    Path("in/b.mcap").write_bytes(mcap_bytes(strings("/a", 5, first=12)))
    ended = run("bag", "convert", "in", "out", "--jobs", "2")
    assert (ended.code, without_numbers(ended.out)) == (0, "out: 17 converted; N became N, in N (N/s)\n")


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["y*", "out"], 2, "Error: no bag fits y*\n"),
        (["in/a.mcap", "./in/a.mcap", "out"], 0, ""),
        (
            ["in", "x/in", "out"],
            2,
            "Error: in and x/in would both become out/in; convert them one after the other\n",
        ),
        (
            ["in", "out", "/a"],  # as with the `--topics` of rosbag2, behind which there may be several names
            2,
            "Error: out: no such file or folder; the last name is OUT, and all before it must exist\n",
        ),
        (["nope://x", "out"], 2, "Error: nope://x: Protocol not known: nope\n"),
    ],
)
def test_before_anything_is_done(run: Run, arguments: list[str], code: int, message: str) -> None:
    shutil.copytree("in", "x/in")
    ended = run("bag", "convert", *arguments)
    assert (ended.code, ended.err) == (code, message)
    assert Path("out").exists() == (not code)


def test_one_place_is_not_enough(run: Run) -> None:
    ended = run("bag", "convert", "in")
    assert ended.code == 2 and ended.err.endswith("Error: Missing argument 'OUT'.\n")


@pytest.mark.parametrize("command", [["info"], ["cat"], ["convert"]])
def test_places_that_are_not_here(run: Run, command: list[str]) -> None:
    fsspec = pytest.importorskip("fsspec")
    fsspec.filesystem("memory").pipe("/in.mcap", Path("in/a.mcap").read_bytes())
    more = {"info": [], "cat": ["/a"], "convert": ["memory://out.mcap"]}[command[0]]
    ended = run("bag", *command, "memory://in.mcap", *more)
    assert (ended.code, ended.err) == (0, "")
    fsspec.filesystem("memory").rm("/", recursive=True)
