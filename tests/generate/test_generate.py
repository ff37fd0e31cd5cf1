"""The whole of a generation: what is written where, when it is written again, and what is left of a failed one."""

from __future__ import annotations

import errno
import json
import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

import rosidl_adapter_proto
from rosidl_adapter_proto.errors import DefinitionError, GenerateError, SchemaError
from rosidl_adapter_proto.generate import Options, Request, Result, fingerprint, generate, output_tree, protoc
from rosidl_adapter_proto.generate import lock as lock_module
from rosidl_adapter_proto.generate.manifest import MANIFEST_NAME
from rosidl_adapter_proto.generate.render import templates_folder
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source, store_source
from rosidl_adapter_proto.interfaces.model import TypeName
from tests.folders import content, times, write_package

POINT = "float64 x\nfloat64 y\n"
PLACE = "# In µm.\nbase_msgs/Point position\nstring name\n"
MOVE = "bool fast\n---\nbool done\n"
BY_HASH = Options()
STORE = store_source("kilted")  # it has what ROS adds to services


def write_source(folder: Path) -> Path:
    """Write two packages: `my_msgs` refers to `base_msgs`."""
    write_package(folder / "base_msgs", {"msg/Point.msg": POINT, "msg/Other.msg": "int32 n\n"})
    write_package(folder / "my_msgs", {"msg/Place.msg": PLACE, "srv/Move.srv": MOVE})
    return folder


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """A folder of packages."""
    return write_source(tmp_path / "src")


@pytest.fixture
def output(tmp_path: Path) -> Path:
    """Where to generate, empty."""
    return tmp_path / "out"


