"""`stickslip submit` for the kinds that look at a parameter, at many disks or at what accuracy costs."""

from __future__ import annotations

from service.cli.commands.campbell import BandHz, Limit, Orders, Speeds
from service.cli.commands.jobs import body_of, hand_in
from service.cli.commands.mistuning import Dof, Parts, Samples, Seed, Spread
from service.cli.commands.track import Checks, Followed, Frequencies, NoRidge, Start, Steps, Stop
from service.cli.options import shared as options


def peaks(
    name: options.Scene,
    parameter: Followed,
    start: Start,
    stop: Stop,
    values: options.Values = None,
    checks: Checks = 3,
    harmonics: options.Harmonics = 11,
    wait: options.Wait = False,
    as_json: options.Json = False,
    url: options.Url = options.DEFAULT_URL,
) -> None:
    """Submit the tracking of the highest peak over a parameter."""
    body = body_of("peaks", name, values, to=stop, checks=checks, harmonics=harmonics, **{"from": start})
    hand_in(url, {**body, "parameter": parameter}, wait=wait, as_json=as_json)


def response_map(
    name: options.Scene,
    parameter: Followed,
    start: Start,
    stop: Stop,
    steps: Steps = 60,
    frequencies: Frequencies = 400,
    values: options.Values = None,
    harmonics: options.Harmonics = 11,
    no_ridge: NoRidge = False,
    wait: options.Wait = False,
    as_json: options.Json = False,
    url: options.Url = options.DEFAULT_URL,
) -> None:
    """Submit a map of the response over frequency and a parameter."""
    body = body_of(
        "map", name, values, to=stop, steps=steps, frequencies=frequencies, harmonics=harmonics,
        ridge=not no_ridge, **{"from": start},
    )  # fmt: skip
    hand_in(url, {**body, "parameter": parameter}, wait=wait, as_json=as_json)


def accuracy(
    name: options.Scene,
    frequency: options.StudyFrequency = None,
    values: options.Values = None,
    wait: options.Wait = False,
    as_json: options.Json = False,
    url: options.Url = options.DEFAULT_URL,
) -> None:
    """Submit a study of what accuracy costs."""
    hand_in(url, body_of("accuracy", name, values, frequency_hz=frequency), wait=wait, as_json=as_json)


def campbell(
    name: options.Scene,
    speeds: Speeds,
    order: Orders = None,
    values: options.Values = None,
    limit: Limit = None,
    band: BandHz = None,
    harmonics: options.Harmonics = 11,
    wait: options.Wait = False,
    as_json: options.Json = False,
    url: options.Url = options.DEFAULT_URL,
) -> None:
    """Submit a Campbell diagram."""
    body = body_of("campbell", name, values, limit=limit, orders=order, band_hz=band, harmonics=harmonics)
    hand_in(url, {**body, "speeds_rpm": [list(speeds)]}, wait=wait, as_json=as_json)


def mistuning(
    name: options.Scene,
    of: Parts,
    spread: Spread = 0.02,
    samples: Samples = 100,
    seed: Seed = 1,
    dof: Dof = None,
    start: options.From = None,
    stop: options.To = None,
    values: options.Values = None,
    harmonics: options.Harmonics = 11,
    wait: options.Wait = False,
    as_json: options.Json = False,
    url: options.Url = options.DEFAULT_URL,
) -> None:
    """Submit a study of mistuned disks."""
    body = body_of(
        "mistuning", name, values, of=of, spread=spread, samples=samples, seed=seed, dof=dof, to=stop,
        harmonics=harmonics, **({} if start is None else {"from": start}),
    )  # fmt: skip
    hand_in(url, body, wait=wait, as_json=as_json)
