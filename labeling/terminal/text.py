"""The terminal console's words: plain functions of a view."""

from __future__ import annotations

from typing import Any, Final

from rich.markup import escape
from rich.table import Table
from rich.text import Text

View = dict[str, Any]

_BANNERS: Final = {
    "READY": "Getting ready",
    "PLACE_OBJECT": "Place: {object} -- then Enter",
    "CAPTURE": "Looking",
    "REGISTER": "Finding the object",
    "CONFIRM_POSE": "Which pose is right?",
    "EXECUTE": "The robot moves: keep clear",
    "AWAITING_LABEL": "Was it stably lifted?  {object}",
    "RESET": "Going home",
    "REVIEW": "Recorded trials are looked at on the page, in a browser",
    "PAUSED": "Paused: nothing new starts",
    "HELD": "The station holds: {holds}",
    "STOPPED": "STOPPED -- c clears the stop",
    "ENDED": "The session has ended (ctrl+q leaves)",
    "LOST": "CONNECTION LOST: keys do nothing until it is back",
}


def banner(state: str, view: View | None, again: View | None) -> Text:
    """The one line that says what is asked of the operator."""
    if again is not None and state != "LOST":
        return Text(f"Label trial {again['number']} again: {again['object']}  (x leaves it)")
    trial = (view or {}).get("trial") or {}
    holds = "; ".join((view or {}).get("holds", {}).values())
    return Text(_BANNERS[state].format(object=trial.get("object", ""), holds=holds))


def counters(view: View, *, alive: bool) -> Text:
    """Counts and lights in one line."""
    counts = view["counts"]
    lights = [(name, alive and light["ok"]) for name, light in sorted(view["lights"].items())] + [
        ("connection", alive)
    ]
    shown = "  ".join(f"{name} {'ok' if ok else 'LOST'}" for name, ok in lights)
    marks = "".join(
        f"  [{word}]"
        for word, on in (("practice", view["practice"]), ("simulated", view["simulated"]))
        if on
    )
    left = view["disk_left"]
    disk = "" if left is None else f"  disk: {left} trials left{' !' if view['disk_low'] else ''}"
    return Text(
        f"  {counts['labelled']} of {counts['planned']} labeled"
        f"  {counts['unlabelled']} to label  {counts['redone']} redone"
        f"  {counts['voided']} void  {counts['skipped']} skipped{disk}  |  {shown}{marks}"
    )


def trial_text(view: View, *, rotated: bool) -> Table:
    """The trial under way."""
    table = Table.grid(padding=(0, 2))
    trial = view["trial"]
    if trial is None:
        return table
    take = f", take {trial['take']}" if trial["take"] > 1 else ""
    table.add_row("trial", f"{trial['number']} of {view['of']}{take}")
    table.add_row("object", escape(trial["object"]))
    table.add_row("step", trial["phase"].replace("_", " ").lower())
    if trial["again_because"]:
        table.add_row("once more", escape(trial["again_because"]))
    for name, value in (trial["info"].get("registration") or {}).items():
        shown = f"{value:.3g}" if isinstance(value, float) else str(value)
        table.add_row(escape(name.replace("_", " ")), escape(shown))
    table.add_row("", "")
    table.add_row("rotated", "YES (t)" if rotated else "no (t)")
    for name, (good, every) in view["success"].items():
        table.add_row(escape(name), f"{good} of {every} lifted" if every else "-")
    return table


def history(view: View, chosen: str | None) -> Table:
    """The last trials, newest first."""
    table = Table.grid(padding=(0, 2))
    for item in view["history"][:15]:
        label = item["label"]
        said = "unlabeled"
        if item["status"] == "skipped":
            said = "skipped"
        elif label:
            said = label["outcome"] + (", rotated" if label["rotated"] else "")
            said += f": {label['reason'].replace('_', ' ')}" if label["reason"] else ""
        scores = "  ".join(f"{name} {value:.2f}" for name, value in item.get("scores", {}).items())
        mark = ">" if item["trial_id"] == chosen else " "
        table.add_row(mark, str(item["number"]), escape(item["object"]), said, scores)
    return table


def choices_text(offered: list[tuple[str, str]]) -> Text:
    """What the digits choose among now."""
    return Text("   ".join(f"{index} {words}" for index, (_, words) in enumerate(offered, start=1)))


def legend(terms: View) -> Text:
    """Keys, and the one rule."""
    keys = terms.get("keys", {})
    shown = "  ".join(f"{key} {name}" for name, key in keys.items() if name != "stop")
    stop = "Esc SOFTWARE STOP  x leave  ctrl+q quit"
    return Text(f"{shown}  {stop}\n{terms.get('rule', '')}" if keys else "")
