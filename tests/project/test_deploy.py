"""What stands in deploy/ and docs/operations.md fits the program."""

import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from service.settings.settings import Settings, load_settings

ROOT = Path(__file__).resolve().parent.parent.parent
DEPLOY = ROOT / "deploy"
UNIT = (DEPLOY / "stickslip.service").read_text(encoding="utf-8")
DOCKERFILE = (DEPLOY / "Dockerfile").read_text(encoding="utf-8")
OPERATIONS = ROOT / "docs" / "operations.md"
VARIABLE = re.compile(r"STICKSLIP_[A-Z_]+")
OF_KERNELS = {"STICKSLIP_KERNELS", "STICKSLIP_WHEEL_KERNELS"}
"""Read before there are settings: how kernels run, and whether a wheel has them."""


@pytest.mark.parametrize("path", [*sorted(DEPLOY.iterdir()), OPERATIONS], ids=lambda path: path.name)
def test_every_variable_is_a_setting(path: Path) -> None:
    known = {f"STICKSLIP_{name.upper()}" for name in Settings.model_fields} | OF_KERNELS
    assert set(VARIABLE.findall(path.read_text(encoding="utf-8"))) <= known


def test_the_example_of_an_environment_is_accepted(monkeypatch: pytest.MonkeyPatch) -> None:
    text = (DEPLOY / "stickslip.env.example").read_text(encoding="utf-8")
    for line in text.splitlines():
        name, _, value = line.removeprefix("# ").partition("=")
        if VARIABLE.fullmatch(name):
            monkeypatch.setenv(name, value)
    assert load_settings().retention_days == 90.0
    assert load_settings().database.startswith("postgresql+psycopg://")


def test_the_unit_is_one_that_systemd_takes(tmp_path: Path) -> None:
    assert "ExecStart=/opt/stickslip/bin/stickslip serve" in UNIT
    assert "MemoryDenyWriteExecute=" not in UNIT, "the kernels are compiled in the process"
    program = shutil.which("systemd-analyze")
    if program is None:
        pytest.skip("systemd-analyze is not installed")
    unit = tmp_path / "stickslip.service"
    unit.write_text(UNIT.replace("/opt/stickslip/bin/stickslip", "/bin/true"), encoding="utf-8")
    checked = subprocess.run(
        [program, "verify", "--man=no", unit], capture_output=True, text=True, check=False
    )
    assert (checked.returncode, checked.stderr) == (0, "")
    exposed = [program, "security", "--offline=true", "--threshold=20", unit]
    rated = subprocess.run(exposed, capture_output=True, text=True, check=False)
    assert rated.returncode == 0, rated.stdout[-300:]


def test_every_key_of_the_unit_is_in_its_section() -> None:
    """Without systemd at hand: sections, one assignment a line, no key twice but the lists."""
    section, seen = "", set()
    for line in UNIT.splitlines():
        if line.startswith("["):
            section = line
        elif line and not line.startswith("#"):
            key, sign, _ = line.partition("=")
            assert sign, line
            assert key in ("Environment", "SystemCallFilter") or (section, key) not in seen, line
            seen.add((section, key))
    assert {section for section, _ in seen} == {"[Unit]", "[Service]", "[Install]"}


def instructions() -> list[list[str]]:
    """The instructions of the Dockerfile, each in words."""
    joined = re.sub(r"\\\n", " ", re.sub(r"(?m)^#.*\n", "", DOCKERFILE))
    return [shlex.split(line) for line in joined.splitlines() if line.strip()]


def test_what_the_image_is_made_of_is_there() -> None:
    found = instructions()
    copied = [
        word for words in found if words[0] == "COPY" and "--from=build" not in words for word in words[1:-1]
    ]
    assert {
        "stickslip",
        "solver",
        "optim",
        "service",
        "migrations",
        "pyproject.toml",
        "requirements",
    } <= set(copied)
    assert [name for name in copied if not (ROOT / name).exists()] == []
    allowed = (DEPLOY / "Dockerfile.dockerignore").read_text(encoding="utf-8").splitlines()
    assert {f"!{name}" for name in copied} == {line for line in allowed if line.startswith("!")}
    for part in ("kernels", "package", "image"):
        assert f"-r requirements/{part}.txt" in DOCKERFILE
    assert "pip install --require-hashes" in DOCKERFILE
    assert re.search(r"\nARG PYTHON=\S+@sha256:[0-9a-f]{64}\n", DOCKERFILE)
    assert (ROOT / "service" / "warm_up.py").exists()


def test_the_image_runs_as_nobody_in_particular_and_is_looked_after() -> None:
    from service.http.app import create_app

    last = instructions()
    stage = last[max(index for index, words in enumerate(last) if words[0] == "FROM") :]
    users = [words[1] for words in stage if words[0] == "USER"]
    assert users == ["stickslip"]
    assert stage[-1][0] == "CMD"
    assert "stickslip" in stage[-1][1]
    health = re.search(r"127\.0\.0\.1:8000(/[a-z/]+)", DOCKERFILE)
    assert health is not None
    assert health[1] in create_app().openapi()["paths"]
    images = [words[1] for words in last if words[0] == "FROM"]
    assert images == ["${PYTHON}", "${PYTHON}"]


def test_the_composition_builds_from_the_same_file() -> None:
    text = (DEPLOY / "compose.yaml").read_text(encoding="utf-8")
    assert "dockerfile: deploy/Dockerfile" in text
    assert not re.search(r"(?i)password: *[a-z0-9]", text), "no password in the repository"
    assert "127.0.0.1:8000:8000" in text, "not open to the network by itself"
