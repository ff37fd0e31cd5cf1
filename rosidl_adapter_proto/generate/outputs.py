"""Everything that a run makes, one row each.

What is written, what the manifest lists, where installing puts it, and what the installable project has follow from
these rows. A new file for each interface is a function, its template, and a row.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from rosidl_adapter_proto.generate.settings import Options
from rosidl_adapter_proto.generate.targets import Files, Generation, Progress, index, project, proto, python
from rosidl_adapter_proto.schema.proto import ProtoFile


@dataclass(frozen=True)
class Output:
    """Files of one kind.

    Attributes:
        folder: Their folder in the output folder.
        place: Where what is in that folder goes in a prefix; None for where Python has its packages.
        is_wanted: Whether options ask for them.
        interface_files: Makes those of one interface; paths are relative to the folder.
        common_files: Makes those that interfaces have in common.
    """

    folder: str
    place: str | None
    is_wanted: Callable[[Options], bool] = field(kw_only=True)
    interface_files: Callable[[Generation, ProtoFile], Files] = lambda generation, file: {}
    common_files: Callable[[Generation], Files] = lambda generation: {}


def _always(options: Options) -> bool:
    return True


OUTPUTS = (
    Output("proto", "share", proto.interface_files, is_wanted=_always),
    Output("python", None, python.interface_files, python.package_files, is_wanted=_always),
    Output("index", index.PLACE, common_files=index.resource_files, is_wanted=_always),
)

SHARED_FOLDERS = {each.folder: each.place for each in OUTPUTS if each.place is not None}
"""Where the folders of an output folder that are not Python's go in a prefix."""


def places(python_folder: str) -> dict[str, str]:
    """Return where every folder of an output folder goes in a prefix with that folder of Python packages."""
    return {each.folder: python_folder if each.place is None else each.place for each in OUTPUTS}


def all_files(generation: Generation, progress: Progress | None = None) -> dict[str, bytes]:
    """Return the content of every file that a run makes, by path in the output folder."""
    outputs = _wanted(generation.options)
    made: list[dict[str, bytes]] = [{} for _ in outputs]
    for done, file in enumerate(generation.files, 1):
        for files, each in zip(made, outputs, strict=True):
            files.update(each.interface_files(generation, file))
        if progress:
            progress(done, len(generation.files))
    content: dict[str, bytes] = {}
    for each, files in zip(outputs, made, strict=True):
        files.update(each.common_files(generation))
        content.update((f"{each.folder}/{path}", data) for path, data in files.items())
    shared_folders = {each.folder: each.place for each in outputs if each.place is not None}
    content["pyproject.toml"] = project.project_file(generation, shared_folders)
    return content


def _wanted(options: Options) -> list[Output]:
    return [each for each in OUTPUTS if each.is_wanted(options)]
