"""JSON of a request: what is measured before it is read, and what is said of it."""

import json

import pytest

from service.errors import BodyTooLargeError, InvalidRequestError, MalformedBodyError
from service.jobs import strict_json
from service.jobs.strict_json import MOST_DEPTH, MOST_KEYS, MOST_TOLD, MOST_VALUES


def nested(depth: int) -> bytes:
    return b"[" * depth + b"]" * depth


def test_lists_may_stand_in_each_other_to_the_limit() -> None:
    assert strict_json.loads(nested(MOST_DEPTH)) == json.loads(nested(MOST_DEPTH))
    with pytest.raises(
        MalformedBodyError, match=f"{MOST_DEPTH} lists and objects .*, here {MOST_DEPTH + 1} do"
    ):
        strict_json.loads(nested(MOST_DEPTH + 1))


def test_values_and_keys_are_read_to_the_limit() -> None:
    fits = b"[" + b"0," * (MOST_VALUES - 3) + b"0]"
    assert len(strict_json.loads(fits)) == MOST_VALUES - 2
    with pytest.raises(BodyTooLargeError, match=f"may have {MOST_VALUES} values"):
        strict_json.loads(b"[" + b"0," * MOST_VALUES + b"0]")
    keys = json.dumps({str(number): 0 for number in range(MOST_KEYS + 1)}).encode()
    with pytest.raises(BodyTooLargeError, match=f"may have {MOST_KEYS} keys, this one has {MOST_KEYS + 1}"):
        strict_json.loads(keys)


@pytest.mark.parametrize("text", ["[" * 100, '"[,{:' * 100, "\\" * 101, '\\"[' * 100, "]}" * 100])
def test_signs_in_a_text_do_not_count(text: str) -> None:
    body = {text: [text, {"a": text + '"'}], "b": text}
    assert strict_json.loads(json.dumps(body).encode()) == body


def test_each_number_that_is_none_is_named_by_its_place() -> None:
    body = b'{"a/b": [1, NaN], "c": {"d": -1e999, "e": 1}, "f": ' + b"9" * 400 + b"}"
    with pytest.raises(InvalidRequestError) as raised:
        strict_json.loads(body)
    assert {issue.pointer: issue.said() for issue in raised.value.issues} == {
        "/a~1b/1": "`/a~1b/1` must be a finite number, got NaN",
        "/c/d": "`/c/d` must be a finite number, got -1e999",
        "/f": "`/f` must be a finite number, got one of 400 digits",
    }


def test_an_integer_of_thousands_of_digits_is_named_by_its_place() -> None:
    with pytest.raises(MalformedBodyError, match="`/a/1` must be a finite number, got one of 5000 digits"):
        strict_json.loads(b'{"a": [0, ' + b"9" * 5000 + b"]}")


def test_of_many_mistakes_the_first_are_told() -> None:
    with pytest.raises(InvalidRequestError) as raised:
        strict_json.loads(b"[" + b"NaN," * 1000 + b"0]")
    assert len(raised.value.issues) == MOST_TOLD


def test_the_largest_numbers_that_are_some_are_read() -> None:
    body = b'{"a": 1.7976931348623157e308, "b": ' + b"9" * 308 + b', "c": 5e-324}'
    assert strict_json.loads(body) == json.loads(body)
