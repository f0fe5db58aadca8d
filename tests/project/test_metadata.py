"""What others read of the project beside pyproject.toml: how to cite it, and its environment for conda."""

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CONDA_NAMES = {"prometheus-client": "prometheus_client"}  # where conda-forge writes them another way


def read(name: str) -> dict[str, Any]:
    yaml = pytest.importorskip("yaml", reason="the package PyYAML is not installed")
    found = yaml.safe_load((ROOT / name).read_text(encoding="utf-8"))
    assert isinstance(found, dict)
    return found


def test_the_citation_is_of_this_version() -> None:
    found = read("CITATION.cff")
    assert found["cff-version"] == "1.2.0"
    assert found["type"] == "software"
    assert found["title"].startswith(PROJECT["name"])
    assert found["version"] == PROJECT["version"]
    assert found["license"] == PROJECT["license"]
    copyright_line = (ROOT / "LICENSE").read_text(encoding="utf-8").splitlines()[2]
    assert found["authors"] == [{"name": re.sub(r"^Copyright \(c\) \d+ ", "", copyright_line)}]
    physics = (ROOT / "docs" / "physics.md").read_text(encoding="utf-8")
    assert all(each["doi"] in physics for each in found["references"])


def test_the_conda_environment_holds_what_the_package_needs() -> None:
    found = read("environment.yml")
    assert found["name"] == PROJECT["name"]
    assert found["channels"] == ["conda-forge"]
    plain = [each for each in found["dependencies"] if isinstance(each, str)]
    wanted = []
    for each in PROJECT["dependencies"]:
        name = re.match(r"[A-Za-z0-9-]+", each)
        assert name is not None
        wanted.append(CONDA_NAMES.get(name[0], name[0]) + each[name.end() :].partition(";")[0])
    assert plain == [f"python{PROJECT['requires-python']}", "pip", *wanted]
    # The package itself, and nothing beside what conda installed.
    assert found["dependencies"][-1] == {"pip": ["--no-deps", "-e ."]}
