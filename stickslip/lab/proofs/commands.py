"""`stickslip check-proof`: check proofs of periodic responses and their peaks."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from service.cli.failures import end
from service.cli.options import parameters as options
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

    By stickslip/lab/proofs/checker.py, which needs python-flint and nothing of this package.
    """
    try:
        from stickslip.lab.proofs import checker
    except ImportError as error:
        raise MissingExtraError("python-flint", "proof") from error
    try:
        proofs = list(_proofs(checker.read(file.read_bytes())))
        if not proofs:
            raise ValueError("nothing is proved in it")
        for raw in proofs:
            checker.stated(raw)
    except (OSError, ValueError, RecursionError, checker.RejectedError) as error:
        wanted = "must be a certificate in JSON, as this version writes it"
        raise InputError(f"`FILE`: {str(file)!r} {wanted}, got: {error}") from error
    claims = [{name: [float(end) for end in span] for name, span in raw["claims"].items()} for raw in proofs]
    reasons = []
    for raw in proofs:
        try:
            checker.check(raw)
        except checker.RejectedError as error:
            reasons.append(error.args[0])
    reason = "; ".join(reasons)
    if as_json:
        print_json(
            {"accepted": not reason, "reason": reason, "claims": claims[0] if len(claims) == 1 else claims}
        )
    for raw, each in zip(proofs, claims, strict=True) if not (as_json or reason) else ():
        rows = [(name, f"{low!r} to {high!r}{_UNITS.get(name, ' m')}") for name, (low, high) in each.items()]
        print_table(f"Certificate of {raw.get('scene', 'a system')}", ("claim", "proved"), rows)
    end(not reason, f"The certificate is rejected: {reason}.")


def _proofs(raw: Any) -> Iterator[Any]:
    """Return the certificates of an answer, those of peaks behind each other, or the one that it is."""
    if isinstance(raw, dict) and "certificates" in raw and isinstance(raw["certificates"], list):
        for each in raw["certificates"]:
            yield from _proofs(each)
    elif isinstance(raw, dict) and "certificate" in raw:
        if raw["certificate"] is not None:
            yield from _proofs(raw["certificate"])
    else:
        yield raw
