"""The controller's password: from the file or the environment, and in no byte of a session."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from collection.errors import StationFileError
from collection.objects import load_objects
from collection.plan.plan import make_plan
from collection.robots.yumi.config import DELIVERED, PASSWORD_VARIABLE, YumiConfig
from collection.session.options import SessionOptions
from collection.session.setup import Setup
from collection.station.station import PACKAGED, Station, build_station, parse_station
from logs.session.folder import SessionFolder

TEXT = (PACKAGED / "yumi.toml").read_text(encoding="utf-8")
SECRET = "o,pen-sesame#7"
LINE = 'password = "robotics"'
WAYS = {
    "as documented": TEXT.replace(LINE, f'password = "{SECRET}"'),
    "with a comment that repeats it": TEXT.replace(LINE, f'password = "{SECRET}" # {SECRET}'),
    "quoted key": TEXT.replace(LINE, f"'password'='{SECRET}'"),
    "escaped": TEXT.replace(LINE, 'password = "o,pen\\u002dsesame#7"'),
    "several lines": TEXT.replace(LINE, f'password = """\\\n{SECRET}"""'),
}


def station_of(text: str, folder: Path) -> Station:
    return build_station(parse_station(text, "lab.toml"), text, folder, 0)


@pytest.mark.parametrize("way", WAYS)
def test_no_byte_of_a_session_holds_the_password(tmp_path: Path, way: str) -> None:
    station = station_of(WAYS[way], tmp_path)
    assert isinstance(station.config.robot, YumiConfig)
    assert station.config.robot.password.get_secret_value() == SECRET
    parts = load_objects(("cube_3cm",))
    plan = make_plan(parts, station.gripper.geometry, grasps=1, repeats=1, seed=1)
    options = SessionOptions(objects=("cube_3cm",), station="lab.toml", operator="web")
    setup = Setup(options, station.text, {part.name: part for part in parts}, plan)
    text = WAYS[way].replace('calibration = "calibration.json"', "")
    station.camera = station_of(text, tmp_path).camera  # there is no calibration here
    folder = SessionFolder.create(tmp_path / "S", setup.descriptor(station), setup.files())
    kept = [path.read_bytes() for path in folder.path.rglob("*") if path.is_file()]
    assert kept
    assert not any(SECRET.encode() in each for each in kept)
    assert SECRET not in station.text  # what every record holds as an attachment
    assert SECRET not in repr(station.config)


def test_the_rest_of_the_station_file_is_kept(tmp_path: Path) -> None:
    kept, given = (tomllib.loads(text) for text in (station_of(TEXT, tmp_path).text, TEXT))
    assert kept["robot"].pop("password") != given["robot"].pop("password")
    assert kept == given


def test_a_file_without_the_password_takes_the_environments(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = TEXT.replace(LINE, "")
    for given, expected in ((SECRET, SECRET), (None, DELIVERED)):
        if given is None:
            monkeypatch.delenv(PASSWORD_VARIABLE)
        else:
            monkeypatch.setenv(PASSWORD_VARIABLE, given)
        config = station_of(text, tmp_path).config.robot
        assert isinstance(config, YumiConfig)
        assert config.password.get_secret_value() == expected


def test_a_password_of_the_wrong_type_is_refused_without_repeating_it() -> None:
    with pytest.raises(StationFileError, match="password") as caught:
        parse_station(TEXT.replace(LINE, "password = 8675309"), "lab.toml")
    assert "8675309" not in str(caught.value)


def test_a_real_station_that_states_no_pose_error_has_none_made_up(tmp_path: Path) -> None:
    known = station_of(TEXT, tmp_path).config.pose_error
    assert known.source == "unknown"
    assert known.total().translation_deviation == known.total().rotation_deviation == 0.0
    stated = TEXT + "\n[pose_error]\ncalibration_translation = 0.002\n"
    assert station_of(stated, tmp_path).config.pose_error.source == "stated"
