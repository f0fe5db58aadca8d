"""What a service counts for whoever watches it: waits, times of attempts, leases lost, refusals by owner."""

from __future__ import annotations

import threading
from collections import Counter as Counts
from collections.abc import Iterable, Iterator

from prometheus_client import Counter, Histogram
from prometheus_client.core import CounterMetricFamily, Metric
from prometheus_client.registry import Collector

_SECONDS = (0.01, 0.05, 0.1, 0.5, 1.0, 5.0, 10.0, 30.0, 60.0, 300.0, 1800.0, 7200.0)
_LANE_SECONDS = (0.001, 0.005, 0.025, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)
REFUSALS = frozenset({429, 503})
_SHOWN, _RANKED = 20, 1000
OTHERS = "(others)"
"""In place of the owners who are not among the busiest."""


class Meters:
    """The numbers of one service; nothing of them is computed before a monitor asks."""

    def __init__(self) -> None:
        self.waited = Histogram(
            "stickslip_job_wait_seconds", "Time from handing a job in to its first attempt.",
            ("kind",), buckets=_SECONDS, registry=None,
        )  # fmt: skip
        self.ran = Histogram(
            "stickslip_job_run_seconds", "Time of an attempt, from taking its job to its outcome.",
            ("kind", "outcome"), buckets=_SECONDS, registry=None,
        )  # fmt: skip
        self.lost = Counter(
            "stickslip_leases_lost",
            "Leases that ran out: noticed by the attempt that had it, or of jobs taken back from another.",
            ("noticed",), registry=None,
        )  # fmt: skip
        # From 0: a monitor sees what is added to a series, not that there is one.
        for noticed in ("own", "taken back"):
            self.lost.labels(noticed)
        self.lanes = Histogram(
            "stickslip_lane_wait_seconds", "Time a request waited for its turn.",
            ("lane",), buckets=_LANE_SECONDS, registry=None,
        )  # fmt: skip
        self.refused = Refusals()

    def __iter__(self) -> Iterator[Collector]:
        return iter((self.waited, self.ran, self.lost, self.lanes, self.refused))


class Refusals(Collector):
    """Answers 429 and 503 by owner, of the busiest by name and of all others together.

    An owner who becomes one of the busiest is counted by name from then on, and one who is no more goes to
    the others: no series falls, and there are never more than `shown` names.

    Parameters
    ----------
    shown : how many owners have a series of their own.
    ranked : how many owners are compared; beyond it all ranks are halved, and who was refused once is
        forgotten.
    """

    def __init__(self, shown: int = _SHOWN, ranked: int = _RANKED) -> None:
        self._shown, self._ranked = shown, ranked
        self._named: dict[str, Counts[int]] = {}
        self._others: Counts[int] = Counts()
        self._rank: Counts[str] = Counts()
        self._lock = threading.Lock()

    def count(self, owner: str, status: int) -> None:
        """One more request of an owner was refused."""
        with self._lock:
            self._rank[owner] += 1
            if owner not in self._named:
                self._name(owner)
            self._named.get(owner, self._others)[status] += 1
            if len(self._rank) > self._ranked:
                self._rank = Counts({one: rank // 2 for one, rank in self._rank.items() if rank > 1})

    def _name(self, owner: str) -> None:
        """Give an owner a series if there is one to be had."""
        if len(self._named) >= self._shown:
            least = min(self._named, key=lambda one: self._rank[one])
            if self._rank[least] >= self._rank[owner]:
                return
            self._others.update(self._named.pop(least))
        self._named[owner] = Counts()

    def collect(self) -> Iterable[Metric]:
        """Yield the counter."""
        found = CounterMetricFamily(
            "stickslip_refused",
            "Answers 429 and 503, of the owners who had most.",
            labels=("owner", "status"),
        )
        with self._lock:
            told = [*self._named.items(), (OTHERS, self._others)]
            for owner, counts in told:
                for status, count in counts.items():
                    found.add_metric((owner, str(status)), float(count))
        yield found
