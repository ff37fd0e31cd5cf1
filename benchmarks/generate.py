"""How long generating takes: everything of a ROS installation, and a run that has nothing to do.

    python benchmarks/generate.py

It generates what the ROS installation of this Python has, or else the embedded store. Each run is a new process, as
`rosidl-proto generate` is one. The reference, rosidl_typesupport_protobuf, needs 6.5 s for the .proto files of 126
interfaces alone, without compiling them.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from rosidl_adapter_proto.interfaces.find import prefix_sources, store_source

REFERENCE_SECONDS, REFERENCE_INTERFACES = 6.5, 126
RUNS_WITH_NOTHING_TO_DO = 5


def generate(packages: list[str], folder: Path) -> tuple[float, int]:
    """Return how long it takes to generate packages, in seconds, and how many interfaces they have."""
    command = [sys.executable, "-m", "rosidl_adapter_proto", "generate", *packages, "--output", str(folder)]
    start = time.perf_counter()
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    seconds = time.perf_counter() - start
    match = re.search(r": (\d+) interfaces?, ", said)
    assert match is not None, said
    return seconds, int(match[1])


def main() -> None:
    """Measure, and print the ratios."""
    sources = prefix_sources() or [store_source()]
    packages = sorted({name for source in sources for name in source.packages})
    print(f"{len(packages)} packages of {', '.join(source.origin for source in sources)}")
    with tempfile.TemporaryDirectory() as folder:
        full, interfaces = generate(packages, Path(folder, "generated"))
        nothing = min(
            generate(packages, Path(folder, "generated"))[0] for _ in range(RUNS_WITH_NOTHING_TO_DO)
        )
    per_reference = full / interfaces * REFERENCE_INTERFACES
    rows = [
        (f"full run, {interfaces} interfaces", f"{full:.2f} s"),
        (f"for {REFERENCE_INTERFACES} interfaces", f"{per_reference:.2f} s"),
        ("times as fast as the reference, at least 1", f"{REFERENCE_SECONDS / per_reference:.1f}"),
        ("run with nothing to do", f"{nothing:.2f} s"),
        ("times as fast as a full run, at least 10", f"{full / nothing:.1f}"),
    ]
    for label, value in rows:
        print(f"{label:45} {value:>8}")


if __name__ == "__main__":
    main()