@pytest.fixture(scope="module")
def generated_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What is generated of `source`; nothing in it depends on the place."""
    folder = tmp_path_factory.mktemp("generated_once")
    run(write_source(folder / "src"), folder / "out")
    return folder / "out"


@pytest.fixture
def generated(generated_once: Path, output: Path) -> Path:
    """Where `source` was generated."""
    return shutil.copytree(generated_once, output)


def run(
    source: Path,
    output: Path,
    packages: Sequence[str] = ("my_msgs",),
    types: Sequence[TypeName] = (),
    options: Options = BY_HASH,
    *,
    deps: bool = True,
    check: bool = False,
    renumber: bool = False,
) -> Result:
    """Generate from a folder of packages."""
    request = Request(tuple(packages), tuple(types), deps)
    return generate(request, find(source), output, options, check=check, renumber=renumber)


def find(source: Path) -> Catalog:
    return Catalog((folder_source(source), STORE))


def modules(package: str, name: str, root: str = "rosidl_proto") -> set[str]:
    base = f"python/{root}/{package}"
    return {f"{base}/{name}{end}" for end in ("_pb2.py", "_pb2.pyi", "_adapter.py")} | {
        f"{base}/__init__.py",
        f"{base}/py.typed",
    }


def files_in(output: Path) -> set[str]:
    return {path for path, data in content(output).items() if data is not None}


BASE_FILES = {
    "proto/base_msgs/msg/Other.proto",
    "proto/base_msgs/msg/Point.proto",
    "index/rosidl_proto/base_msgs",
    *modules("base_msgs/msg", "Other"),
    *modules("base_msgs/msg", "Point"),
}
MY_FILES = {
    "proto/my_msgs/msg/Place.proto",
    "proto/my_msgs/srv/Move.proto",
    "index/rosidl_proto/my_msgs",
    *modules("my_msgs/msg", "Place"),
    *modules("my_msgs/srv", "Move"),
}
OWN_FILES = {"pyproject.toml", MANIFEST_NAME}


def test_layout_of_the_output(source: Path, output: Path) -> None:
    result = run(source, output)

    assert files_in(output) == BASE_FILES | MY_FILES | OWN_FILES
    assert not (output / "python" / "rosidl_proto" / "__init__.py").exists()
    assert list(map(str, result.interfaces)) == [
        "base_msgs/msg/Point",
        "my_msgs/msg/Place",
        "my_msgs/srv/Move",
        "base_msgs/msg/Other",
    ]
    assert set(result.changes.written) == files_in(output) - {MANIFEST_NAME}


def test_without_dependencies(source: Path, output: Path) -> None:
    run(source, output, deps=False)

    assert files_in(output) == MY_FILES | OWN_FILES


def test_a_single_type(source: Path, output: Path) -> None:
    """What it refers to comes as a whole package, but nothing else of its own."""
    run(source, output, (), [TypeName("my_msgs", "msg", "Place")])

    assert files_in(output) == BASE_FILES | OWN_FILES | {
        "index/rosidl_proto/my_msgs",
        "proto/my_msgs/msg/Place.proto",
        *modules("my_msgs/msg", "Place"),
    }


def test_a_single_type_without_dependencies(source: Path, output: Path) -> None:
    run(source, output, (), [TypeName("my_msgs", "msg", "Place")], deps=False)

    assert files_in(output) == OWN_FILES | {
        "index/rosidl_proto/my_msgs",
        "proto/my_msgs/msg/Place.proto",
        *modules("my_msgs/msg", "Place"),
    }


def test_python_root(source: Path, output: Path) -> None:
    run(source, output, ("base_msgs",), options=Options(python_root="my_protos"))

    assert {path for path in files_in(output) if path.startswith("python")} == {
        *modules("base_msgs/msg", "Other", "my_protos"),
        *modules("base_msgs/msg", "Point", "my_protos"),
    }
    assert 'packages = ["python/my_protos"]' in (output / "pyproject.toml").read_text()
    assert b"rosidl_proto." not in b"".join(filter(None, content(output / "python").values()))


@pytest.mark.parametrize("root", ["class", "a.b", "a-b", "", "1a"])
def test_python_root_that_is_no_name(root: str, source: Path, output: Path) -> None:
    with pytest.raises(GenerateError, match=f"^{root!r} cannot be the name of a Python package$"):
        run(source, output, options=Options(python_root=root))

    assert not output.exists()


def test_events(source: Path, output: Path) -> None:
    without = run(source, output, deps=False)
    assert b"message Move_Event" not in (output / "proto/my_msgs/srv/Move.proto").read_bytes()
    assert len(without.interfaces) == 4

    run(source, output, options=Options(events=True))
    assert b"message Move_Event" in (output / "proto/my_msgs/srv/Move.proto").read_bytes()
    assert (output / "proto/service_msgs/msg/ServiceEventInfo.proto").exists()


def test_nothing_is_done_twice(source: Path, output: Path) -> None:
    first = run(source, output)
    before = times(output)

    again = run(source, output)

    assert again.interfaces == first.interfaces
    assert not again.is_stale
    assert again.changes.unchanged == len(first.changes.written)
    assert times(output) == before


RUN = """
import sys
from pathlib import Path
from rosidl_adapter_proto.generate import Request, generate
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source, store_source
source, output, package, *distributions = sys.argv[1:]
catalog = Catalog((folder_source(Path(source)), *map(store_source, distributions)))
print(generate(Request((package,)), catalog, Path(output)).is_stale)
slow = ("jinja2", "black", "grpc_tools", "lark", "rosbags", "click", "google.protobuf", "rosidl_adapter_proto.adapter")
print([name for name in slow if name in sys.modules])
"""


def test_slow_libraries_are_not_loaded_when_nothing_is_to_be_done(source: Path, output: Path) -> None:
    generate(Request(("base_msgs",)), Catalog((folder_source(source),)), output)

    command = [sys.executable, "-c", RUN, str(source), str(output), "base_msgs"]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == "False\n[]\n"


def test_a_changed_definition_rewrites_what_depends_on_it(source: Path, generated: Path) -> None:
    before = times(generated)
    (source / "my_msgs/msg/Place.msg").write_text(PLACE + "int32 floor\n")

    result = run(source, generated)

    base = "python/rosidl_proto/my_msgs/msg/Place"
    expected = {
        "index/rosidl_proto/my_msgs",
        "proto/my_msgs/msg/Place.proto",
        f"{base}_pb2.py",
        f"{base}_pb2.pyi",
        f"{base}_adapter.py",
    }
    assert set(result.changes.written) == expected
    after = times(generated)
    changed = {path for path in files_in(generated) if after[path] != before[path]}
    assert changed == expected | {MANIFEST_NAME}


def test_a_changed_type_changes_the_hash_of_those_that_have_it(source: Path, generated: Path) -> None:
    (source / "base_msgs/msg/Point.msg").write_text(POINT + "float64 z\n")

    result = run(source, generated)

    assert {path.rpartition("/")[2] for path in result.changes.written} == {
        "base_msgs",
        "Point.proto",
        "Point_pb2.py",
        "Point_pb2.pyi",
        "Point_adapter.py",
        "Place_adapter.py",
    }


def test_a_changed_type_that_ros_adds_to_services(source: Path, generated: Path) -> None:
    """It is not generated with the service, but counts in its type hash."""
    write_package(source / "service_msgs", {"msg/ServiceEventInfo.msg": "uint8 event_type\n"})

    result = run(source, generated)

    assert result.changes.written == ("python/rosidl_proto/my_msgs/srv/Move_adapter.py",)


def test_a_change_that_makes_no_difference(source: Path, generated: Path) -> None:
    """Nothing is stale, and the manifest learns of it, so that the next run is quick again."""
    before = content(generated)
    (source / "my_msgs/msg/Place.msg").write_text(PLACE + "\n\n")

    assert not run(source, generated, check=True).is_stale
    assert content(generated) == before
    assert not run(source, generated).is_stale
    assert {path for path, data in content(generated).items() if data != before[path]} == {MANIFEST_NAME}


def test_a_removed_definition(source: Path, generated: Path) -> None:
    (source / "my_msgs/srv/Move.srv").unlink()

    result = run(source, generated)

    gone = {"proto/my_msgs/srv/Move.proto", *modules("my_msgs/srv", "Move")}
    assert set(result.changes.removed) == gone
    assert files_in(generated) == (BASE_FILES | MY_FILES | OWN_FILES) - gone
    assert not (generated / "proto/my_msgs/srv").exists()
    assert not (generated / "python/rosidl_proto/my_msgs/srv").exists()


def test_a_new_definition(source: Path, generated: Path) -> None:
    write_package(source / "base_msgs", {"msg/New.msg": "bool b\n"})

    result = run(source, generated)

    assert "proto/base_msgs/msg/New.proto" in result.changes.written


def test_another_request_replaces_the_output(source: Path, generated: Path) -> None:
    run(source, generated, ("base_msgs",))

    assert files_in(generated) == BASE_FILES | OWN_FILES


LOADED = """
import sys
from rosidl_adapter_proto.cli import main
try:
    main(["generate", "src", "--numbering", "sequential", "--events"])
