"""What the pages about Ray Data and Daft show works."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from benchmarks.bag_maker import IMU, TF, record, write_mcap
from rosidl_adapter_proto.bags.bag import open_bag

DOCS = Path(__file__).parents[3] / "docs"
BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)


@pytest.fixture(autouse=True)
def recordings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two recordings in the folder that the pages read."""
    folder = tmp_path / "recordings"
    folder.mkdir()
    for name in ("a.mcap", "b.mcap"):
        write_mcap(folder / name, record([IMU, TF], 1))
    monkeypatch.chdir(tmp_path)
    return folder


def run_page(name: str) -> dict[str, Any]:
    """Run the blocks of a page one after the other, as one program, and return its variables."""
    variables: dict[str, Any] = {"__name__": "__main__"}
    blocks = BLOCK.findall((DOCS / name).read_text(encoding="utf-8"))
    assert blocks
    for block in blocks:
        exec(compile(block, name, "exec"), variables)
    return variables


def heights(folder: Path) -> list[float]:
    """Return the accelerations along z of all recordings."""
    return [
        each.message.linear_acceleration.z
        for path in sorted(folder.iterdir())
        for each in open_bag(path).messages("/imu")
    ]


@pytest.mark.usefixtures("cluster")  # on which Daft runs then
def test_daft(recordings: Path) -> None:
    found = run_page("daft.md")
    assert found["daft"].get_or_infer_runner_type() == "ray"
    expected = heights(recordings)
    assert found["strongest"].to_pydict() == {"strongest": [max(expected)], "messages": [len(expected)]}
    assert found["message"].transforms[0].child_frame_id == "base_link"


@pytest.mark.filterwarnings("ignore:.*deprecated:DeprecationWarning")  # Ray warns of what it does itself
@pytest.mark.usefixtures("cluster")
def test_ray_data(recordings: Path) -> None:
    found = run_page("ray-data.md")
    expected = heights(recordings)
    assert found["imu"].count() == len(expected)
    assert sorted(row["linear_acceleration"]["z"] for row in found["imu"].take_all()) == sorted(expected)
    assert found["tf"].transforms[0].child_frame_id == "base_link"
