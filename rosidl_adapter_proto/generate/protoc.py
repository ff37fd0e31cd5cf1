"""Runs protoc: the only place that does."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet

from rosidl_adapter_proto.errors import GenerateError

# What grpcio-tools bundles for imports such as google/protobuf/timestamp.proto is found by protoc itself.
_PROTOC = [sys.executable, "-m", "grpc_tools.protoc"]


def compile_protos(protos: Mapping[str, str], wanted: Iterable[str]) -> dict[str, bytes]:
    """Compile `.proto` files.

    Args:
        protos: Text of each file, by its path; everything that is imported must be there.
        wanted: Paths of the files to compile.

    Returns:
        The serialized FileDescriptorProto of each wanted file, in the form that protoc's own Python output embeds.

    Raises:
        GenerateError: protoc cannot be run or refuses a file; the message has what it said. Or there is no room for it.
    """
    wanted = list(wanted)
    if not wanted:
        return {}
    try:
        with tempfile.TemporaryDirectory(prefix="rosidl-proto-") as folder:
            files = _compile(protos, wanted, Path(folder))
    except OSError as error:
        place = f" ({error.filename})" if error.filename else ""
        raise GenerateError(
            f"cannot run protoc in a temporary folder: {error.strerror}{place}; "
            "make room there, or set TMPDIR to another folder"
        ) from error
    return {file.name: _without_json_names(file).SerializeToString(deterministic=True) for file in files}


def _compile(protos: Mapping[str, str], wanted: list[str], folder: Path) -> Sequence[FileDescriptorProto]:
    """Run protoc in a folder, which is to be empty; errors are those of `compile_protos`, and `OSError`."""
    root = folder / "protos"
    for path, text in protos.items():
        file = root / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8", newline="\n")
    arguments = folder / "arguments"
    output = folder / "descriptors"
    # A file of arguments, since a whole ROS installation would be too long for a command line.
    arguments.write_text(
        "\n".join([f"--proto_path={root}", f"--descriptor_set_out={output}", *wanted]), encoding="utf-8"
    )
    try:
        # It runs in a folder of its own: `python -m` would find modules in the current one first.
        process = subprocess.run([*_PROTOC, f"@{arguments}"], cwd=folder, capture_output=True, check=False)
    except OSError as error:
        raise GenerateError(f"cannot run protoc: {error}") from error
    if process.returncode != 0:
        said = (process.stderr.strip() or process.stdout.strip()).decode(errors="replace")
        said = said.replace(f"{root}/", "")
        raise GenerateError(f"protoc failed with exit code {process.returncode}:\n{said}")
    return FileDescriptorSet.FromString(output.read_bytes()).file


def _without_json_names(file: FileDescriptorProto) -> FileDescriptorProto:
    """Drop what protoc's own Python output leaves out, so that both can be loaded side by side."""
    for message in file.message_type:
        for field in message.field:
            field.ClearField("json_name")
    return file
