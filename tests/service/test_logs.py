"""The log: lines for people or for programs, with the job and the request they are about."""

import io
import json
import logging
import threading

import httpx
import pytest

from service.client.embedded import EmbeddedService
from service.db.tokens import Tokens
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


@pytest.mark.parametrize("formatter", [TextFormatter(), JsonFormatter()], ids=["people", "programs"])
def test_secrets_are_in_no_line_wherever_they_were_written(formatter: logging.Formatter) -> None:
    for prefix, bytes_of_id in (("stickslip", 6), ("share", 8)):
        row_id, token = Tokens(prefix, bytes_of_id).new()
        with logs.about(path=f"/v1/jobs/{token}/x", request="r"):
            text = written(formatter, "no job '%s' and %s", f"{token}y", token.upper().lower(), error=True)
        assert token.rpartition("_")[2] not in text
        assert f"{prefix}_{row_id}_***" in text
