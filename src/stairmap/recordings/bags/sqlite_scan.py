"""rosbag2 files in SQLite from front to back, for those that are cut off or were not closed."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from urllib.parse import quote

from stairmap.recordings.bags.stream import CDR, BagMessage, BagTopic, plain_type

SQLITE_MAGIC = b"SQLite format 3\0"
"""First bytes of a file."""

_MAX_SKIP = 1 << 16


def scan_sqlite(path: Path, losses: list[str]) -> Iterator[BagMessage]:
    """Read all messages that are there; those on pages that are lost are left out.

    Raises
    ------
    OSError
        If the file cannot be opened.
    """
    path.open("rb").close()
    # What a recorder that crashed had not yet written into the file itself lies in a second one.
    has_log = path.with_name(path.name + "-wal").exists()
    options = "mode=ro" if has_log else "mode=ro&immutable=1"
    try:
        with closing(sqlite3.connect(f"file:{quote(str(path))}?{options}", uri=True)) as database:
            # Without this, SQLite opens no file that is shorter than it says.
            database.execute("PRAGMA writable_schema=ON")
            topics = {
                topic_id: BagTopic(name=name, type=plain_type(kind), encoding=CDR)
                for topic_id, name, kind in database.execute("SELECT id, name, type FROM topics")
                if isinstance(name, str) and isinstance(kind, str)
            }
            yield from _read_messages(database, topics, losses)
    except sqlite3.Error as error:
        is_stranger = "no such table" in str(error)
        losses.append(f"is no bag ({error})" if is_stranger else "is cut off or corrupt")


def _read_messages(
    database: sqlite3.Connection, topics: dict[int, BagTopic], losses: list[str]
) -> Iterator[BagMessage]:
    last_id, skip = 0, 0
    while True:
        query = "SELECT id, topic_id, timestamp, data FROM messages WHERE id > ? ORDER BY id"
        try:
            for message_id, topic_id, recorded_ns, data in database.execute(query, (last_id + skip,)):
                if message_id <= last_id:  # a corrupt tree may lead around in circles
                    losses.append("is cut off or corrupt")
                    return
                last_id, skip = message_id, 0
                if topic_id in topics and isinstance(data, bytes):
                    yield BagMessage(topic=topics[topic_id], recorded_ns=recorded_ns, data=data)
            return
        except sqlite3.DatabaseError:
            losses.append("is cut off or corrupt")
            # Behind a page that is lost there may be others.
            skip = max(1, 2 * skip)
            if skip > _MAX_SKIP:
                return
