"""The folder of a batch: one process at a time, its journal, its tables, its page.

At an address (an object store) the journal and the tables are made in a folder of this machine; what the
journal gained is put there every few seconds as a numbered piece.
"""

from __future__ import annotations

import json
import os
import shutil
import tempfile
import time
import uuid
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import IO, Any

from stairmap.batch.addresses import is_address
from stairmap.batch.journal import JOURNAL_FILE, BatchJournal
from stairmap.batch.output_place import TOKEN_FILE, LocalPlace, OutputPlace, open_place, remove_abandoned
from stairmap.batch.summary_page import PAGE_FILE, SummaryPage
from stairmap.batch.table import Row
from stairmap.batch.table_files import CSV_FILE, PARQUET_FILE, write_tables
from stairmap.errors import BatchError
from stairmap.input_files import parse_json, read_text
from stairmap.output_files import check_has_room, output_error

LOCK_FILE = ".batch-lock"

PIECES_FOLDER = "batch-journal"
"""Where the pieces of the journal are at an address."""

SYNC_PERIOD = 10.0
"""Time between two pieces of the journal at an address, s: what a killed batch may have to look up again."""

LOCK_PATIENCE = 60.0
"""A lock at an address that was not renewed for so long was left by a killed batch, s."""


class BatchFolder:
    """The folder of a batch, locked for this process.

    Parameters
    ----------
    output
        A path or an address; a folder that is new, empty, or that of a batch.
    fingerprint
        Of the settings.

    Raises
    ------
    BatchError
        If another batch writes there now, or something else is there.
    OutputError
        If it cannot be written.
    """

    def __init__(self, output: str, fingerprint: str) -> None:
        self.token = uuid.uuid4().hex
        self._scratch: Path | None = None
        self._lock: IO[str] | None = None
        self._num_synced, self._synced_at, self._piece = 0, time.monotonic(), 0
        if is_address(output):
            self.output = output.rstrip("/")
            self._scratch = self.local_folder = Path(tempfile.mkdtemp(prefix="stairmap-batch-"))
        else:
            self.local_folder = Path(os.path.abspath(output))  # noqa: PTH100 - a link stays what it is called
            self.output = str(self.local_folder)
        self.place: OutputPlace = open_place(self.output)
        try:
            self._open(fingerprint)
        except BaseException:
            self.close()
            raise

    def _open(self, fingerprint: str) -> None:
        names = self.place.names()
        marks = (JOURNAL_FILE, PIECES_FOLDER)
        if not any(mark in names for mark in marks) and any(not name.startswith(".") for name in names):
            raise BatchError(
                f"--output {self.output} is not empty and no batch is in it; name a new or empty folder"
            )
        if self._scratch is None:
            self._make_local()
        self._take_lock()
        if self._scratch is not None:
            self._fetch_journal()
        else:
            remove_abandoned(self.local_folder)
        taken = [name.casefold() for name in ("batch", PIECES_FOLDER)]
        self.journal = BatchJournal(self.local_folder / JOURNAL_FILE, fingerprint, taken)
        self.place.write(TOKEN_FILE, self.token.encode())

    def __enter__(self) -> BatchFolder:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _make_local(self) -> None:
        folder = self.local_folder
        if folder.exists() and not folder.is_dir():
            raise BatchError(f"--output {folder} is a file; name a folder that is new or empty")
        try:
            (folder / ".partial").mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise output_error(folder, error) from error
        check_has_room(folder)

    def _take_lock(self) -> None:
        if self._scratch is not None:
            self._take_lock_at_address()
            return
        import fcntl  # noqa: PLC0415 - not on Windows

        path = self.local_folder / LOCK_FILE
        try:
            self._lock = path.open("a+", encoding="utf-8")
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise BatchError(self._describe_lock(read_text(path, error_type=BatchError))) from error
        except OSError as error:
            raise output_error(path, error) from error
        self._lock.truncate(0)
        self._lock.write(f"process {os.getpid()}")
        self._lock.flush()

    def _describe_lock(self, owner: str) -> str:
        return (
            f"another batch is writing into {self.output} ({owner or 'it does not say which'}); wait for its "
            "end, or name another folder"
        )

    def _take_lock_at_address(self) -> None:
        content = self.place.read(LOCK_FILE)
        if content:
            values = _parsed(content)
            if time.time() - float(values.get("renewed", 0)) < LOCK_PATIENCE:
                raise BatchError(self._describe_lock(str(values.get("owner", ""))))
        self._renew_lock()

    def _renew_lock(self) -> None:
        owner = f"process {os.getpid()}, batch {self.token[:8]}"
        self.place.write(LOCK_FILE, json.dumps({"owner": owner, "renewed": time.time()}).encode())

    def _fetch_journal(self) -> None:
        pieces = [name for name in self.place.names(PIECES_FOLDER) if name.endswith(".jsonl")]
        with (self.local_folder / JOURNAL_FILE).open("wb") as file:
            for name in pieces:
                file.write(self.place.read(f"{PIECES_FOLDER}/{name}") or b"")
        self._piece = 1 + max((int(name.removesuffix(".jsonl")) for name in pieces), default=0)
        self._num_synced = (self.local_folder / JOURNAL_FILE).stat().st_size

    def sync_if_due(self) -> None:
        """Put what the journal gained to the address, if it is time to."""
        if self._scratch is not None and time.monotonic() - self._synced_at >= SYNC_PERIOD:
            self.sync()

    def sync(self) -> None:
        """Put what the journal gained to the address; nothing for a folder of this machine."""
        if self._scratch is None:
            return
        self._synced_at = time.monotonic()
        self._renew_lock()
        with (self.local_folder / JOURNAL_FILE).open("rb") as file:
            file.seek(self._num_synced)
            gained = file.read()
        if gained:
            self.place.write(f"{PIECES_FOLDER}/{self._piece:08d}.jsonl", gained)
            self._num_synced += len(gained)
            self._piece += 1

    def write_tables(self, names: Sequence[str], rows: Callable[[], Iterable[Row]]) -> None:
        """Write the tables and the page.

        Parameters
        ----------
        names
            The columns.
        rows
            Gives the rows.

        Raises
        ------
        OutputError
            If one cannot be written.
        """
        page = SummaryPage(self.output, names)
        write_tables(self.local_folder, names, page.watch(rows()))
        LocalPlace(self.local_folder).write(PAGE_FILE, page.render().encode("utf-8", "backslashreplace"))
        if self._scratch is not None:
            for name in (CSV_FILE, PARQUET_FILE, PAGE_FILE):
                self.place.write(name, (self.local_folder / name).read_bytes())

    def close(self) -> None:
        """Give the folder free."""
        if hasattr(self, "journal"):
            self.journal.close()
        if self._lock is not None:
            self._lock.close()
            self._lock = None
        if self._scratch is not None:
            if hasattr(self, "journal"):
                self.place.write(LOCK_FILE, b"")
            shutil.rmtree(self._scratch, ignore_errors=True)


def _parsed(content: bytes) -> dict[str, Any]:
    try:
        values = parse_json(content.decode())
    except ValueError:
        return {}
    return values if isinstance(values, dict) else {}
