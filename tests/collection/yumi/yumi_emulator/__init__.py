"""An IRC5 controller on the loopback address: RAPID interpreter, kinematic arm, web services."""

from yumi_emulator.controller import Arm, Controller
from yumi_emulator.faults import Faults
from yumi_emulator.web_services import WebServices

__all__ = ["Arm", "Controller", "Faults", "WebServices"]
