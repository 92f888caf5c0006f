// The console's page: what a key means now, one command at a time, and what became of it.

import { byId, drawBanner, drawRelabelBanner, drawSession, drawTime, drawTrial, element, receipt, trialItem } from "/draw.js";
import { Keys, isTextField } from "/keys.js";
import { Link } from "/link.js";
import { Review } from "/review.js";
import { allowSound, play } from "/sound.js";
import { Stage } from "/stage.js";

const token = new URLSearchParams(location.hash.slice(1)).get("token") ?? sessionStorage.getItem("token") ?? "";
sessionStorage.setItem("token", token);
history.replaceState(null, "", "/"); // the token stays out of screenshots and bookmarks

const page = {
  view: null,
  viewAt: 0,
  terms: null,
  keys: null,
  rotated: false,
  choosing: null, // "reason", "cause" or "skip": what the next key answers
  relabel: null, // trial_id of a past trial the verdict keys are about
  pending: null, // the command without an answer yet
};

const link = new Link(token, onView, () => draw());
const stage = new Stage(link, onForwardedKey);
const review = new Review(link, () => draw());

// ---- what the keys are about ----------------------------------------------------------------

function target() {
  const { view } = page;
  if (!view) return null;
  if (view.mode === "review") {
    const trial = review.chosen();
    return trial ? { ...trial, kind: view.second ? "second_label" : "relabel" } : null;
  }
  if (page.relabel) {
    const trial = view.history.find((item) => item.trial_id === page.relabel);
    return trial ? { ...trial, kind: "relabel" } : null;
  }
  const { trial } = view;
  const due = trial && trial.status === "unlabelled" && trial.phase === "AWAITING_LABEL";
  return due ? { ...trial, kind: "label" } : null;
}

function effectiveState() {
  if (!page.view || !link.alive) return page.view?.state === "ENDED" ? "ENDED" : "LOST";
  return page.view.state;
}

// ---- commands -------------------------------------------------------------------------------

async function send(command, said) {
  if (!link.alive && command.kind !== "stop") return refuse("no connection: nothing was sent");
  if (page.pending && command.kind !== "stop") return refuse("the last command has no answer yet");
  const pending = { ...command, id: crypto.randomUUID() };
  if (command.kind !== "stop") page.pending = pending;
  draw();
  const answer = await link.send(pending);
  if (answer.status === "unconfirmed") {
    page.pending = command.kind === "stop" ? page.pending : { ...pending, unconfirmed: true, said };
    if (command.kind === "stop") refuse("THE STOP WAS NOT CONFIRMED: use the hardware stop", 10);
    return draw();
  }
  settle(answer, pending, said);
}

function settle(answer, command, said) {
  if (page.pending?.id === command.id) page.pending = null;
  if (answer.status === "stored" || answer.status === "duplicate") {
    receipt("stored", answer.message || `stored: ${said}`, answer.message ? 10 : 2.2);
    play(command.value?.outcome ?? "stored");
    afterStored(command);
  } else {
    refuse(`not stored: ${answer.message || answer.status}`);
  }
  draw();
}

function refuse(message, seconds = 4) {
  receipt("refused", message, seconds);
  play("refused");
}

function afterStored(command) {
  const decided = ["label", "relabel", "second_label", "redo", "skip", "void"].includes(command.kind);
  if (decided) {
    page.rotated = false;
    page.relabel = null;
    byId("note").value = "";
    if (page.view.mode === "review") review.next();
  }
  if (command.kind === "undo" && page.view.mode === "run") page.relabel = command.trial_id;
  if (command.kind === "note") byId("note").value = "";
}

// A view arrived after a command without an answer: it tells what became of it.
function resolvePending(view) {
  if (!page.pending?.unconfirmed) return;
  const stored = view.recent_commands.includes(page.pending.id);
  settle(stored ? { status: "stored" } : { status: "rejected", message: "the connection was lost before it arrived; press again" },
    page.pending, page.pending.said);
}

const note = () => byId("note").value.trim();

