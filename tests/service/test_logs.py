"""The log: lines for people or for programs, with the job and the request they are about."""

import io
import json
import logging
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from urllib.parse import unquote

import httpx
import pytest
from private_kinds import PRIVATE
from service_helpers import serving

from service.client.embedded import EmbeddedService
from service.db.repositories.owned import Tokens
from service.settings import logs
from service.settings.logs import JsonFormatter, TextFormatter


@pytest.fixture
def lines() -> list[dict[str, object]]:
    """Everything logged during a test, as a program reads it."""
    return []


class Listener(logging.Handler):
    """Formats what is logged where it is logged: in the context of who logs it."""

    def __init__(self, lines: list[dict[str, object]]) -> None:
        super().__init__()
        self.setFormatter(JsonFormatter())
        self._lines = lines

    def emit(self, record: logging.LogRecord) -> None:
        self._lines.append(json.loads(self.format(record)))


@pytest.fixture
def listening(lines: list[dict[str, object]]):
    handler, root = Listener(lines), logging.getLogger("stickslip")
    level = root.level
    root.setLevel(logging.INFO)
    root.addHandler(handler)
    yield
    root.removeHandler(handler)
    root.setLevel(level)


def written(formatter: logging.Formatter, message: str, *values: object, error: bool = False) -> str:
    stream = io.StringIO()
    handler = logging.StreamHandler(stream)
    handler.setFormatter(formatter)
    logger = logging.Logger("stickslip.test")
    logger.addHandler(handler)
    try:
        if error:
            raise ValueError("bad")
    except ValueError:
        logger.exception(message, *values)
    else:
        logger.warning(message, *values)
    return stream.getvalue()


def test_a_line_for_programs_is_one_object() -> None:
    with logs.about(job="j", owner=None), logs.about(attempt=2):
        text = written(JsonFormatter(), "line one\nline %d", 2, error=True)
    assert text.count("\n") == 1, "one line, whatever the message and the exception are"
    line = json.loads(text)
    assert line["message"] == "line one\nline 2"
    assert (line["level"], line["logger"], line["job"], line["attempt"]) == (
        "ERROR",
        "stickslip.test",
        "j",
        2,
    )
    assert "owner" not in line
    assert line["time"].endswith("Z")
    assert "ValueError: bad" in line["exception"]
    assert "job" not in json.loads(written(JsonFormatter(), "outside"))


def test_a_line_for_people_names_the_request() -> None:
    with logs.about(request="abc", job="j"):
        assert written(TextFormatter(), "a job").rstrip().endswith("stickslip.test a job [request abc]")


def test_fields_are_those_of_one_thread() -> None:
    seen: list[str] = []
    with logs.about(job="j"):
        thread = threading.Thread(target=lambda: seen.append(written(JsonFormatter(), "x")))
        thread.start()
        thread.join()
    assert "job" not in json.loads(seen[0])


@pytest.mark.usefixtures("listening")
def test_what_happens_to_a_job_is_logged_with_it(
    embedded: EmbeddedService, lines: list[dict[str, object]]
) -> None:
    job = embedded.submit("iteration", {})
    embedded.wait(job)
    mine = [line for line in lines if line.get("job") == job]
    assert [line["message"].split(", ")[1] for line in mine] == ["attempt 1 of 3", "attempt 1: successful"]
    assert {line["kind"] for line in mine} == {"iteration"}
    assert mine[-1]["attempt"] == 1
    assert float(mine[-1]["seconds"]) >= 0.0


@pytest.mark.usefixtures("listening")
def test_every_answer_has_the_number_of_its_request(
    http: httpx.Client, lines: list[dict[str, object]]
) -> None:
    given = http.get("/v1/jobs", headers={"X-Request-ID": "from-the-client.1"})
    assert given.headers["x-request-id"] == "from-the-client.1"
    numbers = set()
    for bad in ({}, {"X-Request-ID": "a b"}, {"X-Request-ID": "x" * 200}, {"X-Request-ID": ""}):
        answer = http.get("/v1/jobs/nothing%0Aelse?key=secret", headers=bad)
        assert answer.status_code == 404
        numbers.add(answer.headers["x-request-id"])
    assert len(numbers) == 4
    assert all(len(number) == 32 for number in numbers)
    line = next(line for line in lines if line.get("request") == "from-the-client.1" and "status" in line)
    assert (line["method"], line["path"], line["status"]) == ("GET", "/v1/jobs", 200)
    assert float(line["seconds"]) > 0.0
    missing = [line for line in lines if line.get("request") in numbers and "status" in line]
    assert {line["path"] for line in missing} == {"/v1/jobs/nothing%0Aelse"}, "nothing decoded, no query"


