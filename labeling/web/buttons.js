// The buttons below: which there are now, which may be pressed, and what can be chosen by a digit.

import { decisionWord } from "/actions.js";
import { byId, element, redraw, text } from "/draw.js";

// `judging`: verdicts are taken; `usable`: everything else is.
export function drawActions(page, state, about, usable, judging) {
  const { view } = page;
  const reviewing = view.mode === "review";
  const placing = view.trial?.phase === "PLACE_OBJECT" && !view.trial.placed && !reviewing && !page.relabel;
  const open = state !== "STOPPED" && state !== "ENDED";
  const may = (id, allowed) => { byId(id).disabled = !(usable && allowed && open); };
  byId("do-placed").hidden = !placing;
  may("do-placed", placing && state === "PLACE_OBJECT");
  const choosing = state === "CONFIRM_POSE" && !about;
  ["do-success", "do-failure", "do-rotated"].forEach((id) => { byId(id).hidden = placing || choosing; may(id, judging && Boolean(about)); });
  byId("do-rotated").setAttribute("aria-pressed", String(page.rotated));
  const earlier = reviewing && about?.label;
  may("do-undo", Boolean(view.undoable || earlier));
  text("undo-text", view.undoable ? `Undo ${decisionWord(view.undoable.kind)} of ${view.undoable.number}`
    : earlier ? `Take back ${about.number}'s label …` : "Undo");
  const moving = view.trial?.phase === "EXECUTE";
  for (const id of ["do-redo", "do-skip"]) {
    byId(id).hidden = reviewing;
    may(id, Boolean(about ?? view.trial) && !moving);
  }
  byId("do-pause").hidden = reviewing;
  may("do-pause", true);
  text("pause-text", view.paused ? "Resume" : "Pause");
}

// `offered`: [{text, run}], in the order of the digits; `pressed()` comes before each run.
export function drawChoices(page, offered, usable, pressed) {
  const box = byId("choices");
  box.hidden = !offered.length;
  box.className = page.choosing === "reason" ? "failure" : "";
  redraw(box, [page.choosing, usable, offered.map(({ text }) => text)], () => offered.map(({ text, run }, index) => {
    const button = element("button", { type: "button", disabled: !usable }, element("span", { textContent: text }), element("kbd", { textContent: index + 1 }));
    button.addEventListener("click", () => { pressed(); run(); });
    return button;
  }));
}
