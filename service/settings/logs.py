"""The log of a service process: lines for people, or one JSON object a line for programs.

Fields such as the job or the request are not part of a message: they are put on every line that is written
inside `about`, whoever writes it.
"""

from __future__ import annotations

import json
import logging
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from datetime import UTC, datetime
from urllib.parse import quote, unquote_to_bytes

_TEXT = "%(asctime)s %(levelname)s %(name)s %(message)s"
_FIELDS: ContextVar[Mapping[str, object]] = ContextVar("stickslip_log_fields", default={})  # noqa: B039
# Said in lines for people too: what connects them to a request. A job is in the message.
_SHOWN = ("request",)


@contextmanager
def about(**fields: object) -> Iterator[None]:
    """Put fields on every line that is logged inside the block, by this thread or task."""
    token = _FIELDS.set({**_FIELDS.get(), **{k: v for k, v in fields.items() if v is not None}})
    try:
        yield
    finally:
        _FIELDS.reset(token)


# All but the end of a line and the tabulator, which a traceback has: a terminal would obey the others.
CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


# Of a key or a link (`service.db.repositories.owned`): its id may be told, its secret may not, wherever it
# was written.
_SECRET = re.compile(r"((?:stickslip|share)_[0-9a-f]+_)[0-9a-f]+|[0-9a-f]{48,}", re.IGNORECASE)
# A percent sign that was encoded itself, however often; ASCII in more bytes than it needs.
_AGAIN, _OVERLONG = re.compile("%(?:25)+"), re.compile(rb"(?:\xf0\x80|\xe0)?[\x80\x81\xc0\xc1]([\x80-\xbf])")
_ENDS = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]")
_MOST_TIMES = 8
_LONGEST_PATH = 512


def _of_ascii(found: re.Match[bytes]) -> bytes:
    return bytes([(found[0][-2] & 1) << 6 | found[0][-1] & 0x3F])


def masked(text: str) -> str:
    """A text without secrets; a line in which one is percent-encoded is decoded."""
    return "\n".join(map(_masked_line, text.split("\n")))


def _masked_line(text: str) -> str:
    text = _SECRET.sub(_kept, text)
    plain, before, times = text, "", 0
    while "%" in plain and plain != before and times < _MOST_TIMES:
        before, times = plain, times + 1
        data = unquote_to_bytes(_AGAIN.sub("%", plain))
        plain = _OVERLONG.sub(_of_ascii, data).decode("utf-8", "replace")
    if times == _MOST_TIMES:
        return "(encoded too often)"
    return _ENDS.sub(_escaped, _SECRET.sub(_kept, plain)) if _SECRET.search(plain) else text


def _kept(found: re.Match[str]) -> str:
    return f"{found[1] or ''}***"


def path_of(raw: bytes) -> str:
    """The path of a request as a line may have it: its beginning, as it came, in printable letters."""
    return masked(quote(raw[:_LONGEST_PATH], safe=_PRINTABLE)[:_LONGEST_PATH])[:_LONGEST_PATH]


_PRINTABLE = "%!$&'()*+,/:;=@~?"


def _escaped(found: re.Match[str]) -> str:
    return f"\\x{ord(found[0]):02x}"


class TextFormatter(logging.Formatter):
    """Lines for people."""

    def __init__(self) -> None:
        super().__init__(_TEXT)

    def format(self, record: logging.LogRecord) -> str:
        """The line of a record."""
        fields = _FIELDS.get()
        shown = "".join(f" [{name} {fields[name]}]" for name in _SHOWN if name in fields)
        return CONTROL.sub(_escaped, masked(super().format(record)) + shown)


class JsonFormatter(logging.Formatter):
    """One JSON object a line: time, level, logger, message, the fields, and the exception if there is one."""

    def format(self, record: logging.LogRecord) -> str:
        """The line of a record."""
        time = datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds")
        line: dict[str, object] = {
            "time": time.replace("+00:00", "Z"), "level": record.levelname, "logger": record.name,
            "message": record.getMessage(), **_FIELDS.get(),
        }  # fmt: skip
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        told = {name: masked(value) if isinstance(value, str) else value for name, value in line.items()}
        return json.dumps(told, default=str)


FORMATTERS: Mapping[str, type[logging.Formatter]] = {"text": TextFormatter, "json": JsonFormatter}


def configure(level: str = "INFO", form: str = "text") -> None:
    """Log to standard error, unless the program has set up logging already.

    Parameters
    ----------
    level : least level that is logged.
    form : ``text`` or ``json``.
    """
    handler = logging.StreamHandler()
    handler.setFormatter(FORMATTERS[form]())
    logging.basicConfig(level=level, handlers=[handler])
    logging.getLogger("alembic").setLevel(logging.WARNING)
    # No line says where in the program, in which thread or process it was written: nobody need find out.
    logging._srcfile = None
    logging.logThreads = logging.logProcesses = logging.logMultiprocessing = False
