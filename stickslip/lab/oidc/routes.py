"""``/v1/login``: people log in at an OpenID Connect provider, and the page gets a key for them.

The key goes to the page by a cookie that no script reads and that is exchanged at once: it is in no address,
and nothing but the page of this service can ask for it.
"""

from __future__ import annotations

import logging
from urllib.parse import urlencode

from fastapi import APIRouter, FastAPI, Request, Response

from service.auth.authenticator import Authenticator
from stickslip.lab.oidc.login import BEGIN_SECONDS, Login, LoginError
from service.errors import UnauthorizedError
from service.http.dependencies import InContext
from service.http.middleware.admission import LOGIN, address_of
from service.queue.core import Service
from service.schemas.answers import AnswerModel

log = logging.getLogger("stickslip.audit")

router = APIRouter(prefix=LOGIN, include_in_schema=False)
_EXCHANGE_SECONDS = 60


class NewKey(AnswerModel):
    """A key for the person who logged in."""

    key: str


def _login(request: Request) -> Login:
    login: Login = request.app.state.login
    return login


def _cookie(context: InContext, of: str) -> str:
    """The name of a cookie; over HTTPS one that no other host can set (RFC 6265bis, section 4.1.3.2)."""
    return f"{'__Host-' if context.service.settings.https else ''}stickslip-{of}"


def _set(context: InContext, answer: Response, of: str, value: str, seconds: int) -> None:
    answer.set_cookie(
        _cookie(context, of), value, max_age=seconds, httponly=True, samesite="lax",
        secure=context.service.settings.https,
    )  # fmt: skip


def _forget(context: InContext, answer: Response, of: str) -> None:
    https = context.service.settings.https
    answer.delete_cookie(_cookie(context, of), secure=https, httponly=True, samesite="lax")


def _count(context: InContext) -> None:
    authenticator: Authenticator = context.request.app.state.authenticator
    authenticator.count_login(address_of(context.request.scope))


def _sent_to(url: str) -> Response:
    return Response(status_code=303, headers={"Location": url, "Cache-Control": "no-store"})


@router.get("/begin")
async def begin(context: InContext) -> Response:
    """Send somebody to the provider."""
    _count(context)
    try:
        begun = await _login(context.request).begin()
    except LoginError as error:
        return _failed(error)
    answer = _sent_to(begun.url)
    _set(context, answer, "login", begun.cookie, BEGIN_SECONDS)
    return answer


@router.get("/callback")
async def callback(context: InContext) -> Response:
    """Whom the provider sends back goes on to the page, which fetches the key, or says what went wrong."""
    _count(context)
    request = context.request
    cookie = request.cookies.get(_cookie(context, "login"), "")
    try:
        key = await _login(request).finish(cookie, request.query_params)
    except LoginError as error:
        answer = _failed(error)
    else:
        answer = _sent_to("/?login=done")
        _set(context, answer, "key", key, _EXCHANGE_SECONDS)
    _forget(context, answer, "login")
    return answer


def _failed(error: LoginError) -> Response:
    log.warning("log-in %s: %s", error.refusal.value, error.detail)
    return _sent_to(f"/?{urlencode({'login': error.refusal.value})}")


@router.post("/key")
async def key(context: InContext, response: Response) -> NewKey:
    """The key of who has just logged in, once.

    Raises
    ------
    UnauthorizedError
        Nobody has.
    """
    found = context.request.cookies.get(_cookie(context, "key"))
    if found is None:
        raise UnauthorizedError("nobody has just logged in here")
    _forget(context, response, "key")
    response.headers["Cache-Control"] = "no-store"
    return NewKey(key=found)


def offer(app: FastAPI, service: Service) -> None:
    """Let people log in at the provider that the settings name."""
    app.state.login = Login(service.settings, service.keys, service.jobs.now)
    app.include_router(router)
