"""What the page about PlotJuggler says can be done, can be done."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.bag_maker import IMU, JOINT_STATES, SMALL_IMAGE, record, write_folder
from tests.test_documents import BLOCK, ROOT, run

PAGE = ROOT / "docs" / "plotjuggler.md"


def test_everything_on_the_page_runs(tmp_path: Path, plugin_files: dict[str, Path]) -> None:
    write_folder(tmp_path / "recording", record([IMU, JOINT_STATES, SMALL_IMAGE], 1), storage="mcap")
    assert plugin_files  # built before, so that no command builds them in the cache
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
        for kind, text in BLOCK.findall(PAGE.read_text(encoding="utf-8")):
            run(tmp_path, tmp_path, kind, text)
    files = ("angular.parquet", "elsewhere", "imu.csv", "joints.parquet", "plugins", "recording", "some.npz")
    assert tuple(sorted(path.name for path in tmp_path.iterdir())) == files
    header, first, *_ = (tmp_path / "imu.csv").read_text().splitlines()
    assert header == ",".join(
        f'"{name}"' for name in ("time", *(f"/imu/linear_acceleration/{each}" for each in "xyz"))
    )
    assert first.startswith("2023-11-14 22:13:20.000000000Z,")
