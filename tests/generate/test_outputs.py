"""What follows from the table of outputs."""

from __future__ import annotations

import re
import sys
import sysconfig
from pathlib import Path

import pytest

from rosidl_adapter_proto.generate import Options, Request, generate, outputs
from rosidl_adapter_proto.generate.output_tree import install
from rosidl_adapter_proto.generate.outputs import OUTPUTS, SHARED_FOLDERS, Output, places
from rosidl_adapter_proto.generate.targets import Files, Generation
from rosidl_adapter_proto.hooks.cmake import cmake_folder
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source, prefix_sources, store_source
from rosidl_adapter_proto.schema.proto import ProtoFile
from tests.folders import content, write_package
from tests.generate.conftest import EVERY_FLAG


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


# What rosidl_generate_interfaces and ament_package install of any package, its Python apart.
INSTALLED_BY_ROS = re.compile(
    r"share/[^/]+/(msg|srv|action)/[^/]+\.(msg|srv|action|idl|json)"
    r"|share/[^/]+/((cmake|environment)/.*|(package|local_setup)\..*)"
    r"|include/.*|lib/[^/]*|share/ament_index/resource_index/(packages|rosidl_interfaces)/.*"
)


def test_no_output_lands_on_a_path_of_ros(tmp_path: Path) -> None:
    """Neither on a file that ROS has installed of the packages, nor where it installs those of others."""
    prefix = Path(sys.prefix)
    if not (prefix / "share/test_msgs/action/Fibonacci.action").is_file():
        pytest.skip("needs a ROS installation")
    python_folder = Path(sysconfig.get_path("purelib")).relative_to(prefix).as_posix()
    request = Request(("std_msgs", "std_srvs", "test_msgs"))

    generate(request, Catalog(tuple(prefix_sources())), tmp_path / "out", Options(**EVERY_FLAG))
    install(tmp_path / "out", tmp_path / "prefix", places(python_folder))

    folders = {each.name for each in (tmp_path / "out").iterdir() if each.is_dir()}
    assert folders == {each.folder for each in OUTPUTS}
    python_of_ros = tuple(f"{python_folder}/{package}/" for package in request.packages)
    for path, data in content(tmp_path / "prefix").items():
        if data is not None:
            assert not (prefix / path).exists(), path
            assert not INSTALLED_BY_ROS.fullmatch(path), path
            assert not path.startswith(python_of_ros), path


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
