"""A run that all tests of training look at."""

import pytest

from training import create


@pytest.fixture(scope="package")
def whole(tmp_path_factory):
    """A run that was never broken off, and the rows that it reported."""
    run = create(tmp_path_factory.mktemp("training") / "whole")
    reported = []
    run.train(reported.append)
    return run, reported
