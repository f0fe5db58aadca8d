"""How the client reaches a service: requests that are tried again, problems as exceptions."""

from __future__ import annotations

import random
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Self, TypeVar
from urllib.parse import quote

import httpx
from pydantic import BaseModel

from service.errors import ServiceProblem

_PAUSES = (0.1, 0.2, 0.4)
ModelT = TypeVar("ModelT", bound=BaseModel)


class Transport:
    """Sends requests; a connection that fails is tried again, so every request must be safe to repeat.

    Where an answer is not what was asked for, that is a `ServiceProblem`: with the problem document if the
    service refuses, with status 0 if it cannot be reached. Parameters are those of `Client`.
    """

    def __init__(self, base_url: str, timeout: float = 30.0, *, key: str | None = None) -> None:
        self.base_url, self._timeout = base_url, timeout
        headers = {} if key is None else {"Authorization": f"Bearer {key}"}
        self._http = httpx.Client(base_url=base_url, timeout=timeout, headers=headers)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections."""
        self._http.close()

    def _send(self, method: str, path: str, **arguments: Any) -> httpx.Response:
        for pause in pauses():
            try:
                response = self._http.request(method, path, **arguments)
            except httpx.TransportError as error:
                if pause is None:
                    raise self._away(error) from error
                time.sleep(pause)
                continue
            except httpx.HTTPError as error:
                raise self._away(error) from error
            if response.is_success:
                return response
            raise refusal(response)
        raise RuntimeError("the last pause is None")

    @contextmanager
    def _stream(self, path: str, headers: Mapping[str, str], silence: float) -> Iterator[httpx.Response]:
        """Open a stream for the length of a block; httpx's errors pass, `silence` [s] ends it with one."""
        timeout = httpx.Timeout(self._http.timeout.connect, read=silence)
        with self._http.stream("GET", path, headers=dict(headers), timeout=timeout) as response:
            if not response.is_success:
                response.read()
                raise refusal(response)
            yield response

    def _away(self, error: Exception) -> ServiceProblem:
        """The service does not answer."""
        detail = f"the service at {self._http.base_url} cannot be reached: {error}"
        return ServiceProblem(0, {"title": "No answer", "detail": detail})

    def _get(self, model: type[ModelT], path: str, **query: Any) -> ModelT:
        return self._sent(model, "GET", path, params=words(query) or None)

    def _sent(self, model: type[ModelT], method: str, path: str, **arguments: Any) -> ModelT:
        return model.model_validate(self._send(method, path, **arguments).json())

    def _posted(self, path: str, body: Mapping[str, Any]) -> dict[str, Any]:
        answer: dict[str, Any] = self._send("POST", path, json=dict(body)).json()
        return answer

    def _changed(
        self, model: type[ModelT], path: str, revision: int | None, changes: Mapping[str, Any]
    ) -> ModelT:
        headers = {} if revision is None else {"If-Match": f'"{revision}"'}
        return self._sent(model, "PATCH", path, json=changes, headers=headers)

    def _pages(self, model: type[Any], path: str, filters: Mapping[str, Any]) -> Iterator[Any]:
        """The items of a list, page after page."""
        page = self._sent(model, "GET", path, params=words(filters))
        yield from page.items
        while page.next is not None:
            page = self._sent(model, "GET", page.next)
            yield from page.items


def pauses() -> Iterator[float | None]:
    """Times between tries [s], growing, with chance in them so that many clients do not come back at once."""
    for pause in _PAUSES:
        yield pause * random.uniform(0.75, 1.25)
    yield None


def refusal(response: httpx.Response) -> ServiceProblem:
    """The problem a service answered with."""
    try:
        problem = response.json()
    except ValueError:
        problem = {"title": response.reason_phrase, "detail": response.text[:500]}
    return ServiceProblem(response.status_code, problem if isinstance(problem, dict) else {})


def words(filters: Mapping[str, Any]) -> dict[str, Any]:
    """Filters as a query: without those not given, true and false in lower case."""
    given = {key: value for key, value in filters.items() if value is not None}
    return {key: str(value).lower() if isinstance(value, bool) else value for key, value in given.items()}


def segment(name: str) -> str:
    """An id as one segment of a path."""
    return quote(name, safe="")
