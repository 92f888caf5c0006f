"""The HTTP interface over a real socket: commands, the stream, pictures, blindness, shutdown."""

from __future__ import annotations

import json
import threading
from collections import Counter
from collections.abc import Iterator
from typing import Any

import httpx
import pytest

from labeling.control.commands import Actor
from labeling.server.presence import SILENCE_LIMIT, Presence
from logs.journal.events import Source
from logs.journal.file import read_journal

BO = Actor("bo", Source.OPERATOR)

PNG = b"\x89PNG\r\n\x1a\n" + b"pixels"


def messages(response: httpx.Response) -> Iterator[tuple[str, dict[str, Any]]]:
    event = ""
    for line in response.iter_lines():
        if line.startswith("event: "):
            event = line.removeprefix("event: ")
        elif line.startswith("data: "):
            yield event, json.loads(line.removeprefix("data: "))


def post(
    client: httpx.Client, bench: Any, kind: str, number: int | None = None, **value: Any
) -> Any:
    body = bench.command(kind, number, **value).model_dump(mode="json")
    return client.post("/api/commands", json={**body, "tick": bench.controller.tick()})


def test_a_label_over_the_api_is_the_server_s_operators(
    bench: Any, serve: Any, client_of: Any
) -> None:
    client = client_of(serve(bench))
    bench.executed()
    answer = post(client, bench, "label", 1, outcome="success").json()
    assert answer["status"] == "stored"
    assert bench.trial(1).label.operator == "ann"


def test_the_body_cannot_name_its_actor(bench: Any, serve: Any, client_of: Any) -> None:
    client = client_of(serve(bench))
    bench.executed()
    body = bench.command("label", 1, outcome="success").model_dump(mode="json")
    answer = client.post("/api/commands", json={**body, "tick": 0, "actor": "mallory"})
    assert answer.status_code == 422
    assert bench.trial(1).label is None


def test_a_command_without_a_tick_is_refused_unless_it_stops(
    bench: Any, serve: Any, client_of: Any
) -> None:
    client = client_of(serve(bench))
    bench.executed()
    body = bench.command("label", 1, outcome="success").model_dump(mode="json")
    assert client.post("/api/commands", json=body).status_code == 422
    stop = client.post("/api/commands", json={"kind": "stop"})
    assert stop.json()["status"] == "stored"


