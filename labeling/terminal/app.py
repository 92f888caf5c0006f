"""The terminal console: the page's keys over SSH, and when no browser is at hand."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from typing import Any, ClassVar, Final

import httpx
from rich.text import Text
from textual import events, work
from textual.app import App, ComposeResult
from textual.containers import Horizontal, Vertical
from textual.widgets import Input, Static

from labeling.terminal.link import TerminalLink
from labeling.terminal.text import banner, choices_text, counters, history, legend, trial_text

ALIVE_PERIOD: Final = 1.5
RETRY_SECONDS: Final = 0.4

SHOWN_LINES: Final = 4

Command = dict[str, Any]


class TerminalConsole(App[None]):
    """Draws views and sends commands; knows nothing the page does not know.

    Args:
        link: an open connection to a console's server.
        lines: what the session tells, if it runs in this terminal; the last ones are shown.
        over: whether the session has ended; then the console leaves.
    """

    CSS = """
    #banner { height: 3; padding: 1 2; text-style: bold; background: $primary; }
    #banner.AWAITING_LABEL { background: purple; }
    #banner.CONFIRM_POSE, #banner.PAUSED, #banner.HELD { background: darkgoldenrod; }
    #banner.STOPPED, #banner.LOST { background: darkred; }
    #body { height: 1fr; }
    #trial, #history { padding: 1 2; width: 1fr; }
    #lines { padding: 0 2; height: auto; max-height: 4; color: $text-muted; }
    #choices { padding: 0 2; height: auto; color: $warning; }
    #receipt { padding: 0 2; height: 1; text-style: bold; }
    #receipt.stored { background: green; }
    #receipt.refused { background: darkgoldenrod; color: black; }
    #legend { padding: 0 2; height: auto; color: $text-muted; }
    """
    AUTO_FOCUS = None  # the keys are the operator's, not the note's
    BINDINGS: ClassVar = [("ctrl+q", "quit", "leave")]

    def __init__(
        self,
        link: TerminalLink,
        lines: Sequence[str] = (),
        over: Callable[[], bool] = lambda: False,
    ) -> None:
        super().__init__()
        self._link = link
        self._lines = lines
        self._over = over
        self._view: dict[str, Any] | None = None
        self._terms: dict[str, Any] = {}
        self._keys: dict[str, str] = {}
        self._choosing: str | None = None
        self._relabel: str | None = None
        self._rotated = False
        self._about_take: tuple[str | None, int | None] = (None, None)
        self._pending: Command | None = None
        self._note = ""
        # Held, not looked up: a view may still arrive while the screen is being taken down.
        self._banner = Static("", id="banner")
        self._counters = Static("", id="counters")
        self._trial = Static("", id="trial")
        self._history = Static("", id="history")
        self._newest_lines = Static("", id="lines")
        self._choices = Static("", id="choices")
        self._receipt = Static("", id="receipt")
        self._note_field = Input(placeholder="note (n); Enter leaves the field", id="note")
        self._legend = Static("", id="legend")

    def compose(self) -> ComposeResult:
        """Lay the console out."""
        yield self._banner
        yield self._counters
        with Horizontal(id="body"):
            yield Vertical(self._trial)
            yield Vertical(self._history)
        yield self._newest_lines
        yield self._choices
        yield self._receipt
        yield self._note_field
        yield self._legend

    def on_mount(self) -> None:
        """Start to follow the server."""
        self.follow()
        self.set_interval(ALIVE_PERIOD, self._link.say_alive)
        self.set_interval(0.25, self.draw)

    @work(exclusive=True)
    async def follow(self) -> None:
        """Take in views for ever; a lost connection shows, and is tried again."""
        while True:
            try:
                if not self._terms:
                    self._terms = await self._link.terms()
                    self._keys = {key.lower(): name for name, key in self._terms["keys"].items()}
                async for view in self._link.views():
                    self._take_in(view)
            except httpx.HTTPError as error:
                self.log(error)
            self.draw()
            await asyncio.sleep(RETRY_SECONDS)

    async def on_unmount(self) -> None:
        """Close the connection."""
        await self._link.close()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Enter leaves the note; its text goes with the next decision."""
        self._note = event.value.strip()
        self.set_focus(None)

    async def on_key(self, event: events.Key) -> None:
        """Turn a key into an action; in the note only Escape is one, and it stops."""
        if event.key == "escape":
            event.stop()
            await self._send({"kind": "stop"}, "stopped")
            return
        if isinstance(self.focused, Input):
            return
        if event.key in ("space", "tab"):
            event.stop()
            event.prevent_default()
            return
        await self._act(event.key)

    # -- acting ---------------------------------------------------------------------------

    async def _act(self, key: str) -> None:
        if self._view is None:
            return
        if key.isdigit():
            await self._choose(int(key) - 1)
            return
        if key == "x":
            self._choosing = self._relabel = None
        elif key == "c" and self._view["stopped"]:
            self._choosing = "clear"
        else:
            await self._named(self._keys.get(key, ""))
        self.draw()

    async def _named(self, name: str) -> None:
        assert self._view is not None
        trial = self._view["trial"]
        match name:
            case "placed" if trial and trial["phase"] == "CONFIRM_POSE":
                await self._about(trial, "accept_pose", "best pose accepted", rival=0)
            case "placed" if trial:
                await self._about(trial, "placed", "placed")
            case "success":
                await self._verdict({"outcome": "success", "rotated": self._rotated})
            case "failure" | "redo" | "skip":
                wanted = {"failure": "reason", "redo": "cause", "skip": "skip"}[name]
                self._choosing = None if self._choosing == wanted else wanted
            case "rotated":
                self._rotated = not self._rotated
            case "undo":
                await self._undo()
            case "pause":
                kind = "resume" if self._view["paused"] else "pause"
                await self._send({"kind": kind, "rev": self._view["control_rev"]}, f"{kind}d")
            case "note":
                self._note_field.focus()

    def offered(self) -> list[tuple[str, str]]:
        """What the digits choose among now: value and words."""
        if self._view is None:
            return []
        if self._choosing == "reason":
            return [(item["value"], item["text"]) for item in self._terms["reasons"]]
        if self._choosing == "cause":
            return [(item["value"], item["text"]) for item in self._terms["causes"]]
        if self._choosing == "skip":
            return [("skip", "yes, skip this trial")]
        if self._choosing == "clear":
            return [("clear", "everyone is clear of the robot: clear the stop")]
        if self._view["state"] == "CONFIRM_POSE":
            rivals = self._view["trial"]["info"].get("rivals", [])
            poses = [(str(n), f"pose {n + 1}") for n in range(len(rivals) + 1)]
            return [*poses, ("replace", "none of them: put the object down again")]
        return []

    async def _choose(self, index: int) -> None:
        offered = self.offered()
        if not 0 <= index < len(offered) or self._view is None:
            return
        value, what = offered[index][0], self._choosing
        self._choosing = None
        trial = self._target() or self._view["trial"]
        if what == "clear":
            rev = self._view["control_rev"]
            command = {"kind": "clear_stop", "rev": rev, "value": {"confirm": True}}
            await self._send(command, "the stop is cleared")
        elif trial is None:
            self._refuse("no trial is under way")
        elif what == "reason":
            await self._verdict({"outcome": "failure", "reason": value})
        elif what == "cause":
            await self._about(trial, "redo", f"taken again ({value})", cause=value, note=self._note)
        elif what == "skip":
            await self._about(trial, "skip", "skipped", text=self._note)
        elif value == "replace":
            await self._about(trial, "replace_object", "put the object down again")
        else:
            await self._about(trial, "accept_pose", "pose accepted", rival=int(value))

    def _target(self) -> dict[str, Any] | None:
        """The trial that a verdict is about."""
        if self._view is None:
            return None
        if self._relabel is not None:
            items = self._view["history"]
            found = next((item for item in items if item["trial_id"] == self._relabel), None)
            return {**found, "kind": "relabel"} if found else None
        trial = self._view["trial"]
        due = trial and trial["status"] == "unlabelled" and trial["phase"] == "AWAITING_LABEL"
        return {**trial, "kind": "label"} if due else None

    async def _verdict(self, value: dict[str, Any]) -> None:
        about = self._target()
        if about is None:
            self._refuse("no trial is waiting for a label")
            return
        said = f"trial {about['number']}: {value['outcome']} {value.get('reason', '')}".strip()
        await self._about(about, about["kind"], said, **value, note=self._note)

    async def _undo(self) -> None:
        assert self._view is not None
        undoable, open_trial = self._view["undoable"], self._target()
        if undoable is None:
            self._refuse("there is nothing to undo")
        elif self._relabel is not None and open_trial and not open_trial["label"]:
            self._refuse(f"label trial {open_trial['number']} first, or leave it with x")
        else:
            said = f"trial {undoable['number']}: its {undoable['kind']} no longer holds"
            await self._about(undoable, "undo", said)

    async def _about(self, trial: dict[str, Any], kind: str, said: str, **value: Any) -> None:
        command = {"kind": kind, "trial_id": trial["trial_id"], "rev": trial["rev"], "value": value}
        await self._send(command, said)

    async def _send(self, command: Command, said: str) -> None:
        stop = command["kind"] == "stop"
        if not stop and not self._link.alive:
            self._refuse("no connection: nothing was sent")
            return
        if not stop and self._pending is not None:
            self._refuse("the last command has no answer yet")
            return
        self._pending = None if stop else command
        answer = await self._link.send(command)
        if answer["status"] == "unconfirmed":
            self._pending = None if stop else {**command, "id": answer["id"], "said": said}
            self._refuse("UNCONFIRMED: not stored as far as this console knows")
            return
        self._settle(answer, command, said)

    def _settle(self, answer: dict[str, Any], command: Command, said: str) -> None:
        self._pending = None
        if answer["status"] not in ("stored", "duplicate"):
            self._refuse(f"not stored: {answer.get('message') or answer['status']}")
            return
        if command["kind"] in ("label", "relabel", "redo", "skip"):
            self._rotated, self._relabel, self._note = False, None, ""
            self._note_field.value = ""
        if command["kind"] == "undo":
            self._relabel = command["trial_id"]
        self._tell("stored", answer.get("message") or f"stored: {said}")

    # -- showing --------------------------------------------------------------------------

    def _take_in(self, view: dict[str, Any]) -> None:
        self._view = view
        pending = self._pending
        if pending is not None and "id" in pending:  # a command without an answer: the view tells
            stored = pending["id"] in view["recent_commands"]
            answer = {"status": "stored" if stored else "rejected", "message": "press again"}
            self._settle(
                {**answer, **({"message": ""} if stored else {})}, pending, pending["said"]
            )
        if self._relabel not in [item["trial_id"] for item in view["history"]]:
            self._relabel = None
        self._drop_foreign_choices()
        self.draw()

    def _drop_foreign_choices(self) -> None:
        """What was begun for one take never ends up on another: somebody else may have decided."""
        about = self._target() or (self._view or {}).get("trial") or {}
        if self._about_take != (about.get("trial_id"), about.get("take")):
            self._about_take = (about.get("trial_id"), about.get("take"))
            self._rotated = False
            if self._choosing != "clear":
                self._choosing = None

    def _refuse(self, message: str) -> None:
        self.bell()
        self._tell("refused", message)

    def _tell(self, kind: str, message: str) -> None:
        self._receipt.set_classes(kind)
        self._receipt.update(message)
        self.draw()

    def draw(self) -> None:
        """Show the newest view."""
        if self._over():
            self.exit()
        newest = list(self._lines)[-SHOWN_LINES:]
        self._newest_lines.update(Text("\n".join(newest)))
        view, alive = self._view, self._link.alive
        state = view["state"] if view and (alive or view["state"] == "ENDED") else "LOST"
        self._banner.set_classes(state)
        target = self._target()
        again = target if target and target["kind"] == "relabel" and state != "STOPPED" else None
        self._banner.update(banner(state, view, again))
        self._legend.update(legend(self._terms))
        self._choices.update(choices_text(self.offered()))
        if view is None:
            return
        self._counters.update(counters(view, alive=alive))
        self._trial.update(trial_text(view, rotated=self._rotated))
        self._history.update(history(view, self._relabel))
