// The console's page: what a key means now, one command at a time, and what became of it.

import { drawActions, drawChoices } from "/buttons.js";
import { byId, describeLabel, drawBanner, drawRelabelBanner, drawSession, drawTime, drawTrial, redraw, trialItem } from "/draw.js";
import { Commands, refuse } from "/commands.js";
import { Keys, isTextField } from "/keys.js";
import { drawKeyTable, drawLegend } from "/legend.js";
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
  choosing: null, // "reason", "cause", "skip" or "earlier": what the next digit answers
  relabel: null, // trial_id of a past trial the verdict keys are about
  about: "", // the trial and take that rotated and choosing belong to
};

const link = new Link(token, { onView, onEnd, onHealth: () => draw() });
const commands = new Commands(link, () => draw(), afterStored);
const send = (command, said) => commands.send(command, said);
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

// What was begun for one take never ends up on another: somebody else may have labeled it.
function dropForeignChoices() {
  const about = target() ?? page.view?.trial;
  const key = about ? `${about.trial_id} ${about.take}` : "";
  if (key === page.about) return;
  page.about = key;
  page.rotated = false;
  page.choosing = null;
}

function effectiveState() {
  if (!page.view || !link.alive) return page.view?.state === "ENDED" ? "ENDED" : "LOST";
  return page.view.state;
}

// ---- commands -------------------------------------------------------------------------------

function afterStored(command) {
  const decided = ["label", "relabel", "second_label", "redo", "skip", "void"].includes(command.kind);
  if (decided) {
    page.rotated = false;
    page.relabel = null;
    byId("note").value = "";
    if (page.view.mode === "review") review.next();
  }
  if (command.kind === "undo" && page.view.mode === "run") page.relabel = command.trial_id;
  if (command.kind === "undo" && page.view.mode === "review") review.goTo(command.trial_id);
  if (command.kind === "note") byId("note").value = "";
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
    if (!undoable) return page.view.mode === "review" ? takeBack() : refuse("there is nothing to undo");
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

// A review undoes what this sitting decided; an earlier verdict only on its own trial, and asked.
function takeBack() {
  const about = target();
  if (page.view.second) return refuse("nothing to undo: a new verdict on the trial replaces yours");
  if (!about?.label) return refuse("there is nothing to undo");
  return choose("earlier");
}

function doTakeBack() {
  const about = target();
  page.choosing = null;
  return send({ kind: "undo", trial_id: about.trial_id, rev: about.rev }, `trial ${about.number}: its earlier label no longer holds`);
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
  if (page.choosing === "earlier") {
    const about = target();
    const text = `yes: trial ${about?.number}'s earlier label (${describeLabel(about?.label)}) no longer holds`;
    return about ? [{ text, run: doTakeBack }] : [];
  }
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
  const keeps = { failure: "reason", redo: "cause", skip: "skip", undo: "earlier", stop: page.choosing }[action];
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
  byId("open-keys").addEventListener("click", () => { drawKeyTable(page.keys, refuse); byId("keys").showModal(); });
  byId("keys-default").addEventListener("click", () => { page.keys.reset(); drawLegend(page.keys); });
  setInterval(() => {
    const elapsed = page.view?.elapsed;
    if (elapsed != null && page.view.mode === "run" && page.view.state !== "ENDED") drawTime(elapsed + (performance.now() - page.viewAt) / 1000);
  }, 500);
}

// ---- drawing --------------------------------------------------------------------------------

// A past trial whose label is given again: its recording and name, not the present trial's.
function shownAgain(about) {
  return { ...about, of: page.view.counts.planned, stable_pose: null, phase: "AWAITING_LABEL", pictures: [] };
}

function onEnd() {
  if (page.view) page.view.state = "ENDED";
  draw();
}

function onView(view) {
  const asked = page.view?.trial?.phase;
  page.view = view;
  page.viewAt = performance.now();
  commands.resolve(view);
  if (view.trial?.phase === "AWAITING_LABEL" && asked && asked !== "AWAITING_LABEL") play("ask");
  if (page.relabel && !view.history.some((item) => item.trial_id === page.relabel)) page.relabel = null;
  if (view.mode === "review") review.refresh(view);
  draw();
}

// Views come in bursts: the page is painted once a frame, so that a key is never behind a queue.
let painting = 0;

function draw() {
  dropForeignChoices();
  painting ||= requestAnimationFrame(paint);
}

function paint() {
  painting = 0;
  const { view } = page;
  const state = effectiveState();
  byId("unconfirmed").hidden = !commands.pending?.unconfirmed;
  if (!view) return drawBanner(state, null, null, link.problem);
  drawSession(view, link.alive);
  const about = target();
  const past = about?.kind === "relabel" && view.mode === "run";
  const trial = view.mode === "review" ? review.shown(view) : past ? shownAgain(about) : view.trial;
  drawBanner(state, view.trial, view, link.problem);
  const again = view.mode === "review" ? about : about?.kind === "relabel" ? about : null;
  drawRelabelBanner(["LOST", "STOPPED"].includes(state) ? null : again);
  byId("cancel-target").hidden ||= view.mode === "review";
  drawTrial(trial, state);
  const usable = link.alive && !commands.pending;
  drawActions(page, state, about, usable);
  drawChoices(page, choices(), usable, allowSound);
  redraw(byId("history"), [view.history, page.relabel], () => view.history.map((item) => (
    trialItem(item, item.trial_id === page.relabel, (chosen) => {
      if (chosen.status !== "skipped") page.relabel = chosen.trial_id;
      draw();
    }))));
  byId("past").hidden = byId("by-object").hidden = view.mode === "review";
  stage.draw(view, trial);
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
drawLegend(page.keys);
draw();
window.focus();
document.body.dataset.ready = "true";
if (isTextField(document.activeElement)) document.activeElement.blur();
