"""`stickslip check-proof`: check the proof of a periodic response."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from service.cli.failures import end
from service.cli.options import shared as options
from service.errors import InputError
from service.rendering.text import print_json, print_table
from solver.errors import MissingExtraError


def check_proof(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="A certificate, or an answer that has one (.json).")
    ],
    as_json: options.Json = False,
) -> None:
    """Check the proof of a response, in a file that `solve --certify --json` wrote.

    By solver/certificate/checker.py, which needs python-flint and nothing of this package.
    """
    try:
        from solver.certificate import checker
    except ImportError as error:
        raise MissingExtraError("python-flint", "proof") from error
    try:
        raw = json.loads(file.read_text(encoding="utf-8"))
        while isinstance(raw.get("certificate"), dict):
            raw = raw["certificate"]
        claims = {name: [float(end) for end in span] for name, span in raw["claims"].items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"`FILE`: {str(file)!r} must be a certificate in JSON, got {error!r}") from error
    reason = ""
    try:
        checker.check(raw)
    except checker.RejectedError as error:
        reason = str(error)
    if as_json:
        print_json({"accepted": not reason, "reason": reason, "claims": claims})
    else:
        units = {"frequency_hz": " Hz", "load_factor": ""}
        rows = [(name, f"{low!r} to {high!r}{units.get(name, ' m')}") for name, (low, high) in claims.items()]
        print_table(
            f"Certificate of {raw.get('scene', 'a system')}", ("claim", "proved"), rows if not reason else []
        )
    end(not reason, f"The certificate is rejected: {reason}.")
