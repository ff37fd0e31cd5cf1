"""Many bags at a time: in this process and in others, some of which fail."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from rosidl_adapter_proto.bags.bag import open_bag
from rosidl_adapter_proto.bags.conversion import Progress, Settings
from rosidl_adapter_proto.bags.convert import convert_bag
from rosidl_adapter_proto.bags.convert_file import FileResult, FileTask, convert_file
from rosidl_adapter_proto.bags.many import BagOutcome, BagsProgress, convert_bags, plan_bags
from rosidl_adapter_proto.bags.workers import Report, Workers, processes
from rosidl_adapter_proto.converters import ConverterRegistry
from rosidl_adapter_proto.errors import BagError, Error, PlaceError, RequestError
from tests.bags.recordings import START, Recorded, contents, mcap_bytes, strings

BAD = Recorded("/a", START + 10**12, b"\0\1\0\0bad")


@pytest.fixture(autouse=True)
def in_folder(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every test has an empty folder, and does not wait before it tries again."""
    monkeypatch.setattr("rosidl_adapter_proto.bags.workers._FIRST_DELAY", 0)


def write(name: str, *more: Recorded) -> None:
    """Write a bag of one file."""
    Path(name).parent.mkdir(exist_ok=True)
    Path(name).write_bytes(mcap_bytes([*strings("/a", 12), *more]))


def split_bag(name: str, files: int) -> None:
    """Write a bag of several files, without metadata.yaml."""
    Path(name).mkdir()
    for i in range(files):
        Path(name, f"{name}_{i}.mcap").write_bytes(mcap_bytes(strings("/a", 5, first=5 * i)))


def texts(path: Path | str) -> list[str]:
    return [each.message.data for each in open_bag(path).messages()]


def numbered(count: int) -> list[str]:
    return [f"/a {i}" for i in range(count)]


def left(folder: str = ".") -> list[str]:
    """Return what is in a folder, whatever its name begins with."""
    return sorted(os.listdir(folder))


@pytest.mark.parametrize(
    ("source", "storage", "result"),
    [
        ("bags/drive", None, "out/drive"),
        ("bags/drive", "mcap", "out/drive"),
        ("drive.2026.05", None, "out/drive.2026.05"),
        ("a.mcap", None, "out/a.mcap"),
        ("a.mcap", "sqlite3", "out/a.db3"),
        ("a.db3", None, "out/a.db3"),
        ("a.db3.zstd", "mcap", "out/a.mcap"),
        ("a.bag", None, "out/a.mcap"),
        ("a.bag", "sqlite3", "out/a.db3"),
        ("s3://bucket/a.mcap", None, "out/a.mcap"),
    ],
)
def test_the_names_of_results(source: str, storage: str | None, result: str) -> None:
    (task,) = plan_bags([source], "out", storage)
    assert (str(task.source), str(task.destination)) == (source, result)


def test_patterns_and_names() -> None:
    for name in ("bags/a.mcap", "bags/b.mcap", "c.mcap"):
        write(name)
    tasks = plan_bags(["bags/*", "c.mcap", "bags/a.mcap"], "s3://bucket/out")
    assert [(str(task.source), str(task.destination)) for task in tasks] == [
        ("bags/a.mcap", "s3://bucket/out/a.mcap"),
        ("bags/b.mcap", "s3://bucket/out/b.mcap"),
        ("c.mcap", "s3://bucket/out/c.mcap"),
    ]


@pytest.mark.parametrize(
    ("sources", "message"),
    [
        (["x/a", "y/a"], "x/a and y/a would both become out/a; convert them one after the other"),
        (
            ["a.db3", "a.bag"],
            "a.db3 and a.bag would both become out/a.mcap; convert them one after the other",
        ),
        (["a", "b*"], "no bag fits b*"),
    ],
)
def test_what_cannot_be_planned(sources: list[str], message: str) -> None:
    with pytest.raises(RequestError) as error:
        plan_bags(sources, "out", "mcap")
    assert str(error.value) == message


def convert(*sources: str, workers: Workers | None = None, **options: Any) -> dict[str, BagOutcome]:
    """Convert bags to the folder `out`, and return what became of them."""
    outcomes = convert_bags(plan_bags(sources, "out"), Settings(), workers=workers, **options)
    return {outcome.source: outcome for outcome in outcomes}


def check_many(workers: Workers) -> None:
    """Convert many bags, of which some are bad, and see what becomes of them; then again."""
    write("a.mcap")
    write("b.mcap", BAD)
    split_bag("c", 3)
    Path("d").write_bytes(b"what?")
    progress: list[BagsProgress] = []

    outcomes = convert("a.mcap", "b.mcap", "c", "d", "e", workers=workers, progress=progress.append)

    assert left("out") == ["a.mcap", "c"]
    assert left("out/c") == ["c_0.mcap", "c_1.mcap", "c_2.mcap", "metadata.yaml"]
    assert texts("out/a.mcap") == numbered(12) and texts("out/c") == numbered(15)
    errors = {source: outcome.error for source, outcome in outcomes.items()}
    assert errors.pop("b.mcap").startswith(
        "b.mcap: message 13 of /a, recorded at 1700001000000000000: std_msgs"
    )
    assert errors == {
        "a.mcap": "",
        "c": "",
        "d": "d: neither MCAP nor sqlite3 nor a ROS 1 bag: it begins with 77 68 61 74 3f",
        "e": "e: no such file or folder",
    }
    result = outcomes["c"].result
    assert result and result.total.converted == 15 and result.source_size > 2000
    assert (progress[-1].bags_done, progress[-1].bags) == (5, 5)
    assert progress[-1].message_count >= 27
    assert {now.bags_done - before.bags_done for before, now in pairwise(progress)} == {0, 1}

    write("b.mcap")
    Path("d").unlink()
    write("e")
    again = convert("a.mcap", "b.mcap", "c", "e", workers=workers)
    assert {source: outcome.was_there for source, outcome in again.items()} == {
        "a.mcap": True,
        "b.mcap": False,
        "c": True,
        "e": False,
    }
    assert left("out") == ["a.mcap", "b.mcap", "c", "e"] and not any(each.error for each in again.values())


