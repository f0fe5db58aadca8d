"""What one owner made is not there for another."""

from collections.abc import Iterator
from dataclasses import replace

import pytest
from private_kinds import PRIVATE
from service_helpers import PATIENCE, settings_of

from service.auth.callers import KEYLESS, Caller, Scope, included
from service.db.models import JobState
from service.errors import ConflictError, IdempotencyError, InvalidRequestError, NotFoundError
from service.jobs.common.scene_requests import HarmonicRequest, resolve_scene
from service.jobs.studies.sweep_study import Sweep
from service.queue.core import Service
from solver.scene.scene import load_scene

ANN, BEN = (Caller(owner=name, key_id=name) for name in ("ann", "ben"))
CHIEF = Caller(owner="chief", key_id="chief", scopes=included([Scope.ADMIN]))
BODY = {"kind": "iteration", "sweeps": 1}


@pytest.fixture
def service(url: str) -> Iterator[Service]:
    made = Service(settings_of(url)(), PRIVATE.extended(Sweep.as_kind()))
    made.start()
    yield made
    made.stop()


def own_scene(loads: float) -> dict[str, object]:
    return {**load_scene("two-dof").with_values({"damper.N0": loads}).to_dict(), "name": "mine"}


def test_jobs_and_what_they_computed_are_their_owners(service: Service) -> None:
    jobs = {}
    for caller in (ANN, BEN, KEYLESS):
        row, inserted = service.submit(BODY, "same-key", caller)
        assert inserted, "an Idempotency-Key is its owner's"
        assert row.result_of is None, "a result of another is computed anew"
        assert service.wait(row.id, PATIENCE, caller=caller).state is JobState.SUCCESSFUL
        assert service.submit(BODY, None, caller)[0].result_of == row.id
        jobs[caller.owner] = row.id
    for caller in (ANN, BEN, KEYLESS):
        mine, others = jobs[caller.owner], [job for owner, job in jobs.items() if owner != caller.owner]
        assert {row.owner for row in service.jobs.page(owner=caller.sees)} == {caller.owner}
        [sweep] = service.results(mine, caller).sweeps
        assert (sweep.owner, service.sweep(sweep.id, caller).job_id) == (caller.owner, mine)
        for other in others:
            for method in (service.job, service.dismiss, service.results, service.design):
                with pytest.raises(NotFoundError, match="there is no") as refused:
                    method(other, caller)
                assert refused.value.withheld
    with pytest.raises(NotFoundError) as refused:
        service.sweep(sweep.id, ANN)
    assert refused.value.withheld
    with pytest.raises(NotFoundError) as refused:
        service.job("none", ANN)
    assert not refused.value.withheld
    with pytest.raises(IdempotencyError):
        service.submit({**BODY, "seed": 1}, "same-key", BEN)


def test_an_admin_sees_and_dismisses_everything(service: Service) -> None:
    jobs = [service.submit({**BODY, "seconds": 60.0}, None, caller)[0] for caller in (ANN, BEN)]
    assert {row.owner for row in service.jobs.page(owner=CHIEF.sees)} == {"ann", "ben"}
    assert service.submit({**BODY, "seconds": 60.0}, None, CHIEF)[0].owner == "chief"
    for job in jobs:
        service.dismiss(job.id, CHIEF)
        assert service.wait(job.id, PATIENCE, caller=CHIEF).state is JobState.DISMISSED
    with pytest.raises(ConflictError):
        service.results(jobs[0].id, CHIEF)


def test_a_name_means_the_scene_of_its_owner(service: Service) -> None:
    assert service.scenes.of(ANN).add(own_scene(50.0))[1]
    assert service.scenes.of(BEN).add(own_scene(70.0))[1]
    with pytest.raises(ConflictError):
        service.scenes.of(BEN).add(own_scene(50.0))
    asked = HarmonicRequest(scene="mine")
    loads = [resolve_scene(asked, service.scenes.of(who)).value("damper.N0") for who in (ANN, BEN)]
    assert loads == [50.0, 70.0]
    for caller in (KEYLESS, CHIEF):
        with pytest.raises(NotFoundError):
            service.scenes.of(caller).get("mine")
        with pytest.raises(InvalidRequestError, match="neither a shipped scene nor a stored one"):
            service.submit({"kind": "sweep", "scene": "mine"}, None, caller)
    stored = {caller.owner: _stored(service, caller) for caller in (KEYLESS, ANN, CHIEF)}
    assert stored == {"": [], "ann": ["ann"], "chief": ["ann", "ben"]}


def _stored(service: Service, caller: Caller) -> list[str]:
    return [scene.owner for scene in service.scenes.of(caller).page(100)]


def test_scopes_include_one_another() -> None:
    assert included([Scope.SUBMIT]) == {Scope.SUBMIT, Scope.READ}
    assert included([Scope.READ, Scope.MONITOR]) == {Scope.READ, Scope.MONITOR}
    assert included([Scope.ADMIN]) == set(Scope)
    assert included([]) == set()
    assert replace(CHIEF, scopes=included([Scope.SUBMIT])).sees == "chief"
