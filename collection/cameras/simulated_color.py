"""A simulated color camera that films the trial, where an off-screen renderer is found."""

from __future__ import annotations

import contextlib
import importlib
from typing import TYPE_CHECKING, Any, Self

import mujoco
import numpy as np

from collection.cameras.protocol import CameraState, ColorFrame
from collection.errors import CameraNotConnectedError
from collection.robots.arm_model import ArmModel
from reach.arrays import frozen
from reach.objects import GraspObject
from reach.transforms import quat_wxyz_from_rotation

if TYPE_CHECKING:
    from collection.cell.simulation import Simulation

WIDTH, HEIGHT = 320, 240
RENDERERS = ("egl", "osmesa")
"""Off-screen OpenGL platforms, in the order they are tried."""
_CAMERA = {"lookat": (0.36, -0.10, 0.10), "distance": 0.75, "azimuth": 155.0, "elevation": -22.0}


class SimulatedColorCamera:
    """Pictures of arm, hand, object and table, drawn by MuJoCo without a screen.

    Where no renderer works, `frame()` is None and `state()` says why.

    Args:
        simulation: the cell.
        arm: the arm's model.
    """

    def __init__(self, simulation: Simulation, arm: ArmModel) -> None:
        self._simulation = simulation
        self._arm = arm
        self._context: Any = None
        self._renderer = ""
        self._detail = "not connected"
        self._connected = False
        self._scene: _DrawnScene | None = None

    @property
    def name(self) -> str:
        """Of the camera, for logs."""
        return "simulated color camera"

    def connect(self) -> None:
        """Find an off-screen renderer; it is no error if there is none."""
        self._connected = True
        if self._context is None:
            self._context, self._renderer, self._detail = _open_context()

    def disconnect(self) -> None:
        """Let go of the renderer."""
        if self._context is not None:
            with contextlib.suppress(Exception):  # a driver that fails to close is gone anyway
                with self._context.as_current():
                    self._scene = None
                self._context.free()
        self._context, self._connected, self._detail = None, False, "not connected"

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(self, *exception: object) -> None:
        self.disconnect()

    def state(self) -> CameraState:
        """Whether it can see, and with which renderer."""
        return CameraState(self._connected, self._detail)

    def frame(self) -> ColorFrame | None:
        """Picture of the cell as it is now; None where no renderer was found.

        Raises:
            CameraNotConnectedError: not connected.
        """
        if not self._connected:
            raise CameraNotConnectedError(f"the {self.name} is not connected: call connect()")
        if self._context is None:
            return None
        with self._context.as_current():  # only while drawing: any thread may ask for a frame
            obj = self._simulation.object
            if self._scene is None or self._scene.object is not obj:
                self._scene = _DrawnScene(self._arm, obj)
            image = self._scene.draw(self._simulation)
        return ColorFrame(frozen(image, np.uint8), self._simulation.clock.now_ns())


class _DrawnScene:
    """The arm's model with one object in it, and the renderer's buffers for it."""

    def __init__(self, arm: ArmModel, obj: GraspObject | None) -> None:
        self.object = obj
        self._model = _with_object(arm, obj)
        self._data = mujoco.MjData(self._model)
        self._options = mujoco.MjvOption()
        self._scene = mujoco.MjvScene(self._model, maxgeom=100)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = False
        self._scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
        self._camera = mujoco.MjvCamera()
        self._camera.lookat[:] = _CAMERA["lookat"]
        self._camera.distance = _CAMERA["distance"]
        self._camera.azimuth = _CAMERA["azimuth"]
        self._camera.elevation = _CAMERA["elevation"]
        self._buffers = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._buffers)
        self._viewport = mujoco.MjrRect(0, 0, WIDTH, HEIGHT)

    def draw(self, simulation: Simulation) -> np.ndarray:
        """Image (H, W, 3), uint8, of the present state."""
        data = self._data
        if simulation.joints is not None:
            data.qpos[: len(simulation.joints)] = simulation.joints
        if self.object is not None:
            T = simulation.true_T_world_object()
            data.mocap_pos[0] = T[:3, 3]
            data.mocap_quat[0] = quat_wxyz_from_rotation(T[:3, :3])
        self._place_fingers(simulation)
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_camlight(self._model, data)
        mujoco.mjv_updateScene(
            self._model,
            data,
            self._options,
            None,
            self._camera,
            mujoco.mjtCatBit.mjCAT_ALL.value,
            self._scene,
        )
        mujoco.mjr_render(self._viewport, self._scene, self._buffers)
        image = np.empty((HEIGHT, WIDTH, 3), dtype=np.uint8)
        mujoco.mjr_readPixels(image, None, self._viewport, self._buffers)
        return np.flipud(image)

    def _place_fingers(self, simulation: Simulation) -> None:
        """Move the finger's solids to the jaws' opening; they are drawn, not jointed."""
        # Soft pads that press on one another are a little less than closed.
        boxes = simulation.gripper.boxes(max(simulation.opening, 0.0))
        names = [n for n in range(self._model.ngeom) if "gripper_" in self._model.geom(n).name]
        for geom, box in zip(names, boxes, strict=True):
            self._model.geom_pos[geom] = box.T_gripper_box[:3, 3]


def _with_object(arm: ArmModel, obj: GraspObject | None) -> Any:
    spec = mujoco.MjSpec.from_string(arm.mjcf)
    spec.visual.global_.offwidth, spec.visual.global_.offheight = WIDTH, HEIGHT
    spec.visual.headlight.ambient = [0.35, 0.35, 0.35]
    spec.visual.headlight.diffuse = [0.6, 0.6, 0.6]
    if obj is not None:
        body = spec.worldbody.add_body(name="object", mocap=True)
        mesh = spec.add_mesh(name="object")
        mesh.uservert = obj.vertices.ravel()
        mesh.userface = obj.faces.ravel().astype(np.int32)
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname="object",
            rgba=[0.93, 0.45, 0.18, 1],
            contype=0,
            conaffinity=0,
        )
    return spec.compile()


def _open_context() -> tuple[Any, str, str]:
    """A working OpenGL context without a screen, its name, and a sentence about it."""
    reasons = []
    for renderer in RENDERERS:
        try:
            module = importlib.import_module(f"mujoco.{renderer}")
            context = module.GLContext(WIDTH, HEIGHT)
            with context.as_current():
                return context, renderer, f"off-screen renderer: {renderer}"
        except Exception as error:  # every platform fails in its own way where it is missing
            reasons.append(f"{renderer}: {error}".splitlines()[0])
    return None, "", "no off-screen renderer, no video (" + "; ".join(reasons) + ")"
