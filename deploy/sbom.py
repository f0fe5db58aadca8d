"""What an installation consists of, as CycloneDX 1.6 on standard output: ``make sbom``.

The packages of ``requirements/`` but those of development, with the digests of their files, their licences
and what needs what as far as they are installed here, and the scripts of others that the page brings along.
"""

from __future__ import annotations

import json
import re
import sys
import tomllib
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
_PIN = re.compile(r"^([\w.-]+)==([\w.]+)[^\n]*((?:\n    --hash=sha256:[0-9a-f]{64}[^\n]*)*)", re.MULTILINE)
_SCRIPT = re.compile(r"((?:@[\w-]+/)?[\w-]+)@(\d[\w.]*)")
_BUILDS_ONLY = "esbuild"


def packages() -> Iterator[dict[str, Any]]:
    """Yield the packages of Python."""
    files = sorted((ROOT / "requirements").glob("*.txt"))
    running = "".join(file.read_text("utf-8") for file in files if file.stem != "dev")
    for name, version, hashes in _PIN.findall(running):
        about = _component(_normal(name), version, "pypi")
        digests = re.findall(r"sha256:(\w+)", hashes)
        # A component has one digest of each kind: those of its files stand where those of archives do.
        reference = {"type": "distribution", "url": about["purl"]}
        about["externalReferences"] = [
            {**reference, "hashes": [{"alg": "SHA-256", "content": one}]} for one in digests
        ]
        yield about | _licence(name)


def scripts() -> Iterator[dict[str, Any]]:
    """Yield the scripts of others on the page, as their README says they were made."""
    readme = ROOT / "service" / "page" / "js" / "vendor" / "README.md"
    for line in readme.read_text("utf-8").splitlines():
        if line.startswith("npm install "):
            for name, version in _SCRIPT.findall(line):
                if name != _BUILDS_ONLY:
                    yield _component(name, version, "npm")


def _component(name: str, version: str, kind: str) -> dict[str, Any]:
    purl = f"pkg:{kind}/{name.replace('@', '%40')}@{version}"
    return {"type": "library", "bom-ref": purl, "name": name, "version": version, "purl": purl}


def _licence(name: str) -> dict[str, Any]:
    try:
        about = distribution(name).metadata
    except PackageNotFoundError:
        return {}
    expression = about.get("License-Expression")
    if expression:
        return {"licenses": [{"expression": expression}]}
    classified = [one for one in about.get_all("Classifier") or () if one.startswith("License ::")]
    words = classified[0].rpartition(" :: ")[2] if classified else (about.get("License") or "").strip()
    return {"licenses": [{"license": {"name": words.splitlines()[0]}}]} if words else {}


def _needs(component: dict[str, Any], known: dict[str, str]) -> dict[str, Any]:
    """What a package needs of those that are listed."""
    try:
        wanted = distribution(component["name"]).requires or []
    except PackageNotFoundError:
        wanted = []
    names = {_normal(re.split(r"[<>=!~\[; (]", one)[0]) for one in wanted if "extra ==" not in one}
    return {
        "ref": component["bom-ref"],
        "dependsOn": sorted(known[name] for name in names if name in known),
    }


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def bill() -> dict[str, Any]:
    """Return the whole list."""
    about = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    own = {**_component(about["name"], about["version"], "pypi"), "type": "application"}
    own["licenses"] = [{"license": {"id": about["license"]}}]
    found, vendored = list(packages()), list(scripts())
    known = {one["name"]: one["bom-ref"] for one in found}
    needs = [_needs(one, known) for one in (own, *found)]
    needs[0]["dependsOn"] += [one["bom-ref"] for one in vendored]
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": own},
        "components": [*found, *vendored],
        "dependencies": needs,
    }


if __name__ == "__main__":
    json.dump(bill(), sys.stdout, indent=1, sort_keys=True)
    sys.stdout.write("\n")
