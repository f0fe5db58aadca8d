"""`stickslip check-proof`: check proofs of periodic responses and their peaks."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from service.cli.failures import end
from service.cli.options import shared as options
from service.errors import InputError
from service.rendering.text import print_json, print_table
from solver.errors import MissingExtraError

_UNITS = {"frequency_hz": " Hz", "load_factor": ""}


def check_proof(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="A certificate, or an answer that has one (.json).")
    ],
    as_json: options.Json = False,
) -> None:
    """Check the proofs in a file that `solve`, `peaks`, `design` or `modes --certify --json` wrote.

    By solver/certificate/checker.py, which needs python-flint and nothing of this package.
    """
    try:
        from solver.certificate import checker
    except ImportError as error:
        raise MissingExtraError("python-flint", "proof") from error
    try:
        proofs = _proofs(json.loads(file.read_text(encoding="utf-8")))
        claims = [
            {name: [float(end) for end in span] for name, span in raw["claims"].items()} for raw in proofs
        ]
        if not proofs:
            raise ValueError("nothing is proved in it")
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"`FILE`: {str(file)!r} must be a certificate in JSON, got {error!r}") from error
    reasons = []
    for raw in proofs:
        try:
            checker.check(raw)
        except checker.RejectedError as error:
            reasons.append(error.args[0])
        except (KeyError, IndexError, TypeError, ValueError) as error:
            wanted = "must be a certificate as this version writes it"
            raise InputError(f"`FILE`: {str(file)!r} {wanted}, got {error!r}") from error
    reason = "; ".join(reasons)
    if as_json:
        print_json(
            {"accepted": not reason, "reason": reason, "claims": claims[0] if len(claims) == 1 else claims}
        )
    for raw, each in zip(proofs, claims, strict=True) if not (as_json or reason) else ():
        rows = [(name, f"{low!r} to {high!r}{_UNITS.get(name, ' m')}") for name, (low, high) in each.items()]
        print_table(f"Certificate of {raw.get('scene', 'a system')}", ("claim", "proved"), rows)
    end(not reason, f"The certificate is rejected: {reason}.")


def _proofs(raw: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the certificates of an answer, those of peaks behind each other, or the one that it is."""
    found = raw.get("certificates", [raw.get("certificate")])
    if found == [None]:
        return [raw]
    return [proof for each in found if each for proof in _proofs(each)]
