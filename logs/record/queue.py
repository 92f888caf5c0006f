"""What waits to be written to a record: results are never dropped, measurements may be."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from google.protobuf.message import Message

from logs.record import encode, topics
from logs.record.background import BackgroundWriter
from logs.record.mcap_file import DurableMcap
from logs.record.records import TrialEvent, gap_event

_SMALL = 1024


class RecordQueue:
    """Stamps messages with the time of their receipt and hands them to the writer's thread.

    Args:
        file: the record.
        now: the clock of receipt [ns].
        backlog_limit: how much may wait for the disk [bytes].
    """

    def __init__(self, file: DurableMcap, now: Callable[[], int], backlog_limit: int) -> None:
        self.writer = BackgroundWriter(file, backlog_limit)
        self._now = now
        self._dropped: Counter[str] = Counter()
        self._sequences: dict[str, int] = {}

    def result(self, topic: str, message: Message, time_ns: int) -> None:
        """Queue a message that is never dropped.

        Raises:
            RecordWriteError: if the disk failed.
        """
        self.writer.refuse_failed()
        self.writer.add_message(topic, lambda: message, time_ns, self._now(), _SMALL)

    def event(self, event: TrialEvent) -> None:
        """Queue an event, and its line for people; never dropped, and never an error."""
        typed, line = encode.encode_event(event), encode.encode_event_log(event)
        received = self._now()
        self.writer.add_message(topics.EVENT, lambda: typed, event.time_ns, received, _SMALL)
        self.writer.add_message(topics.LOG, lambda: line, event.time_ns, received, _SMALL)

    def sample(
        self,
        topic: str,
        message: Callable[[], Message],
        time_ns: int,
        sequence: int | None = None,
        size: int = _SMALL,
    ) -> None:
        """Queue a measurement; drop and count it if too much waits for the disk.

        Args:
            topic: the channel.
            message: builds the message, in the writer's thread.
            time_ns: of capture [ns].
            sequence: the device's own counter; a hole in it is recorded as a gap.
            size: of what waits, about [bytes].
        """
        if sequence is not None:
            self._watch(topic, sequence, time_ns)
        if self.writer.fits(size):
            self.writer.add_message(topic, message, time_ns, self._now(), size)
        else:
            self._dropped[topic] += 1

    def tell_dropped(self, time_ns: int) -> None:
        """Queue a gap for each channel that lost measurements."""
        for topic, count in sorted(self._dropped.items()):
            self.event(gap_event(topic, count, "the disk did not keep up", time_ns))

    def _watch(self, topic: str, sequence: int, time_ns: int) -> None:
        """Record a gap if a device's own counter jumped."""
        last = self._sequences.get(topic)
        self._sequences[topic] = sequence
        if last is not None and sequence != last + 1:
            why = f"the device's counter went from {last} to {sequence}"
            self.event(gap_event(topic, max(sequence - last - 1, 0), why, time_ns))
