"""The one simulated cell of a station, made by whichever simulated device is built first."""

from __future__ import annotations

from collection.cell.simulation import Simulation
from collection.clock import SimulatedClock
from collection.errors import StationFileError
from collection.station.drivers import BuildContext


def simulated_cell(context: BuildContext) -> Simulation:
    """Return the cell that the station's simulated devices share.

    Raises:
        StationFileError: a simulated device in a station that is not simulated.
    """
    if "simulation" not in context.shared:
        station = context.station
        if station.simulation is None or not isinstance(context.clock, SimulatedClock):
            raise StationFileError("a simulated device needs the section [simulation]")
        context.shared["simulation"] = Simulation(
            station.simulation,
            station.gripper_geometry(),
            context.clock,
            station.workspace_area(),
            context.seed,
        )
    simulation: Simulation = context.shared["simulation"]
    return simulation
