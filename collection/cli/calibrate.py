"""`reach calibrate`: find where a fixed camera stands, with a chessboard."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collection.calibration.chessboard import Board
    from reach.arrays import FloatArray


def calibrate(
    out: Annotated[Path, typer.Option("--out", help="Calibration file to write.")] = Path(
        "calibration.json"
    ),
    board: Annotated[
        str, typer.Option(help="Inner corners along x across; one odd, one even.")
    ] = "9x6",
    square: Annotated[float, typer.Option(help="Side of a square [m].")] = 0.02,
    station: Annotated[
        str | None, typer.Option(help="Station file: takes new views with its robot and camera.")
    ] = None,
    views: Annotated[int, typer.Option(min=1, help="How many new views.")] = 12,
    folder: Annotated[
        Path | None,
        typer.Option("--views-in", help="Folder of the views. [beside --out, named after it]"),
    ] = None,
    board_at: Annotated[
        str, typer.Option(help="x,y,height,yaw [m, rad] of a board lying still, face up.")
    ] = "",
    as_json: Annotated[bool, typer.Option("--json", help="Print the calibration as JSON.")] = False,
) -> None:
    """Hand-eye calibration of a fixed camera; writes a file with its residuals.

    With the board in the gripper: guide the arm by hand, press Enter for each view.

        reach calibrate --station lab.toml --board 9x6 --square 0.02 --out calibration.json

    With the board on the table at a measured place (first inner corner, height, direction):

        reach calibrate --station lab.toml --views 1 --board-at 0.35,-0.10,0.002,1.5708

    Once more from views that were kept:

        reach calibrate --views-in calibration-views --board 9x6 --square 0.02
    """
    import json

    from collection.calibration.procedure import calibrate_views, read_views
    from collection.targets import check_files

    check_files([out])
    wanted = _parse_board(board, square)
    place = folder or out.with_name(out.stem + "-views")
    if station is not None:
        _take(station, wanted, place, views, board_at)
    found, camera = read_views(place, wanted)
    result = calibrate_views(found, wanted, camera, "fixed-board" if board_at else "gripper-board")
    result.write(out)
    if as_json:
        typer.echo(json.dumps(result.model_dump(mode="json"), indent=2))
        return
    for view in result.views:
        typer.echo(
            f"{view.name:12} {view.reprojection:6.3f} pixel"
            f" {1000 * view.translation:6.2f} mm {1000 * view.rotation:6.2f} mrad"
        )
    typer.echo(
        f"{out}: {len(result.views)} views, reprojection {result.reprojection_rms:.3f} pixel,"
        f" views agree to {1000 * result.translation_rms:.2f} mm and"
        f" {1000 * result.rotation_rms:.2f} mrad; camera to {1000 * result.position_std:.2f} mm"
        f" and {1000 * result.rotation_std:.2f} mrad"
    )


def _take(name: str, board: Board, place: Path, count: int, board_at: str) -> None:
    """Take new views with the station's camera, and its arm if that carries the board."""
    from collection.calibration.procedure import ObservedArm, RawCamera, flat_board, take_views
    from collection.errors import CalibrationError
    from collection.station.station import load_station

    station = load_station(name)
    camera, arm = station.camera, station.arm
    if not isinstance(camera, RawCamera):
        raise CalibrationError(f"{camera.name} has no pose to calibrate")
    carrier: Callable[[], FloatArray]
    if board_at:
        carrier = partial(flat_board, *_parse_place(board_at))
    elif isinstance(arm, ObservedArm):
        carrier = arm.observe
    else:
        raise CalibrationError(f"{arm.name} cannot be read while a person guides it")
    with station.camera:
        take_views(camera, carrier, board, place, count=count, ready=_wait_for_enter)


def _wait_for_enter(message: str) -> None:
    typer.prompt(f"{message}; Enter", default="", show_default=False, prompt_suffix=" ", err=True)


def _parse_board(text: str, square: float) -> Board:
    from collection.calibration.chessboard import Board
    from collection.errors import CalibrationError

    columns, _, rows = text.partition("x")
    if not (columns.isdigit() and rows.isdigit()):
        raise CalibrationError(f"--board {text!r}: expected inner corners, such as 9x6")
    return Board(int(columns), int(rows), square)


def _parse_place(text: str) -> tuple[float, float, float, float]:
    from collection.errors import CalibrationError

    try:
        x, y, height, yaw = (float(part) for part in text.split(","))
    except ValueError as error:
        raise CalibrationError(f"--board-at {text!r}: expected x,y,height,yaw") from error
    return x, y, height, yaw
