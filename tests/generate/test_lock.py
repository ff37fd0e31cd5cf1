"""Sequential numbers of an output folder: they stay, or it is said why they would not."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from rosidl_adapter_proto.errors import GenerateError, RequestError, SchemaError
from rosidl_adapter_proto.generate import Options, Request, Result, generate
from rosidl_adapter_proto.generate.configuration import read_configuration
from rosidl_adapter_proto.generate.lock import drop
from rosidl_adapter_proto.generate.manifest import MANIFEST_NAME, read_manifest
from rosidl_adapter_proto.hooks.project import generate_project
from rosidl_adapter_proto.interfaces.catalog import Catalog
from rosidl_adapter_proto.interfaces.find import folder_source
from tests.folders import content, write_package

LOCK_FILE = Path("rosidl-proto.lock")
OUT = Path("out")


def number(
    fields: str,
    lock_file: Path | str = LOCK_FILE,
    output: Path = OUT,
    *packages: str,
    deps: bool = True,
    check: bool = False,
    renumber: bool = False,
) -> Result:
    """Generate a package, whose message A has these fields, with sequential numbers; `more` refers to it."""
    definition = "".join(f"int32 {name}\n" for name in fields.split())
    source = Path("src")
    write_package(source / "my_msgs", {"msg/A.msg": definition})
    write_package(source / "more", {"msg/B.msg": "my_msgs/A a\nint32 b\n"})
    options = Options(numbering="sequential", lock_file=Path(lock_file))
    request = Request(packages or ("my_msgs",), dependencies=deps)
    return generate(
        request, Catalog((folder_source(source),)), output, options, check=check, renumber=renumber
    )


def by_hash(output: Path = OUT, *, renumber: bool = False) -> Result:
    return generate(Request(("my_msgs",)), Catalog((folder_source(Path("src")),)), output, renumber=renumber)


def numbers(output: Path = OUT) -> dict[str, dict[str, int]]:
    manifest = read_manifest(output)
    assert manifest is not None
    assert manifest.numbers is not None
    return {message: dict(fields) for message, fields in manifest.numbers.fields.items()}


pytestmark = pytest.mark.usefixtures("folder")

ON_PURPOSE = (
    "or, if nothing is left that was serialized with the old numbers, give --renumber, or remove {} and generate "
    "it again"
)


def refusal(name: str, was: int, now: str, remedy: str, output: Path = OUT) -> str:
    return (
        f"{name} has number {was} in {output}/{MANIFEST_NAME}, but {now} for it; {remedy}; "
        + ON_PURPOSE.format(output)
    )


def lose() -> None:
    LOCK_FILE.unlink()


def drop_message() -> None:
    drop(Options(numbering="sequential"), ["my_msgs/msg/A"])


RESTORE = "restore rosidl-proto.lock from version control"
NONE_THERE = "there is no rosidl-proto.lock, and a new one has"


@pytest.mark.parametrize(
    ("before", "change", "after", "message"),
    [
        (["a b"], lose, "b a", refusal("my_msgs/msg/A.a", 1, f"{NONE_THERE} 2", RESTORE)),
        (["a b c"], lose, "a c", refusal("my_msgs/msg/A.b", 2, f"{NONE_THERE} none", RESTORE)),
        # What was removed stays reserved, or else a new field would take its number one day.
        (["a b", "a"], lose, "a", refusal("my_msgs/msg/A.b", 2, f"{NONE_THERE} none", RESTORE)),
        (
            ["a b c"],
            drop_message,
            "c a b",
            refusal("my_msgs/msg/A.a", 1, "rosidl-proto.lock has 2", RESTORE),
        ),
    ],
)
@pytest.mark.parametrize("check", [True, False])
def test_numbers_are_not_given_anew(
    before: list[str], change: Callable[[], None], after: str, message: str, check: bool
) -> None:
    for fields in before:
        number(fields)
    change()
    made = content(OUT)
    lock = LOCK_FILE.read_bytes() if LOCK_FILE.exists() else None

    for _ in range(2):  # what is refused leaves no lock file that would let it pass the next time
        with pytest.raises(GenerateError) as caught:
            number(after, check=check)

        assert str(caught.value) == message
        assert content(OUT) == made
        assert (LOCK_FILE.read_bytes() if LOCK_FILE.exists() else None) == lock

    number(after, renumber=True)
    assert not number(after).is_stale
    assert set(numbers()["my_msgs/msg/A"]) == set(after.split())


def test_a_lost_lock_file_that_is_made_the_same() -> None:
    number("a b")
    lock = LOCK_FILE.read_bytes()
    LOCK_FILE.unlink()

    assert number("a b").warnings == (
        "rosidl-proto.lock is new: it keeps the numbers of fields, so commit it",
    )
    assert LOCK_FILE.read_bytes() == lock
    assert number("a b").warnings == ()


def test_run_in_another_folder(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The lock file is looked for there, and the output folder knows the one that it was generated with."""
    number("a b")
    (folder / "elsewhere").mkdir()
    (folder / "elsewhere/src").symlink_to("../src")
    monkeypatch.chdir(folder / "elsewhere")

    with pytest.raises(GenerateError) as caught:
        number("b a", output=Path("../out"))

    assert str(caught.value) == refusal(
        "my_msgs/msg/A.a",
        1,
        f"{NONE_THERE} 2",
        "give the lock file that ../out was generated with: --lock-file ../rosidl-proto.lock",
        Path("../out"),
    )
    assert not LOCK_FILE.exists()
    number("b a", "../rosidl-proto.lock", Path("../out"))
    assert numbers(Path("../out")) == {"my_msgs/msg/A": {"b": 2, "a": 1}}


