"""The executor that a service's settings ask for."""

from __future__ import annotations

from service.errors import ConfigurationError
from service.jobs.registry import Registry
from service.settings.settings import Settings
from service.workers.base import Executor
from service.workers.local import LocalExecutor
from service.workers.process_limits import ProcessLimits


def executor_of(settings: Settings, registry: Registry) -> Executor:
    """The executor that the settings ask for.

    Raises
    ------
    ConfigurationError
        If what it needs is not installed.
    """
    limits = ProcessLimits(memory_bytes=settings.worker_memory_bytes or None)
    if settings.executor == "local" or settings.dask_scheduler is None:
        return LocalExecutor(
            registry.runs(),
            registry.warm_up,
            workers=settings.workers,
            grace_seconds=settings.grace_seconds,
            pace=settings.pace,
            limits=limits,
        )
    try:
        from distributed import Security

        from service.workers.dask import DaskExecutor
    except ImportError as error:
        raise ConfigurationError(
            f"`executor` 'dask' needs the extra of that name: pip install 'stickslip[dask]' ({error})"
        ) from error
    security = None
    if settings.dask_scheduler.startswith("tls://"):
        security = Security(
            tls_ca_file=str(settings.dask_ca_file),
            tls_client_cert=str(settings.dask_cert_file),
            tls_client_key=str(settings.dask_key_file),
            require_encryption=True,
        )
    return DaskExecutor(
        registry,
        settings.dask_scheduler,
        security=security,
        grace_seconds=settings.grace_seconds,
        pace=settings.pace,
        limits=limits,
    )
