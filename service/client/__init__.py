"""A client of the service's REST API."""

from service.client.client import Client

__all__ = ["Client"]
