"""`rosidl-proto plotjuggler plot`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib.image
import pytest

from benchmarks.bag_maker import IMU, START, record, write_mcap
from rosidl_adapter_proto.cli import main
from rosidl_adapter_proto.plotjuggler import plot
from rosidl_adapter_proto.plotjuggler.series import BagSeries
from tests.plotjuggler.plots import three

Run = Callable[..., tuple[int, str, str]]
HEIGHT = "/imu/linear_acceleration/z"


@pytest.fixture(autouse=True)
def asked(folder: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """What series of a bag in the current folder were asked for."""
    write_mcap(folder / "bag.mcap", record([IMU], 0.1))
    asked: dict[str, Any] = {}

    def read_series(bag: Any, **options: Any) -> BagSeries:
        asked.update(options)
        return BagSeries(tuple(three()), ("one message is odd",))

    monkeypatch.setattr(plot, "read_series", read_series)
    return asked


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs `plotjuggler plot` for the bag, and returns its exit code and what it printed, errors last."""

    def run(*arguments: str) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ended:
            main(["plotjuggler", "plot", "bag.mcap", "--field", HEIGHT, *arguments])
        assert isinstance(ended.value.code, int)
        return (ended.value.code, *capsys.readouterr())

    return run


def test_a_picture(run: Run, asked: dict[str, Any], folder: Path) -> None:
    chosen = ("--field", "/battery", "--start", "2023-11-14T22:13:20Z", "--end", str(START + 10**9))
    done = run("--output", "x.PNG", *chosen)

    assert done == (1, "x.PNG: 3 series, 2100 values\n", "Warning: one message is odd\n")
    assert asked == {"fields": (HEIGHT, "/battery"), "start": START, "end": START + 10**9, "progress": None}
    assert matplotlib.image.imread(folder / "x.PNG").shape[:2] == (600, 1200)
    assert sorted(path.name for path in folder.iterdir()) == ["bag.mcap", "x.PNG"]


def test_a_page(run: Run, folder: Path) -> None:
    assert run("-o", "x.html", "--title", "A <walk>")[:2] == (1, "x.html: 3 series, 2100 values\n")
    assert "<title>A &lt;walk&gt;</title>" in (folder / "x.html").read_text(encoding="utf-8")


def test_the_terminal(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "70")
    code, out, err = run()

    lines = out.splitlines()
    assert (code, err) == (1, "Warning: one message is odd\n")
    assert "\x1b" not in out
    assert lines[0].strip() == "bag.mcap"
    assert len(lines[1]) == 70
    assert lines[20:23] == [
        "a /imu/linear_acceleration/z",
        "b /imu/linear_acceleration/x",
        "c /battery/charging",
    ]


def test_nothing_is_overwritten(run: Run, asked: dict[str, Any], folder: Path) -> None:
    (folder / "x.png").write_text("mine")

    assert run("-o", "x.png")[2] == (
        "Error: x.png exists, and nothing is overwritten; choose another name, or remove it\n"
    )
    assert not asked
    assert (folder / "x.png").read_text() == "mine"


def test_a_suffix_says_what_to_write(run: Run, asked: dict[str, Any]) -> None:
    assert run("-o", "x.svg")[2] == (
        "Error: x.svg: the suffix says no format of plots; name the file .png or .html\n"
    )
    assert not asked


@pytest.mark.parametrize(
    "library, output, what",
    [
        ("matplotlib", ("-o", "x.png"), "plots as PNG need matplotlib"),
        ("plotly", ("-o", "x.html"), "plots as HTML need plotly"),
        ("plotext", (), "plots in the terminal need plotext"),
    ],
)
def test_what_has_to_be_installed(
    library: str, output: tuple[str, ...], what: str, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    parts = [name for name in sys.modules if name.partition(".")[0] == library]
    drawers = [name for name in sys.modules if name.startswith("rosidl_adapter_proto.plotjuggler.plot_")]
    for name in parts + drawers:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, library, None)

    code, _, err = run(*output)
    assert code == 2
    assert err.startswith(f"Error: {what} (")
    assert err.endswith("; pip install 'rosidl-adapter-proto[plot]'\n")
