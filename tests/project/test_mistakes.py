"""Mistakes of the kinds that people make: the message names the field, the value and what would be right."""

import asyncio
import subprocess
import sys
from pathlib import Path

import httpx
import pytest
from mistakes import MISTAKES, Mistake, body_of

import stickslip
from service.cli import main
from tests.golden.refused import application

LEAST = 105 / 114
"""The share of them that is answered in full; none ends in a traceback."""


def _by_command(one: Mistake, folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    for name, data in one.files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(data)
    status = main(list(one.words))
    out, err = capsys.readouterr()
    return " ".join(err.split()) if status == 2 else f"status {status}, not 2: {out}{err}"


def _by_python(one: Mistake) -> str:
    try:
        eval(one.python, {"stickslip": stickslip})
    except (stickslip.errors.SolverError, TypeError) as error:
        return str(error)
    except AttributeError:  # Python itself says what was meant, where it ends with it
        code = f"import stickslip; {one.python}"
        return subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True
        ).stderr.splitlines()[-1]
    return "nothing was refused"


def _by_rest(one: Mistake, folder: Path) -> str:
    app = application(folder)

    async def asked() -> httpx.Response:
        transport = httpx.ASGITransport(app=app)
        method, path, body = one.rest or ("", "", None)
        content = None if body is None else body_of(body)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            return await client.request(
                method, path, content=content, headers={"Content-Type": "application/json"}
            )

    try:
        answer = asyncio.run(asked())
    finally:
        app.state.service.database.close()
    found = answer.json()
    listed = [f"{each.get('pointer', '')} {each['detail']}" for each in found.get("errors", [])]
    return "; ".join([str(found.get("detail", "")), *listed])


def test_mistakes_are_answered(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    short, broken = [], []
    for number, one in enumerate(MISTAKES):
        folder = tmp_path / str(number)
        folder.mkdir()
        monkeypatch.chdir(folder)
        try:
            if one.python:
                said = _by_python(one)
            else:
                said = _by_command(one, folder, capsys) if one.words else _by_rest(one, folder)
        except Exception as error:  # noqa: BLE001 what was not meant is told with its case
            said = f"Traceback: {error!r}"
        if "Traceback" in said:
            broken.append(f"{one.what}: {said}")
        missing = [part for part in (one.named, one.given, one.remedy) if part not in said]
        if missing:
            short.append(f"{one.what}\n   lacks {missing}\n   {said[:600]}")
    found = "\n".join([f"{len(short)} of {len(MISTAKES)} short", *short])
    assert not broken, "\n".join([*broken, found])
    assert len(MISTAKES) - len(short) >= LEAST * len(MISTAKES), found