def test_of_twenty_clients_at_once_one_is_stored(bench: Any, serve: Any, client_of: Any) -> None:
    server = serve(bench)
    clients = [client_of(server) for _ in range(20)]
    bench.executed()
    bodies = [bench.command("label", 1, outcome="success").model_dump(mode="json") for _ in clients]
    gate = threading.Barrier(20)
    answers: list[str] = []

    def press(client: httpx.Client, body: dict[str, Any]) -> None:
        client.get("/api/terms")  # opens the connection
        gate.wait()
        pressed = {**body, "tick": bench.controller.tick()}
        answers.append(client.post("/api/commands", json=pressed).json()["status"])

    threads = [
        threading.Thread(target=press, args=pair) for pair in zip(clients, bodies, strict=True)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert Counter(answers) == {"stored": 1, "stale": 19}
    labels = [e for e in read_journal(bench.folder.journal_path) if e.event.kind == "label"]
    assert len(labels) == 1


def test_two_tabs_see_each_other_s_label(bench: Any, serve: Any, client_of: Any) -> None:
    server = serve(bench)
    first, second = client_of(server), client_of(server)
    bench.executed()
    with second.stream("GET", "/api/stream") as stream:
        told = messages(stream)
        seen = next(told)[1]["trial"]
        assert post(first, bench, "label", 1, outcome="success").json()["status"] == "stored"
        view = next(data for event, data in told if event == "state")
        assert view["history"][0]["label"]["outcome"] == "success"
    late = bench.command("label", 1, outcome="success").model_dump(mode="json")
    late |= {"rev": seen["rev"], "tick": bench.controller.tick()}
    assert second.post("/api/commands", json=late).json()["status"] == "stale"


def test_the_stream_ticks_while_nothing_happens(bench: Any, serve: Any, client_of: Any) -> None:
    client = client_of(serve(bench))
    with client.stream("GET", "/api/stream") as stream:
        told = messages(stream)
        first, second, third = next(told), next(told), next(told)
    assert [event for event, _ in (first, second, third)] == ["state", "tick", "tick"]
    assert first[1]["tick"] < second[1]["tick"] < third[1]["tick"]


def test_predictions_appear_only_with_the_stored_label(
    bench: Any, serve: Any, client_of: Any
) -> None:
    client = client_of(serve(bench))
    bench.executed()
    bench.score(1, 0.987654)
    for _ in range(2):
        before = client.get("/api/view").text
        assert "0.987654" not in before and "scores" not in before
    post(client, bench, "label", 1, outcome="success")
    after = client.get("/api/view").json()["history"][0]
    assert after["scores"] == {"reach": 0.987654}
    post(client, bench, "redo", 1, cause="seeing")
    bench.executed()
    assert "0.987654" not in client.get("/api/view").text


def test_the_review_hides_predictions_and_from_a_second_operator_the_label(
    bench: Any, serve: Any, client_of: Any
) -> None:
    bench.labelled("failure", reason="missed")
    bench.score(1, 0.987654)
    bench.labelled("success")
    plain = client_of(serve(bench, mode="review"))
    second = client_of(serve(bench, mode="review", second=True, actor=BO))
    listed = plain.get("/api/review").json()
    assert [item["number"] for item in listed["trials"]] == [1, 2]
    assert listed["models"] == ["reach"]
    assert "0.98" not in plain.get("/api/review").text
    assert "missed" not in second.get("/api/review").text


@pytest.mark.parametrize(
    ("wanted", "numbers"),
    [
        ({}, [1, 2]),
        ({"object": "cube"}, [2]),
        ({"outcome": "failure"}, [1]),
        ({"outcome": "unlabelled"}, []),
        ({"margin_below": 0.15}, [1]),
        ({"disagrees_with": "reach"}, [1]),
        ({"disagrees_with": "other"}, []),
    ],
)
def test_the_review_filters(
    bench: Any, serve: Any, client_of: Any, wanted: dict[str, Any], numbers: list[int]
) -> None:
    bench.labelled("failure", reason="missed")
    bench.labelled("success")
    bench.score(1, 0.9)
    bench.score(2, 0.8)
    client = client_of(serve(bench, mode="review"))
    found = client.get("/api/review", params=wanted).json()
    assert [item["number"] for item in found["trials"]] == numbers
    assert found["found_by"] == ("disagreement" if "disagrees_with" in wanted else None)


def test_a_second_operator_cannot_filter_by_the_first_ones_verdicts(
    bench: Any, serve: Any, client_of: Any
) -> None:
    bench.labelled("failure", reason="missed")
    bench.score(1, 0.9)
    client = client_of(serve(bench, mode="review", second=True, actor=BO))
    for wanted in (
        {"outcome": "success"},
        {"outcome": "unlabelled"},
        {"disagrees_with": "reach"},
        {"object": "pawn", "outcome": "failure"},
    ):
        answer = client.get("/api/review", params=wanted)
        assert (answer.status_code, "trials" in answer.json()) == (403, False)
    found = client.get("/api/review", params={"object": "pawn", "margin_below": 9}).json()
    assert [item["number"] for item in found["trials"]] == [1]
    assert list(found["models"]) == []


def test_a_second_operator_sees_and_takes_back_their_own_verdicts_only(
    bench: Any, serve: Any, client_of: Any
) -> None:
    bench.labelled("failure", reason="missed")
    bench.labelled("success")
    bench.labelled("success")
    bench.do("relabel", 3, by=BO, outcome="success")  # bo's own trial: no second verdict of theirs
    since = bench.state.seq
    client = client_of(serve(bench, mode="review", second=True, actor=BO, sitting_since=since))

    def shown() -> list[Any]:
        return [item["label"] for item in client.get("/api/review").json()["trials"]]

    assert shown() == [None, None]
    for number in (1, 2):
        assert post(client, bench, "second_label", number, outcome="success").json()["rev"] == (
            bench.trial(number).rev
        )
    assert [label["operator"] for label in shown()] == ["bo", "bo"]
    undoable = client.get("/api/view").json()["undoable"]
    assert (undoable["number"], undoable["kind"]) == (2, "second_label")
    assert post(client, bench, "undo_second", 2).json()["status"] == "stored"
    assert client.get("/api/view").json()["undoable"]["number"] == 1
    assert shown()[1] is None
    assert [bench.trial(n).label.outcome for n in (1, 2)] == ["failure", "success"]
    answer = post(client, bench, "undo_second", 2).json()
    assert (answer["status"], "no second label" in answer["message"]) == ("rejected", True)


@pytest.mark.parametrize(
    ("second", "kind", "value"),
    [
        (True, "relabel", {"outcome": "success"}),
        (True, "undo", {}),
        (True, "redo", {"cause": "seeing"}),
        (False, "second_label", {"outcome": "success"}),
        (False, "skip", {}),
        (False, "pause", {}),
        (False, "stop", {}),
    ],
)
def test_a_review_takes_only_what_belongs_to_it(
    bench: Any, serve: Any, client_of: Any, second: bool, kind: str, value: dict[str, Any]
) -> None:
    bench.labelled("failure", reason="missed")
    before = bench.state.seq
    client = client_of(serve(bench, mode="review", second=second, actor=BO))
    number = None if kind in ("pause", "stop") else 1
    answer = post(client, bench, kind, number, **value).json()
    assert (answer["status"], answer["message"]) == ("rejected", f"{kind} is not for this console")
    assert bench.state.seq == before


def test_an_unknown_filter_is_refused(bench: Any, serve: Any, client_of: Any) -> None:
    assert client_of(serve(bench)).get("/api/review?color=red").status_code == 422


def test_pictures_are_drawn_when_looked_at(bench: Any, serve: Any, client_of: Any) -> None:
    server = serve(bench)
    take = bench.begin()
    shelf = server._console.pictures
    shelf.put(take.trial_id, 1, "placing", lambda: PNG)
    client = client_of(server)
    assert client.get("/api/view").json()["trial"]["pictures"] == ["placing"]
    answer = client.get(f"/api/pictures/{take.trial_id}/1/placing")
    assert (answer.content, answer.headers["content-type"]) == (PNG, "image/png")
    assert client.get(f"/api/pictures/{take.trial_id}/1/overlay").status_code == 404


def test_nobody_connected_holds_the_session_and_a_console_releases_it(
    bench: Any, serve: Any, client_of: Any, in_thread: Any
) -> None:
    server = serve(bench, hold_without_console=True)
    bench.controller.wait_until(lambda: "console" in bench.state.holds)
    waiting = in_thread(bench.controller.next_work)
    client_of(server).post("/api/alive", json={})
    assert waiting().planned.number == 1


def test_silence_holds_even_while_a_socket_is_open(bench: Any) -> None:
    now = [0.0]
    presence = Presence(bench.controller, clock=lambda: now[0])
    presence.alive()
    presence.check()
    assert bench.controller.may_move
    now[0] = SILENCE_LIMIT + 0.1
    presence.check()
    assert bench.state.holds == {"console": "no console is connected"}


def test_the_server_leaves_with_streams_open(bench: Any, serve: Any, client_of: Any) -> None:
    server = serve(bench)
    client = client_of(server)
    with client.stream("GET", "/api/stream") as stream:
        received = messages(stream)
        next(received)
        server.__exit__(None, None, None)
        list(received)  # ended by the server in good order; one cut off raises


def test_the_stream_ends_with_the_session(bench: Any, serve: Any, client_of: Any) -> None:
    client = client_of(serve(bench))
    with client.stream("GET", "/api/stream") as stream:
        told = messages(stream)
        next(told)
        bench.controller.close("finished")
        *_, last = [data for event, data in told if event == "state"]
    assert last["state"] == "ENDED"


def test_a_review_shows_no_verdicts_beside_the_list(bench: Any, serve: Any, client_of: Any) -> None:
    bench.labelled("failure", reason="missed")
    bench.score(1, 0.987654)
    client = client_of(serve(bench, mode="review", second=True, actor=BO))
    view = client.get("/api/view")
    assert "missed" not in view.text and "0.987" not in view.text
    assert (view.json()["history"], view.json()["success"]) == ([], {})
    assert view.json()["undoable"] is None
