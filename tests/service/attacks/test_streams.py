"""Event streams: limited in total and for each key, and so cheap that nobody else notices them."""

from pathlib import Path

import pytest
from besieged import BEGUN, Besieged, besieged, follow, no_more_memory, others_are_served, submitted
from service_helpers import is_problem, until

EXIT_SECONDS = 10.0


@pytest.mark.long
def test_a_thousand_streams_leave_others_alone(tmp_path: Path) -> None:
    with besieged(tmp_path, "ann", "bob", owner_streams=0, streams=1000, connections=4000) as service:
        other = submitted(service, "bob")
        follow(service, "ann", 1000)
        others_are_served(service, f"/v1/jobs/{other}", "bob")
        no_more_memory(service)
        with service.client("bob") as client:
            is_problem(client.get(f"/v1/jobs/{other}/events"), 503)
        assert service.terminate() < EXIT_SECONDS


def test_a_key_has_so_many_streams(service: Besieged) -> None:
    job, other = submitted(service, "three"), submitted(service, "bob")
    streams = [service.ask(f"/v1/jobs/{job}/events", "three") for _ in range(3)]
    assert all(stream.recv(12) == BEGUN for stream in streams)
    with service.client("three") as client:
        refused = client.get(f"/v1/jobs/{job}/events")
        body = is_problem(refused, 429)
        assert "3" in body["detail"]
        assert int(refused.headers["retry-after"]) >= 1
    assert service.ask(f"/v1/jobs/{other}/events", "bob").recv(12) == BEGUN
    streams[0].close()
    until(lambda: service.ask(f"/v1/jobs/{job}/events", "three").recv(12) == BEGUN)