def test_lines_for_people_hold_no_control_characters() -> None:
    record = logging.LogRecord("a", logging.INFO, __file__, 1, "a\x1b[2J\x00b\x9b\tc", None, None)
    assert TextFormatter().format(record).endswith("a\\x1b[2J\\x00b\\x9b\tc")


def encoded(text: str, times: int) -> str:
    """Every character percent-encoded, and the percent signs of that again."""
    text = "".join(f"%{ord(one):02x}" for one in text)
    return text.replace("%", "%" + "25" * (times - 1)) if times else text


def overlong(text: str, form: str) -> str:
    return "".join(
        form.format(0xC0 | ord(one) >> 6, 0x80 | ord(one) >> 6, 0x80 | ord(one) & 0x3F) for one in text
    )


WRITINGS = {
    "plain": str,
    "capitals": str.upper,
    "once": lambda token: token.replace("_", "%5F"),
    "twice": lambda token: token.replace("_", "%255f"),
    "often": lambda token: token.replace("_", "%" + "25" * 30 + "5F"),
    "every letter": lambda token: encoded(token[:40], 1),
    "again and again": lambda token: token.replace("_", encoded(encoded("_", 1), 3)),
    "digits encoded": lambda token: token.replace("_", "%%35%46"),
    "overlong": lambda token: token[:-64] + overlong(token[-64:], "%{0:02x}%{2:02x}"),
    "overlong prefix": lambda token: overlong(token[:10], "%e0%{1:02x}%{2:02x}") + token[10:],
    "without its prefix": lambda token: token[-64:],
}


@pytest.mark.parametrize("formatter", [TextFormatter(), JsonFormatter()], ids=["people", "programs"])
@pytest.mark.parametrize("writing", WRITINGS)
def test_secrets_are_in_no_line_however_they_were_written(formatter: logging.Formatter, writing: str) -> None:
    for prefix, bytes_of_id in (("stickslip", 6), ("share", 8)):
        _, token = Tokens(prefix, bytes_of_id).new()
        shown = WRITINGS[writing](token)
        path = logs.path_of(f"/v1/jobs/{shown}/x?token={shown}".encode())
        with logs.about(path=path, request="r"):
            text = written(formatter, "no job '%s' and %s", f"{shown}y", path, error=True)
        secret = token.rpartition("_")[2]
        for part in (text, path):
            plain = unquote(unquote(part)).lower()
            assert not any(secret[at : at + 12] in plain for at in range(53)), part
            assert shown[-24:] not in part
            assert "***" in part
            assert "\n" not in path


def test_what_is_decoded_ends_no_line() -> None:
    for line in (f"/a%0Ab/share_{'1' * 16}_{'a' * 64}%0A2026 forged", f"%250d%250Ashare%5F1_{'a' * 64}"):
        assert "\n" not in logs.masked(line)
        assert "\r" not in logs.masked(line)


def test_a_path_is_short_in_the_log() -> None:
    for raw in (
        b"/" + b"a" * 40_000,
        b"/" + b"\xff" * 40_000,
        b'/\n"' * 9_000,
        b"/%" + b"25" * 30_000 + b"5F",
    ):
        path = logs.path_of(raw)
        assert len(path) <= 512
        assert path.isprintable()
    assert logs.path_of(b"/v1/jobs/nothing%0Aelse") == "/v1/jobs/nothing%0Aelse"
    assert logs.path_of(b"/" + b"%2%3" * 9000).startswith("/")


@pytest.mark.usefixtures("listening")
def test_many_refusals_of_one_address_are_few_lines(tmp_path: Path, lines: list[dict[str, object]]) -> None:
    with serving(tmp_path, PRIVATE, require_keys=True, requests_per_minute=5) as client:
        lines.clear()
        with ThreadPoolExecutor(20) as askers:
            answers = list(askers.map(client.get, 100 * [f"/{'x' * 3000}"]))
        statuses = [answer.status_code for answer in answers]
        assert statuses.count(429) >= 94
        assert sum(len(json.dumps(line)) for line in lines) < 100_000
        client.request("G" * 3000, "/health/live")
        assert max(len(json.dumps(line)) for line in lines) < 2000
