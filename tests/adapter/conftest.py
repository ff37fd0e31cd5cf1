"""What is tested of adapters, for generated ones and for those that are made at run time."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from tests.run_time import made_at_run_time


@pytest.fixture(params=["generated", "made at run time"])
def things(generated_things: SimpleNamespace, request: pytest.FixtureRequest) -> SimpleNamespace:
    """The package `things`, with adapters of either kind."""
    return generated_things if request.param == "generated" else made_at_run_time(generated_things)
