"""The kinds of job that come with the service; a further one is one module and one entry here."""

from service.jobs import Registry

SHIPPED = Registry([], preload=("solver", "optim"))