def test_the_lock_file_of_another_branch() -> None:
    """Both added a field, and each gave it the next number; only one of them can be right after a merge."""
    number("a mine")
    number("a theirs", "theirs.lock", Path("theirs"))
    LOCK_FILE.write_bytes(Path("theirs.lock").read_bytes())

    with pytest.raises(GenerateError) as caught:
        number("a theirs mine")

    assert str(caught.value) == refusal("my_msgs/msg/A.mine", 2, "rosidl-proto.lock has 3", RESTORE)
    number("a theirs mine", renumber=True)
    assert numbers() == {"my_msgs/msg/A": {"a": 1, "theirs": 2, "mine": 3}}


def test_an_output_folder_that_was_moved(folder: Path) -> None:
    number("a b")
    (folder / "deep/down").mkdir(parents=True)
    moved = OUT.rename("deep/down/out")

    assert not number("a b", output=moved).is_stale
    LOCK_FILE.unlink()
    with pytest.raises(GenerateError, match=f"; {RESTORE}; or, "):
        number("b a", output=moved)


def test_several_output_folders_with_one_lock_file() -> None:
    number("a b")
    number("b x a", output=Path("other"))
    number("b a")

    assert numbers() == {"my_msgs/msg/A": {"b": 2, "a": 1, "x": 3}}


def test_without_dependencies() -> None:
    """Only what is generated is numbered and remembered; what it refers to is numbered elsewhere."""
    number("a b", LOCK_FILE, OUT, "more", deps=False)

    assert numbers() == {"more/msg/B": {"a": 1, "b": 2}}
    number("b a", LOCK_FILE, OUT, "more")
    assert numbers() == {"more/msg/B": {"a": 1, "b": 2}, "my_msgs/msg/A": {"b": 1, "a": 2}}


def test_what_the_folder_had_before_stays_known() -> None:
    number("a b")
    number("a b", LOCK_FILE, OUT, "more", deps=False)
    LOCK_FILE.unlink()
    number("a b", LOCK_FILE, OUT, "more", deps=False)

    with pytest.raises(GenerateError, match=r"^my_msgs/msg/A\.a has number 1 in out/"):
        number("b a")


