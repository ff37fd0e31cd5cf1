"""How long generating takes: everything of a ROS installation, a run that has nothing to do, and large packages.

    python benchmarks/generate.py

It generates what the ROS installation of this Python has, or else the embedded store. Each run is a new process, as
`rosidl-proto generate` is one. The reference, rosidl_typesupport_protobuf, needs 6.5 s for the .proto files of 126
interfaces alone, without compiling them.

Then it generates definitions that it makes up, always the same ones: a package as large as PX4's, and messages with
thousands of members, with formatting and without. It says how often the layout was not enough and black had to format
a module.
"""

from __future__ import annotations

import itertools
import random
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from rosidl_adapter_proto.interfaces.find import prefix_sources, store_source

REFERENCE_SECONDS, REFERENCE_INTERFACES = 6.5, 126
RUNS = 3
RUNS_WITH_NOTHING_TO_DO = 5

COMMAND = (sys.executable, "-m", "rosidl_adapter_proto")

# Every line fits, and then the layout leaves all as it is.
WITHOUT_FORMATTING_PROGRAM = """
from rosidl_adapter_proto.cli import main
from rosidl_adapter_proto.generate.targets.python import layout
layout.LINE_LENGTH = 1 << 60
main()
"""

WITHOUT_FORMATTING = (sys.executable, "-c", WITHOUT_FORMATTING_PROGRAM)

# A line in a file for each module that black formats.
COUNTING = """
import sys
from rosidl_adapter_proto.cli import main
from rosidl_adapter_proto.generate.targets import python
format_python, counted = python.format_python, sys.argv.pop()
def format_and_count(text, *, stub=False):
    with open(counted, "a") as file:
        print(file=file)
    return format_python(text, stub=stub)
python.format_python = format_and_count
main()
"""


def generate(command: Sequence[str], packages: Sequence[str], folder: Path, *more: str) -> tuple[float, int]:
    """Return how long it takes to generate packages, in seconds, and how many interfaces they have."""
    command = [*command, "generate", *packages, "--output", str(folder), *more]
    start = time.perf_counter()
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    seconds = time.perf_counter() - start
    match = re.search(r": (\d+) interfaces?, ", said)
    assert match is not None, said
    return seconds, int(match[1])


def processor_time(command: Sequence[str], packages: Sequence[str]) -> float:
    """Return the processor time that generating packages takes at least, in seconds, each time into a new folder."""
    times = [_processor_time_of_children()]
    with tempfile.TemporaryDirectory() as folder:
        for run in range(RUNS):
            generate(command, packages, Path(folder, str(run)))
            times.append(_processor_time_of_children())
    return min(after - before for before, after in itertools.pairwise(times))


def _processor_time_of_children() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def cost_of_formatting(packages: Sequence[str]) -> str:
    """Return how many times the processor time of a run without formatting a run takes."""
    return f"{processor_time(COMMAND, packages) / processor_time(WITHOUT_FORMATTING, packages):.2f}"


def left_to_black(package: Path) -> int:
    """Return how many modules of a package black has to format."""
    with tempfile.TemporaryDirectory() as folder:
        counted = Path(folder, "counted")
        counted.touch()
        generate((sys.executable, "-c", COUNTING), [str(package)], Path(folder, "out"), str(counted))
        return len(counted.read_text().splitlines())


def write_package(folder: Path, messages: dict[str, str]) -> Path:
    """Write a package with messages, and return its folder."""
    (folder / "msg").mkdir(parents=True)
    (folder / "package.xml").write_text(f"<package><name>{folder.name}</name></package>\n")
    for name, text in messages.items():
        (folder / "msg" / f"{name}.msg").write_text(text)
    return folder


TYPES = (
    "bool",
    "uint8",
    "int16",
    "uint32",
    "uint64",
    "float32",
    "float64[3]",
    "float32[]",
    "string",
    "uint8[20]",
)
WORDS = (
    "estimator",
    "innovation",
    "velocity",
    "timestamp",
    "status",
    "is",
    "a",
    "setpoint",
    "covariance",
    "valid",
)


def message(choose: random.Random, fields: int, constants: int) -> str:
    """Return a made-up definition, in which fields and constants have comments."""
    lines = []
    for number in range(constants):
        name = "_".join(choose.choices(WORDS, k=3)).upper()
        lines.append(f"uint32 {name}_{number} = {number}  # {' '.join(choose.choices(WORDS, k=8))}")
    for number in range(fields):
        name = "_".join(choose.choices(WORDS, k=choose.randint(1, 4)))
        lines.append(f"{choose.choice(TYPES)} {name}_{number}  # {' '.join(choose.choices(WORDS, k=8))}")
    return "\n".join(lines) + "\n"


def large_packages(folder: Path) -> dict[str, Path]:
    """Write packages that are hard to format, and return them with what they are."""
    choose = random.Random(1)
    like_px4 = {
        f"Message{number}": message(choose, choose.randint(5, 40), choose.choice((0, 0, 0, 5, 20, 300)))
        for number in range(262)
    }
    packages = {"262 messages": write_package(folder / "like_px4_msgs", like_px4)}
    for members in (5_000, 10_000):
        large = {"Large": message(choose, members // 2, members // 2)}
        packages[f"{members} members"] = write_package(folder / f"large_{members}_msgs", large)
    return packages


def whole_installation() -> list[tuple[str, str]]:
    """Measure everything that is installed, and a run with nothing to do."""
    sources = prefix_sources() or [store_source()]
    packages = sorted({name for source in sources for name in source.packages})
    print(f"{len(packages)} packages of {', '.join(source.origin for source in sources)}")
    with tempfile.TemporaryDirectory() as folder:
        full, interfaces = generate(COMMAND, packages, Path(folder, "generated"))
        nothing = min(
            generate(COMMAND, packages, Path(folder, "generated"))[0] for _ in range(RUNS_WITH_NOTHING_TO_DO)
        )
    per_reference = full / interfaces * REFERENCE_INTERFACES
    return [
        (f"full run, {interfaces} interfaces", f"{full:.2f} s"),
        (f"for {REFERENCE_INTERFACES} interfaces", f"{per_reference:.2f} s"),
        ("times as fast as the reference, at least 10", f"{REFERENCE_SECONDS / per_reference:.1f}"),
        ("times the processor time without formatting, at most 1.5", cost_of_formatting(packages)),
        ("run with nothing to do", f"{nothing:.2f} s"),
        ("times as fast as a full run, at least 10", f"{full / nothing:.1f}"),
    ]


def made_up_packages() -> list[tuple[str, str]]:
    """Measure what formatting costs where there is much to format."""
    rows, seconds = [], []
    with tempfile.TemporaryDirectory() as folder:
        for what, package in large_packages(Path(folder)).items():
            seconds.append(processor_time(COMMAND, [str(package)]))
            rows += [
                (f"{what}, processor time", f"{seconds[-1]:.2f} s"),
                ("times that without formatting, at most 1.5", cost_of_formatting([str(package)])),
                ("modules left to black", str(left_to_black(package))),
            ]
    return [*rows, ("times that of half the members, at most 2", f"{seconds[-1] / seconds[-2]:.2f}")]


def main() -> None:
    """Measure, and print the ratios."""
    for label, value in (*whole_installation(), *made_up_packages()):
        print(f"{label:57} {value:>8}")


if __name__ == "__main__":
    main()
