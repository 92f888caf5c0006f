// What the keys are about: the trial that waits for a verdict, or one that is judged again.

export class About {
  constructor(page, review) {
    this.page = page;
    this.review = review;
    this.key = ""; // the trial and take that rotated and choosing belong to
  }

  target() {
    const { view, relabel } = this.page;
    if (!view) return null;
    if (view.mode === "review") {
      const trial = this.review.chosen();
      return trial ? { ...trial, kind: view.second ? "second_label" : "relabel" } : null;
    }
    if (relabel) {
      const trial = view.history.find((item) => item.trial_id === relabel);
      return trial ? { ...trial, kind: "relabel" } : null;
    }
    const { trial } = view;
    const due = trial && trial.status === "unlabelled" && trial.phase === "AWAITING_LABEL";
    return due ? { ...trial, kind: "label" } : null;
  }

  // The trial that redo and skip are about: the one the keys are about, else the one under way.
  subject() {
    return this.target() ?? this.page.view?.trial ?? null;
  }

  // What was begun for one take never ends up on another: somebody else may have labeled it.
  dropForeignChoices() {
    const about = this.subject();
    const key = about ? `${about.trial_id} ${about.take}` : "";
    if (key === this.key) return;
    this.key = key;
    this.page.rotated = false;
    this.page.choosing = null;
  }
}
