"""All SQL of the service: each method is one transaction, each change of a job's state is guarded."""

from service.db.repositories.designs import DESIGN_SORTS, DesignFilter, DesignRepository, DesignRow
from service.db.repositories.jobs import Attempt, JobRepository, JobRow, NewJob, Recovered
from service.db.repositories.scenes import SceneRepository, SceneRow
from service.db.repositories.sweeps import SWEEP_SORTS, SweepFilter, SweepRepository, SweepRow
from service.db.repositories.uploads import UploadRepository, UploadRow

__all__ = [
    "DESIGN_SORTS",
    "SWEEP_SORTS",
    "Attempt",
    "DesignFilter",
    "DesignRepository",
    "DesignRow",
    "JobRepository",
    "JobRow",
    "NewJob",
    "Recovered",
    "SceneRepository",
    "SceneRow",
    "SweepFilter",
    "SweepRepository",
    "SweepRow",
    "UploadRepository",
    "UploadRow",
]