function verdict(outcome, reason) {
  const about = target();
  if (!about) return refuse("no trial is waiting for a label");
  page.choosing = null;
  const rotated = outcome === "success" && page.rotated;
  const value = { outcome, rotated, note: note(), ...(reason ? { reason } : {}) };
  if (about.kind === "relabel") value.found_by = page.view.mode === "review" ? review.foundBy : null;
  const said = `trial ${about.number} ${outcome}${rotated ? ", rotated" : ""}${reason ? ` (${reason.replaceAll("_", " ")})` : ""}`;
  return send({ kind: about.kind, trial_id: about.trial_id, rev: about.rev, value }, said);
}

// The trial that redo and skip are about: the one the keys are about, else the one under way.
function subject() {
  const about = target() ?? page.view?.trial;
  if (!about) refuse("no trial is under way");
  return about;
}

const ACTIONS = {
  placed() {
    const { trial } = page.view;
    if (trial?.phase === "CONFIRM_POSE") return acceptPose(0);
    if (!trial || trial.phase !== "PLACE_OBJECT") return refuse("nothing is to be placed now");
    return send({ kind: "placed", trial_id: trial.trial_id, rev: trial.rev }, "placed");
  },
  success: () => verdict("success"),
  rotated() {
    if (!target()) return refuse("no trial is waiting for a label");
    page.rotated = !page.rotated;
    return draw();
  },
  failure() {
    if (!target()) return refuse("no trial is waiting for a label");
    return choose("reason");
  },
  undo() {
    const undoable = page.view.undoable;
    if (!undoable) return refuse("there is nothing to undo");
    const open = page.relabel && target();
    if (open && !open.label) return refuse(`label trial ${open.number} first, or leave it with x`);
    const said = `trial ${undoable.number}: its ${undoable.kind} no longer holds`;
    return send({ kind: "undo", trial_id: undoable.trial_id, rev: undoable.rev }, said);
  },
  redo: () => subject() && page.view.mode === "run" && choose("cause"),
  skip: () => subject() && page.view.mode === "run" && (page.choosing === "skip" ? doSkip() : choose("skip")),
  pause() {
    const kind = page.view.paused ? "resume" : "pause";
    return send({ kind, rev: page.view.control_rev }, `${kind}d`);
  },
  note: () => byId("note").focus(),
  stop: () => page.view?.mode === "review" || send({ kind: "stop" }, "stopped"),
};

function choose(what) {
  page.choosing = page.choosing === what ? null : what;
  draw();
}

function doSkip() {
  const about = subject();
  page.choosing = null;
  return send({ kind: "skip", trial_id: about.trial_id, rev: about.rev, value: { text: note() } }, `trial ${about.number} skipped`);
}

function doRedo(cause) {
  const about = subject();
  page.choosing = null;
  const value = { cause, note: note() };
  return send({ kind: "redo", trial_id: about.trial_id, rev: about.rev, value }, `trial ${about.number} is taken again (${cause})`);
}

function acceptPose(rival) {
  const { trial } = page.view;
  return send({ kind: "accept_pose", trial_id: trial.trial_id, rev: trial.rev, value: { rival } }, rival ? `pose ${rival + 1} accepted` : "best pose accepted");
}

function replaceObject() {
  const { trial } = page.view;
  return send({ kind: "replace_object", trial_id: trial.trial_id, rev: trial.rev }, "put the object down again");
}

// What can be chosen now, in the order of the digits.
function choices() {
  if (page.choosing === "reason") return page.terms.reasons.map(({ value, text }) => ({ text, run: () => verdict("failure", value) }));
  if (page.choosing === "cause") return page.terms.causes.map(({ value, text }) => ({ text, run: () => doRedo(value) }));
  if (page.choosing === "skip") return [{ text: "yes, skip this trial", run: doSkip }];
  if (page.view?.state === "CONFIRM_POSE") {
    const rivals = page.view.trial.info.rivals ?? [];
    const poses = [{ text: "pose 1 (best)", run: () => acceptPose(0) },
      ...rivals.map((rival, index) => ({ text: `pose ${index + 2}`, run: () => acceptPose(index + 1) }))];
    return [...poses, { text: "none of them: put the object down again", run: replaceObject }];
  }
  return [];
}

