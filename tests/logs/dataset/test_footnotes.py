"""Models that know more than a rival, and the oracle, are told apart wherever they stand."""

from dataclasses import replace

from logs.dataset.labeled_trial import StoredScore
from logs.export.card import card_bytes
from logs.footnotes import footnotes, shared_with_engine


def test_settled_is_marked_on_simulated_labels_only():
    names = ("reach", "settled", "settled-robust", "dynamic")
    notes = footnotes(names, simulated=True)
    (fitted,) = (note for note in notes if "fitted on trials of this engine" in note)
    assert notes[fitted] == ["settled", "settled-robust"]
    assert shared_with_engine(names, simulated=True)
    assert not footnotes(names, simulated=False)
    assert not shared_with_engine(names, simulated=False)
    assert not shared_with_engine(["reach"], simulated=True)


def test_the_data_card_marks_scores_of_settled_and_tells_what_the_oracle_bounds(make_dataset):
    dataset = make_dataset(objects=1, grasps=1, repeats=2)
    score = {"settled-robust": StoredScore(0.5, "1", {})}
    scored = replace(dataset, trials=tuple(replace(one, scores=score) for one in dataset.trials))
    card = card_bytes(scored, ["trials.csv"]).decode()
    assert "Scores of settled-robust: its grade was fitted on trials of this engine" in card
    assert "bounds neither AR nor F1" in card
    physical = tuple(replace(one, simulated=False) for one in scored.trials)
    assert "fitted on" not in card_bytes(replace(scored, trials=physical), ["trials.csv"]).decode()
