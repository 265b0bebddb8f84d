"""Files around the code that no command reads: one version everywhere, and recipes that name what is there."""

import re
import tomllib
from importlib.util import find_spec

import pytest

from coupler.program.provenance import ROOT

yaml = pytest.importorskip("yaml")


def text(name):
    return (ROOT / name).read_text(encoding="utf-8")


def test_the_version_is_one():
    version = tomllib.loads(text("pyproject.toml"))["project"]["version"]
    assert yaml.safe_load(text("CITATION.cff"))["version"] == version
    newest = re.search(r"^## (\S+)", text("CHANGELOG.md"), re.MULTILINE)[1]
    assert newest in (version, "Unreleased")


@pytest.mark.parametrize("path", [*sorted(ROOT.glob(".github/**/*.yml")), ROOT / ".pre-commit-config.yaml"])
def test_workflow_templates_and_hooks_are_valid_yaml(path):
    found = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert found
    if "ISSUE_TEMPLATE" in str(path) and path.stem != "config":
        fields = [part["id"] for part in found["body"]]
        assert len(set(fields)) == len(fields)
        assert all(part["attributes"]["label"] for part in found["body"])


def test_the_workflow_runs_the_projects_own_checks():
    steps = yaml.safe_load(text(".github/workflows/checks.yml"))["jobs"]["checks"]["steps"]
    runs = [step.get("run", "") for step in steps]
    assert ".ci/run" in runs
    assert (ROOT / ".ci/run").exists()


@pytest.mark.parametrize("recipe", ["Dockerfile", "surgebreak.def"])
def test_a_container_recipe_installs_what_the_launcher_would_and_calls_what_is_there(recipe):
    """Debian of the launcher's YADE, its packages, modules that exist, and no pull of the checkout's own .venv."""
    body = text(recipe)
    assert "debian:bookworm" in body
    assert re.search(r"apt-get install .*\byade\b.*\bpython3-venv\b", body)
    for module in re.findall(r"python -m ([\w.]+)", body):
        assert find_spec(module), module
    assert "./surgebreak doctor" in body
    assert ".venv" in text(".dockerignore").splitlines() or recipe != "Dockerfile"
