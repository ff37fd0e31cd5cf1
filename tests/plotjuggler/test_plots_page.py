"""What the page about plots shows is what its commands do."""

from __future__ import annotations

from pathlib import Path

import matplotlib.image
import numpy
import pytest

from tests.plotjuggler.walk import write_walk
from tests.test_documents import BLOCK, ROOT, run

PAGE = ROOT / "docs" / "plots.md"
PICTURE = ROOT / "docs" / "images" / "plot.png"


@pytest.fixture(scope="module")
def folder(plugin_files: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which everything on the page has run."""
    folder, cache = tmp_path_factory.mktemp("plots"), tmp_path_factory.mktemp("cache")
    (cache / "rosidl_adapter_proto").mkdir()
    (cache / "rosidl_adapter_proto" / "plotjuggler").symlink_to(plugin_files["ros2msg"].parent.parent)
    write_walk(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(cache))
        for kind, text in BLOCK.findall(PAGE.read_text(encoding="utf-8")):
            run(folder, folder, kind, text)
    return folder


def test_files_are_there(folder: Path) -> None:
    assert sorted(path.name for path in folder.iterdir()) == ["joints.png", "plot.html", "plot.png", "walk"]


def test_the_picture_is_what_the_command_draws(folder: Path) -> None:
    """Copy the new picture to docs/images if this fails for a reason."""
    drawn, shown = (matplotlib.image.imread(path)[..., :3] for path in (folder / "plot.png", PICTURE))
    assert drawn.shape == shown.shape
    assert numpy.abs(drawn - shown).mean() < 0.01  # fonts and smoothing may differ, lines may not
    assert PICTURE.stat().st_size < 60_000
