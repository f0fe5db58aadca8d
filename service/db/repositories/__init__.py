"""All SQL of the service: each method is one transaction, each change of a job's state is guarded."""

from service.db.repositories.job_repository import Attempt, JobRepository, JobRow, NewJob, RecoveredJobs
from service.db.repositories.owned import SceneRepository, UploadRepository
from service.db.repositories.result_repository import ResultRepository

__all__ = [
    "Attempt", "JobRepository", "JobRow", "NewJob", "RecoveredJobs", "ResultRepository", "SceneRepository",
    "UploadRepository",
]  # fmt: skip
