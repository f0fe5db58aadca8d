"""All SQL of the service: each method is one transaction, each change of a job's state is guarded."""

from service.db.repositories.designs import DesignRepository
from service.db.repositories.jobs.repository import Attempt, JobRepository, JobRow, NewJob, Recovered
from service.db.repositories.scenes import SceneRepository
from service.db.repositories.sweeps import SweepRepository
from service.db.repositories.uploads import UploadRepository

__all__ = [
    "Attempt",
    "DesignRepository",
    "JobRepository",
    "JobRow",
    "NewJob",
    "Recovered",
    "SceneRepository",
    "SweepRepository",
    "UploadRepository",
]
