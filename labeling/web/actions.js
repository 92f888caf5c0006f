// What each key does, and what a digit chooses.

import { byId, describeLabel } from "/draw.js";
import { refuse } from "/commands.js";
import { allowSound } from "/sound.js";

const DECISIONS = ["label", "relabel", "second_label", "redo", "skip", "void"];
const KEEPS = { failure: "reason", redo: "cause", skip: "skip", undo: "earlier" }; // a key's own choice stays open
const WORDS = { relabel: "label", second_label: "label" };

export const decisionWord = (kind) => WORDS[kind] ?? kind;
const note = () => byId("note").value.trim();
const spaced = (words) => words.replaceAll("_", " ");

export class Actions {
  // send(command, said) and draw() are the page's.
  constructor(page, about, review, send, draw) {
    this.page = page;
    this.about = about;
    this.review = review;
    this.send = send;
    this.draw = draw;
  }

  // `action`: a name, {digit: n}, or {other: key}.
  perform(action) {
    const { page } = this;
    setTimeout(allowSound); // after the action: the first time it takes the browser a while
    if (!page.view && action !== "stop") return undefined;
    if (action.digit !== undefined) return this.choices()[action.digit - 1]?.run();
    if (action.other === "x") return this.leave();
    if (action.other) return page.view.mode === "review" ? this.review.key(action.other) : undefined;
    if (page.choosing && action !== "stop" && page.choosing !== KEEPS[action]) page.choosing = null;
    return this[action]();
  }

  // Once a command is on the disk.
  settled(command) {
    const { page, review } = this;
    const reviewing = page.view.mode === "review";
    if (DECISIONS.includes(command.kind)) {
      page.rotated = false;
      page.relabel = null;
      byId("note").value = "";
      if (reviewing) review.next();
    }
    if (command.kind === "undo" && !reviewing) page.relabel = command.trial_id;
    if (command.kind.startsWith("undo") && reviewing) review.goTo(command.trial_id);
    if (command.kind === "note") byId("note").value = "";
  }

  placed() {
    const { trial } = this.page.view;
    if (trial?.phase === "CONFIRM_POSE") return this.acceptPose(0);
    if (!trial || trial.phase !== "PLACE_OBJECT") return refuse("nothing is to be placed now");
    return this.tell("placed", trial, "placed");
  }

  success() { return this.verdict("success"); }

  rotated() {
    if (!this.target()) return undefined;
    this.page.rotated = !this.page.rotated;
    return this.draw();
  }

  failure() { return this.target() ? this.choose("reason") : undefined; }

  undo() {
    const { view, relabel } = this.page;
    const { undoable } = view;
    if (!undoable) return view.mode === "review" ? this.askEarlier() : refuse("there is nothing to undo");
    const open = relabel && this.about.target();
    if (open && !open.label) return refuse(`label trial ${open.number} first, or leave it with x`);
    return this.takeBack(undoable, `trial ${undoable.number}: its ${decisionWord(undoable.kind)} no longer holds`);
  }

  redo() { return this.running() ? this.choose("cause") : undefined; }

  skip() {
    if (!this.running()) return undefined;
    return this.page.choosing === "skip" ? this.doSkip() : this.choose("skip");
  }

  pause() {
    const { view } = this.page;
    if (view.mode === "review") return undefined;
    const kind = view.paused ? "resume" : "pause";
    return this.send({ kind, rev: view.control_rev }, `${kind}d`);
  }

  note() { byId("note").focus(); }

  stop() { return this.page.view?.mode === "review" ? undefined : this.send({ kind: "stop" }, "stopped"); }

  storeNote() {
    const trialId = this.about.subject()?.trial_id ?? null;
    return this.send({ kind: "note", trial_id: trialId, value: { text: note() } }, "note");
  }

  clearStop() {
    const rev = this.page.view.control_rev;
    return this.send({ kind: "clear_stop", rev, value: { confirm: true } }, "the stop is cleared");
  }

  leave() {
    this.page.choosing = this.page.relabel = null;
    return this.draw();
  }

  // What can be chosen now, in the order of the digits.
  choices() {
    const { terms, view, choosing } = this.page;
    const about = this.about.target();
    if (choosing === "reason") return terms.reasons.map(({ value, text }) => ({ text, run: () => this.verdict("failure", value) }));
    if (choosing === "cause") return terms.causes.map(({ value, text }) => ({ text, run: () => this.doRedo(value) }));
    if (choosing === "skip") return [{ text: "yes, skip this trial", run: () => this.doSkip() }];
    if (choosing === "earlier" && about) {
      const text = `yes: trial ${about.number}'s earlier label (${describeLabel(about.label)}) no longer holds`;
      return [{ text, run: () => this.takeBack(about, `trial ${about.number}: its earlier label no longer holds`) }];
    }
    if (choosing || view?.state !== "CONFIRM_POSE") return [];
    const rivals = view.trial.info.rivals ?? [];
    return [{ text: "pose 1 (best)", run: () => this.acceptPose(0) },
      ...rivals.map((rival, index) => ({ text: `pose ${index + 2}`, run: () => this.acceptPose(index + 1) })),
      { text: "none of them: put the object down again", run: () => this.tell("replace_object", view.trial, "put the object down again") }];
  }

  // ---- inside -------------------------------------------------------------------------------

  target() {
    const about = this.about.target();
    if (!about) refuse("no trial is waiting for a label");
    return about;
  }

  running() {
    if (this.page.view.mode !== "run") return null;
    const about = this.about.subject();
    if (!about) refuse("no trial is under way");
    return about;
  }

  tell(kind, trial, said, value = {}) {
    this.page.choosing = null;
    return this.send({ kind, trial_id: trial.trial_id, rev: trial.rev, value }, said);
  }

  choose(what) {
    this.page.choosing = this.page.choosing === what ? null : what;
    return this.draw();
  }

  verdict(outcome, reason) {
    const { page, review } = this;
    const about = this.target();
    if (!about) return undefined;
    const reviewing = page.view.mode === "review";
    if (reviewing && review.justCame()) return refuse(`trial ${about.number} has only just come up: look at it first`);
    const rotated = outcome === "success" && page.rotated;
    const value = { outcome, rotated, note: note(), ...(reason ? { reason } : {}) };
    if (about.kind === "relabel") value.found_by = reviewing ? review.foundBy : null;
    const said = `trial ${about.number} ${outcome}${rotated ? ", rotated" : ""}${reason ? ` (${spaced(reason)})` : ""}`;
    return this.tell(about.kind, about, said, value);
  }

  // A review undoes what this sitting decided; an earlier verdict only on its own trial, and asked.
  askEarlier() { return this.about.target()?.label ? this.choose("earlier") : refuse("there is nothing to undo"); }

  takeBack(trial, said) { return this.tell(this.page.view.second ? "undo_second" : "undo", trial, said); }

  doSkip() {
    const about = this.running();
    return this.tell("skip", about, `trial ${about.number} skipped`, { text: note() });
  }

  doRedo(cause) {
    const about = this.running();
    return this.tell("redo", about, `trial ${about.number} is taken again (${cause})`, { cause, note: note() });
  }

  acceptPose(rival) {
    return this.tell("accept_pose", this.page.view.trial, rival ? `pose ${rival + 1} accepted` : "best pose accepted", { rival });
  }
}
