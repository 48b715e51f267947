"""Policies for tests of drivers and switchers."""

import pytest

from driving import GAITS, exported
from gaitshift.gait import gaits


@pytest.fixture(scope="session")
def policies(tmp_path_factory):
    """Policies of three gaits, each of which looks at everything it is shown."""
    folder = tmp_path_factory.mktemp("policies")
    return {gait: exported(folder, gaits.load(gait), seed=i) for i, gait in enumerate(GAITS)}