def test_many_here() -> None:
    check_many(Workers())


def test_many_in_processes() -> None:
    with processes(2) as workers:
        check_many(workers)
    assert not multiprocessing.active_children()


def test_many_on_threads() -> None:
    workers = Workers(3)
    check_many(workers)
    workers.close()


def test_what_is_there_must_be_complete() -> None:
    write("in/a.mcap")
    Path("out/in").mkdir(parents=True)
    outcome = convert("in")["in"]
    assert outcome.error == "out/in exists, and nothing is overwritten; choose another name, or remove it"


def test_a_folder_cannot_be_made() -> None:
    write("a.mcap")
    Path("out").touch()
    with pytest.raises(BagError) as error:
        convert("a.mcap")
    assert str(error.value) == "cannot write out: File exists"


def test_a_split_bag_in_processes_equals_one_here() -> None:
    split_bag("in", 4)
    seen: list[Progress] = []
    convert_bag("in", "here")
    with processes(2) as workers:
        result = convert_bag(
            "in", "there", workers=workers, progress=seen.append, registry=ConverterRegistry()
        )
    assert result.total.converted == 20 and seen[-1].message_count == 20
    assert (Path("here/metadata.yaml")).read_bytes() == Path("there/metadata.yaml").read_bytes()
    for i in range(4):
        assert contents(Path(f"here/in_{i}.mcap")) == contents(Path(f"there/in_{i}.mcap"))


class Unreliable:
    """Converts files, but fails before some of them."""

    def __init__(self, *errors: Exception) -> None:
        self.errors = list(errors)
        self.calls = 0

    def __call__(self, task: FileTask, report: Report) -> FileResult:
        self.calls += 1
        if self.errors:
            task.destination.write_bytes(b"part")
            report(1000, 1)
            raise self.errors.pop()
        assert not isinstance(task.destination, Path) or not task.destination.exists()
        return convert_file(task, report)


BROKEN = PlaceError("broken")


@pytest.mark.parametrize(
    ("errors", "retries", "calls", "error"),
    [
        ([], 2, 1, None),
        ([BROKEN, BROKEN], 2, 3, None),
        ([BROKEN, BROKEN], 1, 2, BROKEN),
        ([BROKEN], 0, 1, BROKEN),
        ([BagError("bad")], 2, 1, BagError("bad")),
    ],
)
@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("suffix", [".mcap", ".db3"])
def test_what_may_go_well_is_tried_again(
    errors: list[Exception], retries: int, calls: int, error: Error | None, count: int, suffix: str
) -> None:
    write("a.mcap")
    unreliable = Unreliable(*errors)
    workers = Workers(count, unreliable, retries=retries)
    seen: list[Progress] = []

    def run() -> None:
        convert_bag("a.mcap", f"out{suffix}", workers=workers, progress=seen.append)

    if error:
        with pytest.raises(type(error), match=f"^{error}$"):
            run()
    else:
        run()
        assert texts(f"out{suffix}") == numbered(12) and seen[-1].message_count == 12
    workers.close()
    assert unreliable.calls == calls
    assert left() == ["a.mcap", *([] if error else [f"out{suffix}"])]


def killing(times: int) -> Callable[[Progress], None]:
    """Return what kills all processes of workers when they report something, some times."""

    def kill(progress: Progress) -> None:
        nonlocal times
        if times and progress.message_count > 0:
            for process in multiprocessing.active_children():
                times -= 1
                process.kill()
                process.join()

    return kill


def large_file(name: str) -> None:
    """Write a file that takes long enough to be interrupted."""
    Path(name).write_bytes(mcap_bytes(strings("/a", 3000), chunk_size=100))


def test_a_process_is_killed() -> None:
    large_file("a.mcap")
    with processes(2) as workers:
        convert_bag("a.mcap", "out.mcap", workers=workers, progress=killing(1))
    assert len(contents(Path("out.mcap")).messages) == 3000


def test_a_process_is_killed_again_and_again() -> None:
    large_file("a.mcap")
    with processes(2, retries=1) as workers, pytest.raises(PlaceError) as error:
        convert_bag("a.mcap", "out.mcap", workers=workers, progress=killing(2))
    assert str(error.value) == "a.mcap: the process was killed by SIGKILL while it was converted"
    assert left() == ["a.mcap"]


@pytest.mark.parametrize("count", [1, 2])
def test_control_c(count: int) -> None:
    for name in ("a.mcap", "b.mcap", "c.mcap"):
        large_file(name)

    def finished(outcome: BagOutcome) -> None:
        raise KeyboardInterrupt

    with processes(count) as workers, pytest.raises(KeyboardInterrupt):
        convert("a.mcap", "b.mcap", "c.mcap", workers=workers, finished=finished)
    assert not [name for name in left("out") if name.startswith(".")]
    assert len(left("out")) in (1, 2) and not multiprocessing.active_children()
