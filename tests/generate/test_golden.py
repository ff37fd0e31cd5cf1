"""Generated output under review: a small package, compared byte by byte with the files in `tests/golden`."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from rosidl_adapter_proto.generate import Options, Request, generate
from rosidl_adapter_proto.generate.manifest import MANIFEST_NAME
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source, store_source
from tests.generate.conftest import EVERY_FLAG
from tests.things import PROTOC_TAKES_JSON_CONFLICTS

GOLDEN = Path(__file__).parents[1] / "golden"


def generated(folder: Path, options: Options) -> dict[str, str]:
    catalog = Catalog((folder_source(GOLDEN / "sample_msgs"), store_source("kilted")))
    generate(Request(("sample_msgs",), dependencies=False), catalog, folder, options)
    files = {file.relative_to(folder).as_posix(): file for file in folder.rglob("*") if file.is_file()}
    del files[MANIFEST_NAME]
    return {path: file.read_text(encoding="utf-8") for path, file in sorted(files.items())}


VARIANTS: dict[str, dict[str, Any]] = {
    "hash": {},
    "sequential": {"numbering": "sequential", **EVERY_FLAG},
}
"""What each is generated with: the defaults, and everything there is."""
NOT_REVIEWED = {"hash": (), "sequential": ("python/",)}
"""Folders that are no part of it: the Python of one variant is enough to review."""


@pytest.mark.skipif(not PROTOC_TAKES_JSON_CONFLICTS, reason="needs grpcio-tools 1.66 or newer")
@pytest.mark.parametrize("variant", VARIANTS)
def test_golden(variant: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    lock_file = tmp_path / "rosidl-proto.lock"
    files = generated(tmp_path / "out", Options(lock_file=lock_file, **VARIANTS[variant]))
    files = {path: text for path, text in files.items() if not path.startswith(NOT_REVIEWED[variant])}
    if lock_file.exists():
        files[lock_file.name] = lock_file.read_text()
    expected = GOLDEN / variant
    if request.config.getoption("--update-golden"):
        shutil.rmtree(expected, ignore_errors=True)
        for path, text in files.items():
            (expected / path).parent.mkdir(parents=True, exist_ok=True)
            (expected / path).write_text(text, encoding="utf-8")
    golden = {
        file.relative_to(expected).as_posix(): file.read_text(encoding="utf-8")
        for file in expected.rglob("*")
        if file.is_file()
    }
    advice = "look at the difference; if it is meant, run: make golden"
    assert sorted(files) == sorted(golden), advice
    for path, text in files.items():
        assert text == golden[path], f"{path}: {advice}"
