"""A finished dry run and copies of it, for the tests of resume and of checkpoints."""

import shutil

import pytest

from coupler.run.checkpoint import FOLDER, listed
from tests.coupler.resumed import DRY, begin


@pytest.fixture(scope="session")
def dry(tmp_path_factory):
    """A finished run with checkpoints at its end and at 80 ms."""
    place = tmp_path_factory.mktemp("dry")
    return begin(place / "case", DRY, place / "run")


@pytest.fixture
def copy(dry, tmp_path):
    return shutil.copytree(dry, tmp_path / "run")


@pytest.fixture
def stopped(copy):
    """As if it had been killed shortly before its end: the files go further than the checkpoint."""
    listed(copy / FOLDER)[0].unlink()
    return copy
