"""Keys are canonical, and two inputs are told apart by path."""

import hashlib
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import pytest

from gudgeon.modaldb.keys import canonical_json, content_key, differences, file_digest, open_file, read_inputs


def test_order_of_writing_does_not_matter() -> None:
    one = {"b": 1, "a": {"y": [1, 2], "x": None}}
    other = {"a": {"x": None, "y": [1, 2]}, "b": 1}
    assert canonical_json(one) == '{"a":{"x":null,"y":[1,2]},"b":1}'
    assert content_key(one) == content_key(other)


def test_order_of_a_list_matters() -> None:
    assert content_key({"a": [1, 2]}) != content_key({"a": [2, 1]})


@pytest.mark.parametrize(
    ("one", "other"),
    [(0.005, 0.0050000000000000001), (1e-3, 0.001), (1e22, 10000000000000000000000.0), (0.3, 0.299999999999999999)],
)
def test_equal_floats_have_one_text(one: float, other: float) -> None:
    assert content_key({"x": one}) == content_key({"x": other})


def test_floats_keep_their_last_bit() -> None:
    assert content_key({"x": 0.1}) != content_key({"x": math.nextafter(0.1, 1.0)})
    assert content_key({"x": 0.1 + 0.2}) != content_key({"x": 0.3})


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_floats_that_are_not_finite_are_refused(value: float) -> None:
    with pytest.raises(ValueError, match="JSON"):
        content_key({"deep": {"x": [value]}})


def test_values_without_json_form_are_refused() -> None:
    with pytest.raises(TypeError):
        content_key({"path": Path("x")})


def test_key_is_the_sha256_of_the_text() -> None:
    assert content_key({"a": 1}) == hashlib.sha256(b'{"a":1}').hexdigest()


def test_key_is_the_same_in_another_process() -> None:
    inputs = {"name": "Schürze ω", "size": 0.1 + 0.2, "set": {"b": True, "a": None}}
    program = f"from gudgeon.modaldb.keys import content_key; print(content_key({inputs!r}))"
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == content_key(inputs)


def test_file_digest_is_of_the_bytes(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"one\r\ntwo")
    assert file_digest(tmp_path / "a") == hashlib.sha256(b"one\r\ntwo").hexdigest()


def test_differences_name_the_path_and_both_values() -> None:
    old = {"mesh": {"size": 0.005, "order": 2}, "reduction": "macneal", "gone": 1}
    new = {"mesh": {"size": 0.01, "order": 2}, "reduction": "macneal", "added": [1, 2]}
    assert differences(old, new) == [
        "added: nothing → [1, 2]",
        "gone: 1 → nothing",
        "mesh.size: 0.005 → 0.01",
    ]


def test_no_differences_between_equals() -> None:
    inputs = {"mesh": {"size": 0.005}, "list": [1, {"a": 2}]}
    assert differences(inputs, {"list": [1, {"a": 2}], "mesh": {"size": 0.005}}) == []


def test_a_table_that_became_a_value_is_one_difference() -> None:
    assert differences({"a": {"b": 1}}, {"a": 3}) == ['a: {"b": 1} → 3']


def test_long_values_are_shortened() -> None:
    (line,) = differences({"key": "a" * 64}, {"key": "b" * 64})
    assert len(line) < 100
    assert line.startswith('key: "aaaa')
    assert line.endswith('bbbb"')


def test_pipes_and_devices_have_no_digest(tmp_path: Path) -> None:
    """They may have no end: a pipe without a writer looks like an empty file, and a device gives zeros for ever."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "zero").symlink_to("/dev/zero")
    for name in ("pipe", "zero"):
        with pytest.raises(OSError, match=f"not a file: '{tmp_path / name}'"):
            open_file(tmp_path / name)
    with pytest.raises(OSError, match="not a file"):
        file_digest(tmp_path / "pipe")


HALF = '{"a":"\\ud800"}'
DEEP = '{"a":' + "[" * 100 + "]" * 100 + "}"
NOT_INPUTS = ['{"a":1e400}', '{"a":NaN}', '{"a":-Infinity}', '{"a": 1}', '{"b":1,"a":1}', '{"a":1,"a":2}',
              '{"a":1.0e1}', "[1]", "null", "", "{", "[" * 100_000, HALF, DEEP, '{"a":' + "9" * 5000 + "}"]  # fmt: skip
"""Texts of which none is the canonical JSON of inputs: others cannot write them as JSON, or their key is another."""


@pytest.mark.parametrize("text", NOT_INPUTS, ids=range(len(NOT_INPUTS)))
def test_texts_that_are_no_inputs(text: str) -> None:
    with pytest.raises(ValueError, match=r"\w"):
        read_inputs(text)


def test_inputs_are_read_as_they_were_written() -> None:
    for inputs in ({}, {"a": [1, 2.5, None, True, "ω\x00"]}, {"a": json.loads(DEEP.replace("[]", ""))["a"]}):
        assert read_inputs(canonical_json(inputs)) == inputs
