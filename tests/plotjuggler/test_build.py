"""Building the plugins, and finding those that are built."""

from __future__ import annotations

import hashlib
import importlib.metadata
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from rosidl_adapter_proto.cli import program
from rosidl_adapter_proto.cli.texts import size_text
from rosidl_adapter_proto.errors import PluginError, RequestError
from rosidl_adapter_proto.plotjuggler import build, plugins
from rosidl_adapter_proto.plotjuggler.build import build_plugins, core_folder, source_digest
from rosidl_adapter_proto.plotjuggler.plugins import plugin_path
from tests.plotjuggler.topics import ENCODINGS


@pytest.fixture
def moved_core(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a copy of the sources in another folder, which is what is built now."""
    copy = tmp_path / "some other folder"
    for part in ("include", "src", "wasm"):
        shutil.copytree(core_folder() / part, copy / part)
    monkeypatch.setattr(build, "core_folder", lambda: copy)
    return copy


def digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def test_plugins_are_the_same_wherever_they_are_built(moved_core: Path, tmp_path: Path) -> None:
    expected = {encoding: digest(plugin_path(encoding)) for encoding in ENCODINGS}
    output = tmp_path / "not" / "there"
    result = CliRunner().invoke(program, ["plotjuggler", "build", "--output", str(output)])
    built = [output / f"{encoding}.wasm" for encoding in ENCODINGS]
    lines = [f"{plugin} ({size_text(plugin.stat().st_size)})\n" for plugin in built]
    assert (result.exit_code, result.output) == (0, "".join(lines))
    assert {plugin.stem: digest(plugin) for plugin in built} == expected
    assert sorted(output.iterdir()) == sorted(built)


def test_what_the_compiler_says(moved_core: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "_SOURCES", ("wasm/plugin.cpp",))
    shutil.rmtree(moved_core / "src" / "schema")
    (moved_core / "wasm" / "plugin.cpp").write_text("this is not C++\n")
    output = tmp_path / "output"
    with pytest.raises(
        PluginError, match=r"^the compiler failed to build protobuf\.wasm, with exit code 1:\n"
    ) as raised:
        build_plugins(output)
    assert "wasm/plugin.cpp:1:1: error: " in str(raised.value)
    assert list(output.iterdir()) == []


def test_another_compiler(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(importlib.metadata, "version", lambda name: "0.14.1")
    with pytest.raises(PluginError) as raised:
        build_plugins(tmp_path)
    assert str(raised.value) == (
        "building plugins needs ziglang 0.15.2, and 0.14.1 is installed: pip install ziglang==0.15.2"
    )


def test_no_compiler(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def missing(name: str) -> str:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "version", missing)
    with pytest.raises(PluginError) as raised:
        build_plugins(tmp_path)
    assert str(raised.value) == (
        "building plugins needs the package ziglang 0.15.2: pip install ziglang==0.15.2"
    )


def test_a_folder_that_cannot_be_made(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    with pytest.raises(PluginError) as raised:
        build_plugins(file)
    assert str(raised.value) == f"cannot write plugins to {file}: File exists; choose another folder"


def test_the_digest_is_that_of_the_sources(moved_core: Path) -> None:
    before = source_digest()
    (moved_core / "src" / "plan.cpp").write_text("// Nothing.\n")
    assert source_digest() != before


def test_there_are_two_plugins() -> None:
    with pytest.raises(RequestError) as raised:
        plugin_path("json")
    assert str(raised.value) == "there is no plugin for json, only for protobuf and ros2msg"


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_plugins_are_found_in_the_wheel_and_then_in_the_cache(
    encoding: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shipped, cached = tmp_path / "shipped", tmp_path / "cache"
    monkeypatch.setattr(plugins, "SHIPPED", shipped)
    monkeypatch.setenv("XDG_CACHE_HOME", str(cached))
    asked: list[Path] = []

    def build_in(output: Path) -> list[Path]:
        asked.append(output)
        output.mkdir(parents=True)
        files = [output / f"{each}.wasm" for each in ENCODINGS]
        for file in files:
            file.touch()
        return files

    monkeypatch.setattr(plugins, "build_plugins", build_in)
    folder = cached / "rosidl_adapter_proto" / "plotjuggler" / source_digest()
    for _ in range(2):
        assert plugin_path(encoding) == folder / f"{encoding}.wasm"
    assert asked == [folder]
    assert plugins.build_shipped_plugins()[0].parent == shipped / source_digest()
    assert plugin_path(encoding) == shipped / source_digest() / f"{encoding}.wasm"