// ---- keys and buttons -----------------------------------------------------------------------

function perform(action) {
  allowSound();
  if (!page.view && action !== "stop") return undefined;
  if (action.digit !== undefined) {
    const choice = choices()[action.digit - 1];
    return choice ? choice.run() : undefined;
  }
  if (action.other === "x") {
    page.choosing = page.relabel = null;
    return draw();
  }
  if (action.other) return page.view.mode === "review" ? review.key(action.other) : undefined;
  const keeps = { failure: "reason", redo: "cause", skip: "skip", stop: page.choosing }[action];
  if (page.choosing && page.choosing !== keeps) page.choosing = null;
  return ACTIONS[action]();
}

function onKey(event) {
  if (document.querySelector("dialog[open]") && event.key !== "Escape") return;
  const action = page.keys?.action(event) ?? (event.key === "Escape" ? "stop" : null);
  if (event.target instanceof HTMLButtonElement && (event.key === " " || event.key === "Enter") && !event.target.closest("dialog")) {
    event.preventDefault(); // a button that kept the focus never turns space into a second press
  }
  if (!action) return;
  if (!action.other) event.preventDefault();
  if (action === "stop" && event.repeat) return;
  perform(action);
}

// The embedded view took the keyboard: its page sends the keys on.
function onForwardedKey(key) {
  onKey({ key, repeat: false, target: document.body, preventDefault() {} });
}

function wire() {
  document.addEventListener("keydown", onKey);
  document.addEventListener("click", (event) => {
    const button = event.target.closest("button");
    if (!button) return;
    if (!button.closest("dialog")) button.blur();
    if (button.dataset.action) perform(button.dataset.action);
  });
  // Only a keyboard's key up activates a focused button: keydown was handled above.
  document.addEventListener("keyup", (event) => {
    if (event.key === " " && event.target instanceof HTMLButtonElement && !event.target.closest("dialog")) event.preventDefault();
  });
  byId("note").addEventListener("keydown", (event) => {
    if (event.key === "Enter") byId("note").blur();
  });
  byId("store-note").addEventListener("click", () => {
    const about = target() ?? page.view?.trial;
    send({ kind: "note", trial_id: about?.trial_id ?? null, value: { text: note() } }, "note");
  });
  byId("cancel-target").addEventListener("click", () => { page.relabel = null; draw(); });
  byId("clear-stop").addEventListener("click", () => byId("confirm-clear").showModal());
  byId("confirm-clear").addEventListener("close", (event) => {
    if (event.target.returnValue !== "yes") return;
    event.target.returnValue = "";
    send({ kind: "clear_stop", rev: page.view.control_rev, value: { confirm: true } }, "the stop is cleared");
  });
  byId("open-keys").addEventListener("click", () => { drawKeys(); byId("keys").showModal(); });
  byId("keys-default").addEventListener("click", () => { page.keys.reset(); drawLegend(); });
  setInterval(() => {
    const elapsed = page.view?.elapsed;
    if (elapsed != null && page.view.mode === "run" && page.view.state !== "ENDED") drawTime(elapsed + (performance.now() - page.viewAt) / 1000);
  }, 500);
}

function drawLegend() {
  document.querySelectorAll("kbd[data-key]").forEach((cap) => { cap.textContent = page.keys.label(cap.dataset.key); });
}

function drawKeys() {
  const rows = Object.keys(page.keys.defaults).filter((action) => action !== "stop").map((action) => {
    const button = element("button", { type: "button", textContent: page.keys.label(action) });
    button.addEventListener("click", () => {
      button.textContent = "press a key …";
      byId("keys").addEventListener("keydown", (event) => {
        event.preventDefault();
        const problem = event.key === "Escape" ? "" : page.keys.bind(action, event.key);
        if (problem) refuse(problem);
        drawLegend();
        drawKeys();
      }, { once: true });
    });
    return element("tr", {}, element("td", { textContent: action }), element("td", {}, button));
  });
  byId("key-table").replaceChildren(...rows);
}

