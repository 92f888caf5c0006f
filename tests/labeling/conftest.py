"""A session folder with a small plan, a controller on it, and its loop in a thread."""

from __future__ import annotations

import importlib.util
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from types import ModuleType
from typing import Any

import httpx
import pytest

from labeling.control.commands import Actor, Answer, Command, CommandKind
from labeling.control.controller import SessionController
from labeling.control.take import Take
from labeling.display.console import Console
from labeling.display.pictures import PictureShelf
from labeling.server.access import make_access
from labeling.server.server import ConsoleServer, free_port
from logs.journal.events import Phase, Scored, SensorVerdict, Source
from logs.journal.state import PlannedEntry, SessionState, TrialState
from logs.session.folder import SessionDescriptor, SessionFolder, open_segment

SETUP = {"robot": "r1", "camera": "c1", "calibration": "k1", "plan": "p1"}
ANN = Actor("ann", Source.OPERATOR)


def describe(trials: int) -> SessionDescriptor:
    return SessionDescriptor(
        created_ns=1,
        seed=7,
        config={"station": "simulated"},
        trials=tuple(
            PlannedEntry(
                number=number,
                trial_id=f"00000000-0000-4000-8000-{number:012d}",
                grasp_id=f"g{number}",
                object_name=("cube", "pawn")[number % 2],
                stable_pose=0,
            )
            for number in range(1, trials + 1)
        ),
        fingerprints=SETUP,
        simulated=True,
    )


class Bench:
    """A controller with the loop's steps and an operator's commands at hand, in one thread."""

    def __init__(self, folder: SessionFolder, *, operator: str = "ann", **options: Any) -> None:
        self.folder = folder
        self.ann = ANN
        journal = folder.open_journal()
        self.state = SessionState.fold(folder.descriptor.trials, journal.entries)
        open_segment(journal, self.state, SETUP, operator=operator, source=Source.OPERATOR)
        self.controller = SessionController(journal, self.state, **options)

    def trial(self, number: int) -> TrialState:
        return self.state.order[number - 1]

    def command(self, kind: str, number: int | None = None, **value: Any) -> Command:
        trial = self.trial(number) if number else None
        return Command(
            kind=CommandKind(kind),
            trial_id=trial.trial_id if trial else None,
            rev=trial.rev if trial else self.state.control_rev,
            value=value,
        )

    def do(self, kind: str, number: int | None = None, *, by: Actor = ANN, **value: Any) -> Answer:
        return self.controller.submit(self.command(kind, number, **value), by)

    def begin(self) -> Take:
        work = self.controller.next_work()
        assert work is not None
        return self.controller.begin(work)

    def execute(self, take: Take) -> Take:
        number = next(t.planned.number for t in self.state.order if t.trial_id == take.trial_id)
        assert self.do("placed", number).status == "stored"
        take.wait_placed()
        for phase in (Phase.CAPTURE, Phase.REGISTER, Phase.EXECUTE):
            take.advance(phase, {"registration": {"margin": 0.1 * number}})
        take.record_executed(f"trials/{number}/trial.mcap", SensorVerdict(lifted=True))
        return take

    def executed(self) -> Take:
        """A new take, executed and waiting for its label."""
        return self.execute(self.begin())

    def labelled(self, outcome: str = "success", **value: Any) -> Take:
        take = self.executed()
        number = next(t.planned.number for t in self.state.order if t.trial_id == take.trial_id)
        assert self.do("label", number, outcome=outcome, **value).status == "stored"
        return take

    def score(self, number: int, value: float, *, model: str = "reach", take: int = 1) -> None:
        """A model's prediction, as the session's background stores it."""
        trial_id = self.trial(number).trial_id
        self.controller.record(
            Scored(trial_id=trial_id, take=take, model=model, version="1", value=value)
        )


@pytest.fixture
def folder(tmp_path: Path) -> SessionFolder:
    return SessionFolder.create(tmp_path / "session", describe(3))


@pytest.fixture
def make_bench(folder: SessionFolder) -> Iterator[Callable[..., Bench]]:
    made: list[Bench] = []

    def make(**options: Any) -> Bench:
        made.append(Bench(folder, **options))
        return made[-1]

    yield make
    for bench in made:
        bench.controller.close("ended")


@pytest.fixture
def bench(make_bench: Callable[..., Bench]) -> Bench:
    return make_bench()


@pytest.fixture
def fake_session() -> ModuleType:
    """The module fake_session.py beside this file."""
    path = Path(__file__).with_name("fake_session.py")
    spec = importlib.util.spec_from_file_location("fake_session", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def in_thread() -> Iterator[Callable[[Callable[[], Any]], Callable[[], Any]]]:
    """Run a blocking call in a thread; the returned function waits for its result."""
    threads: list[threading.Thread] = []

    def start(call: Callable[[], Any]) -> Callable[[], Any]:
        result: list[Any] = []

        def run() -> None:
            try:
                result.append(call())
            except Exception as error:
                result.append(error)

        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        threads.append(thread)

        def join() -> Any:
            thread.join(60)
            assert not thread.is_alive(), "the call still waits"
            if isinstance(result[0], Exception):
                raise result[0]
            return result[0]

        return join

    yield start
    for thread in threads:
        thread.join(10)


TOKEN = "t" * 24


@pytest.fixture
def serve() -> Iterator[Callable[..., ConsoleServer]]:
    """Start a console's server; options are those of Console."""
    with ExitStack() as stack:

        def start(bench: Bench, **options: Any) -> ConsoleServer:
            root = bench.folder.path
            settings: dict[str, Any] = {
                "pictures": PictureShelf(root),
                "root": root,
                "hold_without_console": False,
                **options,
            }
            console = Console(bench.controller, settings.pop("actor", ANN), "monday", **settings)
            access = make_access("127.0.0.1", free_port(), token=TOKEN)
            return stack.enter_context(ConsoleServer(console, access))

        yield start


@pytest.fixture
def client_of() -> Iterator[Callable[..., httpx.Client]]:
    """A client of a server, with the token."""
    with ExitStack() as stack:

        def make(server: ConsoleServer) -> httpx.Client:
            headers = {"Authorization": f"Bearer {TOKEN}"}
            client = httpx.Client(
                base_url=server.access.origin, headers=headers, timeout=20, trust_env=False
            )
            return stack.enter_context(client)

        yield make


@pytest.fixture
def make_certificate() -> Callable[[Path], tuple[Path, Path]]:
    """Write a certificate for 127.0.0.1 and its key into a folder."""
    return _make_certificate


def _make_certificate(folder: Path) -> tuple[Path, Path]:
    import datetime
    import ipaddress

    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec

    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "console")])
    now = datetime.datetime.now(datetime.UTC)
    address = x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address("127.0.0.1"))])
    certificate = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(1)
        .not_valid_before(now - datetime.timedelta(days=1))
        .not_valid_after(now + datetime.timedelta(days=1))
        .add_extension(address, critical=False)
        .sign(key, hashes.SHA256())
    )
    paths = folder / "c.pem", folder / "k.pem"
    paths[0].write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    paths[1].write_bytes(
        key.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            serialization.NoEncryption(),
        )
    )
    return paths
