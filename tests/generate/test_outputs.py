"""What follows from the table of outputs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from rosidl_adapter_proto.generate import Options, Request, generate, outputs
from rosidl_adapter_proto.generate.output_tree import install
from rosidl_adapter_proto.generate.outputs import OUTPUTS, SHARED_FOLDERS, Output, places
from rosidl_adapter_proto.generate.targets import Files, Generation
from rosidl_adapter_proto.hooks.cmake import cmake_folder
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source, store_source
from rosidl_adapter_proto.schema.proto import ProtoFile
from tests.folders import write_package


def test_cmake_installs_every_output() -> None:
    text = (cmake_folder() / "rosidl_generator_proto_generate_interfaces.cmake").read_text(encoding="utf-8")
    (loop,) = re.findall(r"foreach\(_proto_place\s+(.*?)\)", text, re.DOTALL)

    assert [each.strip('"') for each in loop.split()] == [
        f"{folder}:{place}" for folder, place in places("${_proto_python_install_dir}").items()
    ]


def test_where_outputs_go() -> None:
    assert len({(each.folder, each.place) for each in OUTPUTS}) == len({each.folder for each in OUTPUTS})
    assert SHARED_FOLDERS.items() >= {"proto": "share", "index": "share/ament_index/resource_index"}.items()
    assert places("lib") == {**SHARED_FOLDERS, "python": "lib"}


def test_a_new_row_is_written_installed_and_part_of_the_project(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing else has to know of an output, and one that is not wanted leaves no trace."""
    write_package(folder / "my_msgs", {f"msg/A{number}.msg": "bool a\n" for number in range(20)})

    def document(generation: Generation, file: ProtoFile) -> Files:
        return {f"{file.source.name}.md": f"# {file.source.name}\n".encode()}

    new = Output("doc", "share/doc", document, is_wanted=lambda options: options.events)
    monkeypatch.setattr(outputs, "OUTPUTS", (*OUTPUTS, new))
    catalog = Catalog((folder_source(folder / "my_msgs"), store_source("kilted")))
    request = Request(("my_msgs",), dependencies=False)

    generate(request, catalog, folder / "with", Options(events=True))
    generate(request, catalog, folder / "without")
    install(folder / "with", folder / "prefix", places("lib"))

    assert (folder / "prefix/share/doc/my_msgs/msg/A7.md").read_text() == "# my_msgs/msg/A7\n"
    assert '\ndoc = "share/doc"\n' in (folder / "with/pyproject.toml").read_text()
    assert "doc" not in (folder / "without/pyproject.toml").read_text()
    assert not (folder / "without/doc").exists()