finally:
    print(*(module.__file__ for module in list(sys.modules.values()) if getattr(module, "__file__", None)))
"""


def test_everything_that_generates_counts(source: Path, tmp_path: Path) -> None:
    """Whatever of the program was loaded to generate is part of the fingerprint."""
    command = [sys.executable, "-c", LOADED]
    process = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    package = Path(rosidl_adapter_proto.__file__).parent
    loaded = {Path(file) for file in process.stdout.split()}
    ours = {file for file in loaded if package in file.parents and file.suffix == ".py"}

    counted = fingerprint.program_files()

    assert {package / "interfaces/msg.py", package / "schema/proto.py"} < ours
    assert ours <= set(counted)
    assert set(templates_folder().rglob("*.jinja")) <= set(counted)


def test_another_file_of_the_program_is_noticed(
    source: Path, generated: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    manifest = (generated / MANIFEST_NAME).read_bytes()
    file = tmp_path / "changed.py"
    file.write_text("")
    monkeypatch.setattr(fingerprint, "program_files", lambda: [file])
    run(source, generated)
    with_empty_file = (generated / MANIFEST_NAME).read_bytes()
    file.write_text("CHANGED = True\n")

    run(source, generated)

    assert len({manifest, with_empty_file, (generated / MANIFEST_NAME).read_bytes()}) == 3


def test_another_version_of_the_program_is_noticed(
    source: Path, generated: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    manifest = (generated / MANIFEST_NAME).read_bytes()
    monkeypatch.setattr(fingerprint, "version", lambda name: "9.9")

    run(source, generated)

    assert (generated / MANIFEST_NAME).read_bytes() != manifest


def test_edited_output_is_made_again(source: Path, generated: Path) -> None:
    before = content(generated)
    (generated / "proto/my_msgs/msg/Place.proto").write_text("// mine\n")
    (generated / "python/rosidl_proto/my_msgs/msg/py.typed").unlink()

    result = run(source, generated)

    assert result.changes.written == (
        "proto/my_msgs/msg/Place.proto",
        "python/rosidl_proto/my_msgs/msg/py.typed",
    )
    assert content(generated) == before


def test_check_writes_nothing(source: Path, output: Path, tmp_path: Path) -> None:
    options = Options(numbering="sequential", lock_file=tmp_path / "lock")

    result = run(source, output, options=options, check=True)

    assert result.is_stale
    assert result.lock_changed
    assert set(result.changes.written) == BASE_FILES | MY_FILES | {"pyproject.toml"}
    assert not output.exists()
    assert not options.lock_file.exists()

    run(source, output, options=options)
    before = content(tmp_path), times(tmp_path)
    assert not run(source, output, options=options, check=True).is_stale
    assert (content(tmp_path), times(tmp_path)) == before

    (source / "my_msgs/srv/Move.srv").unlink()
    before = content(tmp_path), times(tmp_path)
    result = run(source, output, options=options, check=True)
    assert result.is_stale
    assert "proto/my_msgs/srv/Move.proto" in result.changes.removed
    assert (content(tmp_path), times(tmp_path)) == before


PACKAGES = ("base_msgs",)


class TestLockFile:
    """The lock file of sequential numbers."""

    @pytest.fixture
    def options(self, tmp_path: Path) -> Options:
        return Options(numbering="sequential", lock_file=tmp_path / "rosidl-proto.lock")

    def test_it_keeps_numbers(self, options: Options, source: Path, output: Path) -> None:
        assert run(source, output, PACKAGES, options=options).lock_changed
        lock = options.lock_file.read_text()
        assert json.loads(lock)["messages"]["base_msgs/msg/Point"] == {
            "fields": {"x": "1 double (float64)", "y": "2 double (float64)"},
            "removed": {},
        }
        assert not run(source, output, PACKAGES, options=options).lock_changed

        (source / "base_msgs/msg/Point.msg").write_text("bool new\nfloat64 y\n")
        result = run(source, output, PACKAGES, options=options)
        assert result.lock_changed
        proto = (output / "proto/base_msgs/msg/Point.proto").read_text()
        assert "bool new = 3;" in proto
        assert "double y = 2;" in proto
        assert "reserved 1;" in proto

    def test_it_is_what_counts(self, options: Options, source: Path, output: Path) -> None:
        """A lock file that somebody changed makes the output stale; it has to be told that numbers may change."""
        run(source, output, PACKAGES, options=options)
        options.lock_file.write_text(options.lock_file.read_text().replace("2 double", "7 double"))

        with pytest.raises(GenerateError, match=r"^base_msgs/msg/Point\.y has number 2 in "):
            run(source, output, PACKAGES, options=options)
        result = run(source, output, PACKAGES, options=options, renumber=True)

        assert not result.lock_changed
        assert "double y = 7;" in (output / "proto/base_msgs/msg/Point.proto").read_text()

    def test_a_lost_one_is_made_again(self, options: Options, source: Path, output: Path) -> None:
        run(source, output, PACKAGES, options=options)
        options.lock_file.unlink()

        assert run(source, output, PACKAGES, options=options, check=True).lock_changed
        assert run(source, output, PACKAGES, options=options).lock_changed
        assert options.lock_file.exists()

    def test_it_refuses_a_reused_number(self, options: Options, source: Path, output: Path) -> None:
        run(source, output, PACKAGES, options=options)
        before = content(output), options.lock_file.read_bytes()
        (source / "base_msgs/msg/Point.msg").write_text(POINT.replace("float64 y", "int32 y"))

        with pytest.raises(SchemaError, match=r"^base_msgs/msg/Point.y: .*rosidl-proto.lock has number 2"):
            run(source, output, PACKAGES, options=options)

        assert (content(output), options.lock_file.read_bytes()) == before

    @pytest.mark.parametrize("text", [b"", b"{}", b"\xff", b'{"version": 2}'])
    def test_a_damaged_one(self, text: bytes, options: Options, source: Path, output: Path) -> None:
        options.lock_file.write_bytes(text)

        with pytest.raises((SchemaError, GenerateError), match=r"rosidl-proto\.lock"):
            run(source, output, PACKAGES, options=options)

        assert options.lock_file.read_bytes() == text
        assert not output.exists()

    def test_it_has_its_folder_already(self, source: Path, output: Path, tmp_path: Path) -> None:
        options = Options(numbering="sequential", lock_file=tmp_path / "no" / "lock")

        with pytest.raises(GenerateError, match=r"^cannot write .*/no/lock: No such file or directory$"):
            run(source, output, PACKAGES, options=options)

        assert not output.exists()

    def test_numbers_that_were_written_are_always_in_it(
        self, options: Options, source: Path, output: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """It is written first: if it cannot be, the output stays; if the output fails, no number is lost."""
        run(source, output, PACKAGES, options=options)
        before = content(output)
        (source / "base_msgs/msg/Point.msg").write_text("bool new\n" + POINT)

        def refuse(*arguments: Any) -> None:
            raise OSError(errno.ENOSPC, "No space left on device")

        with monkeypatch.context() as patch:
            patch.setattr(lock_module, "replace_file", refuse)
            with pytest.raises(GenerateError, match=r"^cannot write .*lock: No space left on device$"):
                run(source, output, PACKAGES, options=options)
        assert content(output) == before

        with monkeypatch.context() as patch:
            patch.setattr(output_tree, "_move", refuse)
            with pytest.raises(
                GenerateError, match=r"^cannot write to .*/out: No space left on device; nothing"
            ):
                run(source, output, PACKAGES, options=options)
        assert content(output) == before
        assert '"new": "3 bool (bool)"' in options.lock_file.read_text()
        (source / "base_msgs/msg/Point.msg").write_text("int8 newer\nbool new\n" + POINT)
        run(source, output, PACKAGES, options=options)
        proto = (output / "proto/base_msgs/msg/Point.proto").read_text()
        assert "bool new = 3;" in proto
        assert "int32 newer = 4;" in proto

    def test_another_run_changed_it(
        self, options: Options, source: Path, output: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        compile_protos = protoc.compile_protos

        def compile_slowly(*arguments: Any) -> dict[str, bytes]:
            options.lock_file.write_text('{"version": 1, "messages": {}}')
            return compile_protos(*arguments)

        monkeypatch.setattr(protoc, "compile_protos", compile_slowly)

        with pytest.raises(GenerateError, match=r"^another run has changed .*lock; run this one again$"):
            run(source, output, PACKAGES, options=options)

        assert options.lock_file.read_text() == '{"version": 1, "messages": {}}'
        assert not output.exists()

    def test_it_is_not_written_for_an_output_that_is_refused(
        self, options: Options, source: Path, output: Path
    ) -> None:
        run(source, output, PACKAGES)
        (output / "proto/base_msgs/msg/New.proto").write_text("mine")
        write_package(source / "base_msgs", {"msg/New.msg": "bool b\n"})

        with pytest.raises(GenerateError, match=r"New\.proto was not made by rosidl-proto"):
            run(source, output, PACKAGES, options=options, renumber=True)

        assert not options.lock_file.exists()


def test_a_broken_definition_leaves_the_output(source: Path, generated: Path) -> None:
    before = content(generated)
    (source / "my_msgs/msg/Place.msg").write_text("int32 1bad\n")

    with pytest.raises(DefinitionError, match=r"Place\.msg:1:\d+: "):
        run(source, generated)

    assert content(generated) == before


@pytest.mark.parametrize("others", [0, 20])
def test_a_name_that_python_cannot_have(others: int, source: Path, generated: Path) -> None:
    """The error is the same where processes share the work."""
    before = content(generated)
    names = ("None", *(f"M{number}" for number in range(others)))
    write_package(source / "my_msgs", {f"msg/{name}.msg": "bool b\n" for name in names})

    with pytest.raises(SchemaError, match=r"^my_msgs/msg/None: 'None' is a keyword of Python; rename it$"):
        run(source, generated)

    assert content(generated) == before


def test_protoc_fails(source: Path, generated: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = content(generated)
    write_package(source / "my_msgs", {"msg/New.msg": "string name\n"})
    compile_protos = protoc.compile_protos
    monkeypatch.setattr(
        protoc,
        "compile_protos",
        lambda protos, wanted: compile_protos(
            {path: text.replace("string name = ", "string 1 = ") for path, text in protos.items()}, wanted
        ),
    )

    with pytest.raises(GenerateError, match=r"exit code 1:\nmy_msgs/msg/New\.proto:\d+:\d+: .*"):
        run(source, generated)

    assert content(generated) == before


def test_interrupted_while_generating(source: Path, generated: Path) -> None:
    before = content(generated)

    write_package(source / "my_msgs", {"msg/New.msg": "string name\n"})

    def interrupt(done: int, total: int) -> None:
        raise KeyboardInterrupt

    request, catalog = Request(("my_msgs",)), find(source)
    with pytest.raises(KeyboardInterrupt):
        generate(request, catalog, generated, progress=interrupt)

    assert content(generated) == before


def test_what_a_killed_run_left_is_cleaned_up(source: Path, generated: Path) -> None:
    before = content(generated)
    left_over = generated / output_tree.STAGING_NAME / "0"

    left_over.parent.mkdir()
    left_over.touch()
    assert not run(source, generated, check=True).is_stale
    assert left_over.exists()

    assert not run(source, generated).is_stale
    assert content(generated) == before


def test_two_runs_at_the_same_time(source: Path, output: Path) -> None:
    """Whichever is last, the output is wholly its own."""
    packages = (("my_msgs",), ("base_msgs",))
    threads = [threading.Thread(target=run, args=(source, output, each)) for each in packages]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()

    results = [run(source, output, each, check=True).is_stale for each in packages]
    assert sorted(results) == [False, True]


def test_progress(source: Path, output: Path) -> None:
    calls: list[tuple[int, int]] = []
    request, catalog = Request(("my_msgs",)), find(source)

    generate(request, catalog, output, progress=lambda done, total: calls.append((done, total)))
    assert calls == [(1, 4), (2, 4), (3, 4), (4, 4)]

    generate(request, catalog, output, progress=lambda done, total: calls.append((done, total)))
    assert len(calls) == 4


def test_two_sources_define_a_type_differently(source: Path, output: Path, tmp_path: Path) -> None:
    overlay = write_package(tmp_path / "overlay" / "base_msgs", {"msg/Point.msg": "float32 x\n"}).parent
    catalog = Catalog((folder_source(overlay), folder_source(source), STORE))

    for _ in range(2):  # the second time, nothing is to be done
        result = generate(Request(("my_msgs",)), catalog, output)

        assert result.warnings == (
            f"base_msgs/msg/Point is defined differently by {overlay}/base_msgs/msg/Point.msg and "
            f"{source}/base_msgs/msg/Point.msg; the first is used, since {overlay} comes before {source}",
        )
    assert "float x = " in (output / "proto/base_msgs/msg/Point.proto").read_text()


@pytest.mark.parametrize("seed", ["0", "1"])
def test_same_bytes_everywhere(seed: str, source: Path, generated: Path, tmp_path: Path) -> None:
    """Nothing of the place, the time, the locale or the order of sets gets into the output."""
    elsewhere = tmp_path / "else where" / "deep"
    (elsewhere / "cwd").mkdir(parents=True)
    moved = source.rename(elsewhere / "src")

    subprocess.run(
        [sys.executable, "-c", RUN, str(moved), "out", "my_msgs", "kilted"],
        cwd=elsewhere / "cwd",
        env={
            "PYTHONPATH": os.pathsep.join(sys.path),
            "PYTHONHASHSEED": seed,
            "LC_ALL": "C",
            "TZ": "Asia/Tokyo",
            "PYTHONCOERCECLOCALE": "0",
            "PYTHONUTF8": "0",
        },
        check=True,
        capture_output=True,
    )

    assert content(elsewhere / "cwd" / "out") == content(generated)


def test_warnings_of_definitions(source: Path, output: Path) -> None:
    file = source / "base_msgs" / "msg" / "Wide.msg"
    file.write_text("wstring<=5[] x\n")
    expected = (
        f"{file}:1:1: ROS 2 takes the bound of these wide strings for that of the sequence too, and so it is "
        "generated: at most 5 elements; give the sequence a bound of its own",
    )
    assert run(source, output).warnings == expected
    assert run(source, output).warnings == ()  # a run with nothing to do parses nothing


@pytest.mark.parametrize("length", [101, 400])
def test_messages_that_are_nested_too_deep(length: int, tmp_path: Path, output: Path) -> None:
    definitions = {f"msg/D{each}.msg": f"D{each + 1} x\n" for each in range(length - 1)}
    source = write_package(tmp_path / "deep_msgs", {**definitions, f"msg/D{length - 1}.msg": "int8 x\n"})
    outer, inner = f"D{length - 101}", f"D{length - 100}"
    with pytest.raises(SchemaError) as caught:
        run(source, output, ["deep_msgs"])
    assert str(caught.value) == (
        f"deep_msgs/msg/{outer}.x ({source}/msg/{outer}.msg:1:{len(inner) + 2}) nests messages more than 100 deep, "
        f"which protobuf does not read; flatten deep_msgs/msg/{inner} or what is in it"
    )
    assert not output.exists()


def test_control_characters_in_comments(tmp_path: Path, output: Path) -> None:
    text = "# a\0b\n\nint8 x # \0\x1b\x7f [\x01]\nint8 Y=1 # \0\n"
    source = write_package(tmp_path / "odd_msgs", {"msg/Odd.msg": text})
    run(source, output, ["odd_msgs"])
    texts = {path.suffix: path.read_text() for path in output.rglob("Odd*.p*") if path.name[-7:] != "_pb2.py"}
    assert texts.keys() == {".proto", ".pyi", ".py"}
    for each in texts.values():
        assert "a␀b" in each
        assert not set(each) & set(map(chr, (*range(9), *range(14, 32), 127)))
    assert "␀␛␡" in texts[".proto"]


def test_deep_and_wide_messages(tmp_path: Path, output: Path) -> None:
    """A chain as long as it may be, and messages that each have the next three times."""
    deep = {f"msg/D{each}.msg": f"D{each + 1} x\n" for each in range(99)}
    wide = {f"msg/W{each}.msg": f"W{each + 1} a\nW{each + 1}[2] b\n" for each in range(30)}
    last = {"msg/D99.msg": "int8 x 5\n", "msg/W30.msg": "int8 x\n"}
    source = write_package(tmp_path / "large_msgs", {**deep, **wide, **last})
    run(source, output, ["large_msgs"], options=Options(python_root="large_root"))
    program = """if True:
        import sys
        from large_root.large_msgs.msg import D0Adapter, W0, W0Adapter
        message = D0Adapter.new()
        for _ in range(99):
            message = message.x
        assert message.x == 5
        assert W0Adapter.new() == W0()
        sizes = [len(each.type_description()["referenced_type_descriptions"]) for each in (D0Adapter, W0Adapter)]
        assert sizes == [99, 30]
    """
    environment = {**os.environ, "PYTHONPATH": str(output / "python")}
    subprocess.run([sys.executable, "-c", program], env=environment, check=True)
