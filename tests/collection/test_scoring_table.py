"""A take is scored on the table it was recorded on."""

from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from collection.scoring.predictions import scene_of
from logs.errors import RecordReadError
from logs.record.descriptions import STATION_FILE, gripper_attachment
from logs.record.mesh_attachment import mesh_attachment
from logs.record.records import AttachmentRecord
from reach import GraspObject, ParallelJawGripper
from reach.transforms import make_transform

HEIGHT = 0.05


@dataclass
class Record:
    """What of a record the scene is made from."""

    descriptor: SimpleNamespace
    registration: SimpleNamespace
    attachments: dict = field(default_factory=dict)
    path: Path = Path("trial.mcap")


def record(station):
    mesh = trimesh.creation.box((0.03, 0.03, 0.03))
    part = GraspObject("cube", mesh.vertices, mesh.faces, 0.05)
    found = [mesh_attachment(part), gripper_attachment(ParallelJawGripper.yumi())]
    if station is not None:
        found.append(AttachmentRecord(STATION_FILE, "application/toml", station.encode()))
    described = SimpleNamespace(
        object_name="cube", object_mass=0.05, center_of_mass=np.zeros(3), stable_pose=0
    )
    pose = make_transform(None, (0.4, 0.0, HEIGHT + 0.015))
    registered = SimpleNamespace(T_world_object=pose, covariance=np.eye(6) * 1e-8)
    return Record(described, registered, {one.name: one for one in found})


def test_the_part_stands_on_the_stations_table():
    scene = scene_of(record(f"[workspace]\ntable_height = {HEIGHT}\n"))
    lowest = scene.object.vertices[:, 2].min() + scene.T_world_object[2, 3]
    assert scene.table_height == HEIGHT
    assert lowest == pytest.approx(scene.table_height)


@pytest.mark.parametrize("station", [None, "", "[workspace]\nsize = 1\n"])
def test_a_station_that_says_nothing_has_its_table_at_zero(station):
    assert scene_of(record(station)).table_height == 0.0


def test_a_station_file_that_is_none_is_an_error():
    with pytest.raises(RecordReadError, match=STATION_FILE):
        scene_of(record("no table"))
