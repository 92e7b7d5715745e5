"""Stamps keep every nanosecond, and a malformed line is named."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stairmap.errors import RecordingError, TrajectoryError
from stairmap.recordings.stamped_table import load_stamped_table, stamp_ns_from_text, text_from_stamp_ns


@pytest.mark.parametrize(
    ("text", "stamp_ns"),
    [
        ("1305031102.160407", 1305031102160407000),
        ("1305031102.1604070661", 1305031102160407066),
        ("0.000000", 0),
        ("0.1", 100_000_000),
        ("7", 7_000_000_000),
        ("1.5e3", 1_500_000_000_000),
        ("-0.5", -500_000_000),
        ("1e-999999", 0),
    ],
)
def test_decimal_seconds_become_exact_nanoseconds(text: str, stamp_ns: int) -> None:
    assert stamp_ns_from_text(text) == stamp_ns


@given(st.integers(-(2**63) + 1, 2**63 - 1))
def test_stamps_survive_text(stamp_ns: int) -> None:
    assert stamp_ns_from_text(text_from_stamp_ns(stamp_ns)) == stamp_ns


@pytest.mark.parametrize(
    "text", ["nan", "inf", "-Infinity", "abc", "1_000", "1,5", "0x10", "1e9999999999999999999"]
)
def test_what_is_no_number_is_no_stamp(text: str) -> None:
    with pytest.raises(ValueError, match="expected a stamp in seconds"):
        stamp_ns_from_text(text)


@pytest.mark.parametrize("text", ["1305031102160407000", "1305031102160", "1e999999999"])
def test_stamps_in_another_unit_are_told(text: str) -> None:
    with pytest.raises(ValueError, match="milli- or nanoseconds"):
        stamp_ns_from_text(text)


@pytest.mark.parametrize(
    "data",
    [
        b"1 a\n2 b\n",
        b"1 a\r\n2 b\r\n",
        b"\xef\xbb\xbf1 a\n2 b",
        b"# comment\n\n  #another\n1\ta\n 2   b  \n\n",
    ],
)
def test_line_ends_byte_order_mark_blanks_and_comments_do_not_matter(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "table.txt"
    path.write_bytes(data)
    rows = load_stamped_table(path, "stamp_s filename")
    assert [(row.stamp_ns, row.cells) for row in rows] == [(10**9, ("a",)), (2 * 10**9, ("b",))]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"# c\n1 a\n2 b c\n", r"table.txt:3: expected 2 columns 'stamp_s filename', got 3 in '2 b c'"),
        (b"1 a\n2\n", r"table.txt:2: expected 2 columns"),
        (b"1,a\n", r"table.txt:1: .*spaces, not commas"),
        (b"1 a\nx b\n", r"table.txt:2: expected a stamp in seconds, got 'x'"),
        (b"1 a\n2 b\n2.0 c\n", r"table.txt:3: .*2.0 s is the same as that of line 2"),
        (b"1 a\n\n0.5 b\n", r"table.txt:3: .*0.5 s is before that of line 1"),
        (b"\x89PNG\r\n\x1a\n", r"table.txt to be UTF-8 text, but byte 0 is 0x89"),
        (b"1 a\n2 \xe9.png\n", r"byte 6 is 0xe9"),
        ("1 a\n".encode("utf-16"), r"UTF-16; save it as UTF-8"),
        (b"1 a\0\n", r"binary data"),
    ],
)
def test_malformed_tables_are_refused_with_file_and_line(tmp_path: Path, data: bytes, message: str) -> None:
    path = tmp_path / "table.txt"
    path.write_bytes(data)
    with pytest.raises(TrajectoryError, match=message) as caught:
        load_stamped_table(path, "stamp_s filename", error_type=TrajectoryError)
    assert "\n" not in str(caught.value)


def test_long_lines_are_shortened_in_messages(tmp_path: Path) -> None:
    path = tmp_path / "table.txt"
    path.write_text("1 " * 100_000)
    with pytest.raises(RecordingError) as caught:
        load_stamped_table(path, "stamp_s filename")
    assert len(str(caught.value)) < 300 + len(str(path))


def test_a_missing_table_is_told(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"cannot read .*none.txt: No such file"):
        load_stamped_table(tmp_path / "none.txt", "stamp_s filename")


@given(st.binary(max_size=200))
def test_any_bytes_give_rows_or_one_line_of_reason(
    tmp_path_factory: pytest.TempPathFactory, data: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.txt"
    path.write_bytes(data)
    try:
        load_stamped_table(path, "stamp_s filename")
    except RecordingError as error:
        assert "\n" not in str(error)