// ---- drawing --------------------------------------------------------------------------------

function onView(view) {
  const asked = page.view?.trial?.phase;
  page.view = view;
  page.viewAt = performance.now();
  resolvePending(view);
  if (view.trial?.phase === "AWAITING_LABEL" && asked && asked !== "AWAITING_LABEL") play("ask");
  if (page.relabel && !view.history.some((item) => item.trial_id === page.relabel)) page.relabel = null;
  if (view.mode === "review") review.refresh(view);
  draw();
}

function draw() {
  const { view } = page;
  const state = effectiveState();
  byId("unconfirmed").hidden = !page.pending?.unconfirmed;
  if (!view) return drawBanner(state, null, null, link.problem);
  drawSession(view, link.alive);
  const about = target();
  const trial = view.mode === "review" ? review.shown(view) : view.trial;
  drawBanner(state, trial, view, link.problem);
  const again = view.mode === "review" ? about : about?.kind === "relabel" ? about : null;
  drawRelabelBanner(["LOST", "STOPPED"].includes(state) ? null : again);
  byId("cancel-target").hidden ||= view.mode === "review";
  drawTrial(trial, state);
  drawActions(state, about);
  const items = view.history.map((item) => trialItem(item, item.trial_id === page.relabel, (chosen) => {
    if (chosen.status !== "skipped") page.relabel = chosen.trial_id;
    draw();
  }));
  byId("history").replaceChildren(...items);
  byId("past").hidden = byId("by-object").hidden = view.mode === "review";
  stage.draw(view, trial);
}

function drawActions(state, about) {
  const { view } = page;
  const usable = link.alive && !page.pending;
  const placing = view.trial?.phase === "PLACE_OBJECT" && !view.trial.placed && view.mode === "run" && !page.relabel;
  const may = (id, allowed) => { byId(id).disabled = !(usable && allowed && state !== "STOPPED" && state !== "ENDED"); };
  byId("do-placed").hidden = !placing;
  may("do-placed", placing && state === "PLACE_OBJECT");
  ["do-success", "do-failure", "do-rotated"].forEach((id) => { byId(id).hidden = placing; may(id, Boolean(about)); });
  byId("do-rotated").setAttribute("aria-pressed", String(page.rotated));
  may("do-undo", Boolean(view.undoable));
  byId("undo-text").textContent = view.undoable ? `Undo ${view.undoable.kind} of ${view.undoable.number}` : "Undo";
  const moving = view.trial?.phase === "EXECUTE";
  for (const id of ["do-redo", "do-skip"]) {
    byId(id).hidden = view.mode === "review";
    may(id, Boolean(about ?? view.trial) && !moving);
  }
  byId("do-pause").hidden = view.mode === "review";
  may("do-pause", true);
  byId("pause-text").textContent = view.paused ? "Resume" : "Pause";
  drawChoices(usable);
}

function drawChoices(usable) {
  const box = byId("choices");
  const offered = choices();
  box.hidden = !offered.length;
  box.className = page.choosing === "reason" ? "failure" : "";
  box.replaceChildren(...offered.map(({ text, run }, index) => {
    const button = element("button", { type: "button", disabled: !usable }, element("span", { textContent: text }), element("kbd", { textContent: index + 1 }));
    button.addEventListener("click", () => { allowSound(); run(); });
    return button;
  }));
}

// ---- start ----------------------------------------------------------------------------------

wire();
draw();
link.start();
for (;;) {
  try {
    page.terms = await link.json("/api/terms");
    break;
  } catch (error) {
    link.problem ||= String(error.message);
    await new Promise((done) => setTimeout(done, 500));
  }
}
page.keys = new Keys(page.terms.keys);
byId("rule").textContent = page.terms.rule;
drawLegend();
draw();
window.focus();
document.body.dataset.ready = "true";
if (isTextField(document.activeElement)) document.activeElement.blur();
