"""Plugins go to where PlotJuggler looks, and nothing of others is overwritten."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from rosidl_adapter_proto.cli import main
from rosidl_adapter_proto.errors import PluginError
from rosidl_adapter_proto.plotjuggler.install import NAMES, install_plugins, plugin_folder


@pytest.mark.parametrize(
    ("data_home", "version", "folder"),
    [
        ("/data", "3", "/data/PlotJuggler"),
        ("/data", "4", "/data/plotjuggler/extensions/rosidl-proto"),
        ("", "3", "/home/me/.local/share/PlotJuggler"),
        ("not/absolute", "3", "/home/me/.local/share/PlotJuggler"),
    ],
)
def test_where_plotjuggler_looks(
    data_home: str, version: str, folder: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", data_home)
    monkeypatch.setenv("HOME", "/home/me")
    assert plugin_folder(version) == Path(folder)


def test_plugins_are_copied_once(tmp_path: Path, plugin_files: dict[str, Path]) -> None:
    assert [each.is_new for each in install_plugins(tmp_path / "a" / "b")] == [True, True]
    found = {path.name: path.read_bytes() for path in (tmp_path / "a" / "b").iterdir()}
    assert found == {name: plugin_files[encoding].read_bytes() for encoding, name in NAMES.items()}
    assert [each.is_new for each in install_plugins(tmp_path / "a" / "b")] == [False, False]


def test_another_version_is_replaced(tmp_path: Path, plugin_files: dict[str, Path]) -> None:
    place = tmp_path / NAMES["protobuf"]
    place.write_bytes(plugin_files["protobuf"].read_bytes() + b"more")
    assert [each.is_new for each in install_plugins(tmp_path)] == [True, True]
    assert place.read_bytes() == plugin_files["protobuf"].read_bytes()


def test_other_files_are_left(tmp_path: Path, plugin_files: dict[str, Path]) -> None:
    place = tmp_path / NAMES["ros2msg"]
    place.write_bytes(b"mine")
    text = f"{place}: there is a file that is none of our plugins; --force replaces it"
    with pytest.raises(PluginError, match=f"^{re.escape(text)}$"):
        install_plugins(tmp_path)
    assert list(tmp_path.iterdir()) == [place]
    assert place.read_bytes() == b"mine"
    install_plugins(tmp_path, force=True)
    assert place.read_bytes() == plugin_files["ros2msg"].read_bytes()


def test_a_place_that_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    text = f"cannot write plugins to {tmp_path / 'file'}: File exists; choose another folder"
    with pytest.raises(PluginError, match=f"^{re.escape(text)}$"):
        install_plugins(tmp_path / "file")


def test_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    folder = tmp_path / "PlotJuggler"
    for remark in ("", " was there already"):
        with pytest.raises(SystemExit, match="0"):
            main(["plotjuggler", "install"])
        assert capsys.readouterr().out == "".join(f"{folder / name}{remark}\n" for name in NAMES.values())