def test_a_name_that_was_dropped() -> None:
    number("a b c")
    assert drop(Options(numbering="sequential"), ["my_msgs/msg/A.b"]) == {"my_msgs/msg/A.b": 2}

    with pytest.raises(GenerateError, match=r"^my_msgs/msg/A\.b has number 2 in .* has none for it; "):
        number("a c")
    number("a c", renumber=True)
    number("a c b")

    assert numbers() == {"my_msgs/msg/A": {"a": 1, "c": 3, "b": 4}}


def test_hash_and_sequential_numbers() -> None:
    def message(was: str, now: str) -> str:
        return (
            f"out was generated with numbering '{was}' (out/{MANIFEST_NAME}), and is to have '{now}', which gives "
            "every field another number; choose another folder with --output, " + ON_PURPOSE.format(OUT)
        )

    number("a", output=Path("other"))
    LOCK_FILE.unlink()
    by_hash()
    with pytest.raises(GenerateError) as caught:
        number("a")
    assert str(caught.value) == message("hash", "sequential")
    assert not LOCK_FILE.exists()

    number("a", renumber=True)
    with pytest.raises(GenerateError) as caught:
        by_hash()
    assert str(caught.value) == message("sequential", "hash")

    by_hash(renumber=True)
    assert not by_hash().is_stale


def test_a_run_that_was_killed_remembers_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is written while files are moved knows them, too."""
    replaced: list[str] = []
    replace = Path.replace

    def record(path: Path, target: Path) -> Path:
        if Path(target).name == MANIFEST_NAME:
            replaced.append(path.read_text())
        return replace(path, target)

    monkeypatch.setattr(Path, "replace", record)
    number("a b")

    between, last = map(json.loads, replaced)
    assert between["fingerprint"] == ""
    assert (
        between["numbers"]
        == last["numbers"]
        == {
            "lock_file": "../rosidl-proto.lock",
            "fields": {"my_msgs/msg/A": {"a": 1, "b": 2}},
        }
    )


def build(numbering: str = "sequential") -> None:
    Path("pyproject.toml").write_text(
        f'[tool.rosidl-proto]\npackages = ["./src/my_msgs"]\nnumbering = "{numbering}"\n'
    )
    configuration = read_configuration(Path())
    assert configuration is not None
    generate_project(configuration, Path("build"))


def test_builds_follow_the_lock_file(capsys: pytest.CaptureFixture[str]) -> None:
    """A build's folder outlives a change of branches. Where there is no lock file, it still knows better."""
    write_package(Path("src/my_msgs"), {"msg/A.msg": "int32 a\nint32 b\n"})
    build()
    assert capsys.readouterr().err == (
        "Warning: rosidl-proto.lock is new: it keeps the numbers of fields, so commit it\n"
    )
    text = LOCK_FILE.read_text()
    LOCK_FILE.write_text(text.replace("2 sfixed32", "3 sfixed32"))
    build()
    assert numbers(Path("build")) == {"my_msgs/msg/A": {"a": 1, "b": 3}}

    LOCK_FILE.unlink()
    with pytest.raises(GenerateError, match=r"^my_msgs/msg/A\.b has number 3 in build/"):
        build()
    with pytest.raises(GenerateError, match=r"^build was generated with numbering 'sequential' "):
        build("hash")


@pytest.mark.parametrize(
    ("lock", "names", "error", "message"),
    [
        (
            None,
            ["my_msgs/msg/A.a"],
            RequestError,
            "there is no rosidl-proto.lock; name the lock file with --lock-file",
        ),
        (
            '{"version": 2, "messages": {}}',
            ["my_msgs/msg/A.a"],
            SchemaError,
            "rosidl-proto.lock has no message 'my_msgs/msg/A'",
        ),
    ],
)
def test_dropping_what_is_not_there(
    lock: str | None, names: list[str], error: type[Exception], message: str
) -> None:
    if lock:
        LOCK_FILE.write_text(lock)

    with pytest.raises(error) as caught:
        drop(Options(numbering="sequential"), names)

    assert str(caught.value) == message
    assert LOCK_FILE.exists() == bool(lock)
