"""``cathforce/Navigate-v0``: reach a place in a branch of a vessel with little force.

>>> import gymnasium, cathforce.gym
>>> environment = gymnasium.make("cathforce/Navigate-v0", randomise="catalogue")
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from ._cathforce import Model
from .bundle import read_bundle
from .errors import UsageError
from .randomisation import Draw, Randomisation
from .simulation import Batch
from .vessel_tree import VesselTree

#: The rig that is navigated unless another one is given.
FORK = Path(__file__).parent / "rigs" / "fork"
ID = "cathforce/Navigate-v0"

#: Points of the shape in an observation, and nodes from one to the next. With links of 1.7 mm they span 100 mm.
POINTS = 8
_NODES = 8
#: No length [m], angle [rad] or force [N] of a catheter is larger.
_MOST = 1e3
#: The insertion stays this far from the end of the links' reach [m].
_MARGIN_M = 1e-3

Randomise = str | Iterable[str] | Mapping[str, tuple[float, float]] | None
Observation = dict[str, np.ndarray]


class Navigation:
    """The task, for any number of catheters at once.

    The operator chooses the speed of every drive twenty times a second, as a share of ``insertion_speed_m_per_s``
    and ``rotation_speed_rad_per_s``. A run ends with success when the tip is within ``tolerance_m`` of the target,
    and without when a contact force exceeds ``force_limit_n`` or the device stops.

    The reward of a step is the share of the way that it has gone, less 0.01 times the share of ``force_limit_n``
    that the largest contact force reaches; success adds 1, a contact above the limit takes 1.

    Args:
        n: number of catheters.
        bundle: rig and vessel, with ``centreline.csv``.
        targets: names of the branches in which targets lie; all but the first one otherwise.
        randomise: ``"catalogue"``, identifiers of effects, or settings with their range; drawn anew in every run.
        nominal_share: share of the runs in which no effect is drawn.
        force_limit_n: largest allowed contact force at a node [N].
        tolerance_m: distance from the target that counts as there [m].
        ticks_per_step: ticks of 1 ms in a step.
        max_steps: steps after which a run is broken off.
    """

    def __init__(
        self,
        n: int,
        *,
        bundle: str | Path | Model = FORK,
        targets: Sequence[str] | None = None,
        randomise: Randomise = None,
        nominal_share: float = 0.2,
        force_limit_n: float = 0.5,
        tolerance_m: float = 3e-3,
        ticks_per_step: int = 50,
        max_steps: int = 200,
        insertion_speed_m_per_s: float = 0.03,
        rotation_speed_rad_per_s: float = 2 * np.pi,
    ) -> None:
        self.model = bundle if isinstance(bundle, Model) else Model(bundle)
        self.n = n
        self.batch = Batch(self.model, n)
        self.tree = VesselTree(read_bundle(self.model.bundle).centreline)
        self.randomisation = Randomisation(self.model, randomise, nominal_share)
        self.force_limit_n = force_limit_n
        self.tolerance_m = tolerance_m
        self.ticks_per_step = ticks_per_step
        self.max_steps = max_steps
        self._entry_m = np.asarray(self.model.entry_position_m)
        self._most_m = self.model.reach_m - _MARGIN_M
        step_s = ticks_per_step * self.model.tick_s
        tendon = 0.01
        moved = {"insertion_m": insertion_speed_m_per_s, "rotation_rad": rotation_speed_rad_per_s}
        self._step = step_s * np.array(
            [moved.get(name.removeprefix("guidewire_"), tendon) for name in self.model.columns]
        )
        self._targets = self._possible_targets(targets)
        columns = len(self.model.columns)
        self._at = np.zeros((n, columns))
        self._steps = np.zeros(n, dtype=int)
        self._goal = np.zeros(n, dtype=int)
        self._way_m = np.zeros(n)
        self._whole_m = np.ones(n)
        self._largest_n = np.zeros(n)
        self._drive_force_n = np.zeros(n)
        self._ways: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self._draws: list[Draw] = [Draw(None, {}) for _ in range(n)]
        self.action_space = spaces.Box(-1.0, 1.0, (columns,), np.float32)
        shapes = {
            "contact_forces_n": (POINTS, 3),
            "drive_force_n": (1,),
            "drives": (columns,),
            "shape_m": (POINTS, 3),
            "target_m": (3,),
            "tip_m": (3,),
            "way_m": (1,),
        }
        boxes: dict[str, spaces.Space[Any]] = {
            name: spaces.Box(-_MOST, _MOST, shape, np.float32) for name, shape in shapes.items()
        }
        self.observation_space = cast("spaces.Space[Observation]", spaces.Dict(boxes))

    def _possible_targets(self, branches: Sequence[str] | None) -> np.ndarray:
        names = list(dict.fromkeys(self.tree.branch))
        wanted = list(branches) if branches is not None else (names[1:] or names)
        absent = [name for name in wanted if name not in names]
        if absent:
            raise UsageError(
                f"there is no branch {absent[0]}\n  fix: one of {', '.join(names)}"
            )
        entry, _ = self.tree.stations_at(self._entry_m[None])
        ways, _ = self.tree.ways_m(int(entry[0]))
        inside = [
            k
            for k, name in enumerate(self.tree.branch)
            # A branch begins inside the one that it leaves: the first 10 mm are no target.
            if name in wanted and ways[k] < self._most_m and (len(names) == 1 or self.tree.arc_m[k] > 0.01)
        ]
        if not inside:
            raise UsageError("no target of these branches is within reach of the links")
        return np.array(inside)

    def reset(self, which: np.ndarray, random: np.random.Generator) -> None:
        """Begins new runs of the catheters ``which``, (k,)."""
        for index in which:
            self._start(int(index), random)
        self._way_m[which] = self._ways_left_m()[which]
        self._whole_m[which] = np.maximum(self._way_m[which], self.tolerance_m)

    def _start(self, index: int, random: np.random.Generator) -> None:
        self._goal[index] = random.choice(self._targets)
        self._steps[index] = 0
        self._largest_n[index] = 0.0
        self._drive_force_n[index] = 0.0
        at = np.zeros(len(self.model.columns))
        at[1] = random.uniform(-np.pi, np.pi)
        self._at[index] = at
        # A few effects exclude each other, or a rig; then another one is drawn.
        for _ in range(20):
            draw = self.randomisation.draw(random, self.tree.positions_m)
            try:
                nominal = {"wall.friction_coefficient": self.model.value("wall.friction_coefficient")}
                self.batch.reset(at[None], which=[index], parameters=draw.parameters or nominal)
            except UsageError:
                continue
            self._draws[index] = draw
            return
        raise UsageError("this rig can have none of the effects that are drawn")

    def _tips_m(self) -> np.ndarray:
        tips = self.batch.shape_m[:, 0, :].astype(float)
        return np.where(np.isnan(tips), self._entry_m, tips)

    def _ways_left_m(self) -> np.ndarray:
        tips = self._tips_m()
        stations, _ = self.tree.stations_at(tips)
        ways = np.zeros(self.n)
        for k, (station, goal) in enumerate(zip(stations, self._goal, strict=True)):
            if goal not in self._ways:
                self._ways[int(goal)] = self.tree.ways_m(int(goal))
            lengths, towards = self._ways[int(goal)]
            beside = tips[k] - self.tree.positions_m[station]
            ways[k] = max(0.0, lengths[station] - float(beside @ towards[station]))
        return ways

    def step(self, actions: np.ndarray) -> dict[str, np.ndarray]:
        """Moves all catheters, ``actions`` (n, columns); returns reward, ends and figures, each (n,)."""
        share = np.clip(np.asarray(actions, dtype=float), -1.0, 1.0)
        share = np.where(np.isfinite(share), share, 0.0)
        goal = self._at + share * self._step
        insertions = [k for k, name in enumerate(self.model.columns) if name.endswith("insertion_m")]
        goal[:, insertions] = np.clip(goal[:, insertions], 0.0, self._most_m)
        ticks = self.batch.move_to(goal, self.ticks_per_step)
        self._at = goal
        self._steps += 1
        force_n = np.asarray(ticks.peak_contact_force_n, dtype=float)
        self._largest_n = np.maximum(self._largest_n, force_n)
        before = self._way_m
        self._way_m = self._ways_left_m()
        apart_m = np.linalg.norm(self._tips_m() - self.tree.positions_m[self._goal], axis=1)
        stopped = (ticks.fault != 0) | ticks.lost | ticks.refused
        unsafe = force_n > self.force_limit_n
        success = (apart_m < self.tolerance_m) & (self._way_m < 3 * self.tolerance_m)
        success &= ~stopped & ~unsafe
        reward = (before - self._way_m) / self._whole_m
        # A run has about 100 steps: pressing with the whole limit all the way takes as much as going it gives, so that
        # it never pays to stand still.
        reward -= 0.01 * np.minimum(force_n / self.force_limit_n, 1.0)
        reward += success.astype(float) - (unsafe | stopped).astype(float)
        terminated = success | unsafe | stopped
        self._drive_force_n = np.array(ticks.drive_force_n, dtype=float)
        return {
            "reward": reward,
            "terminated": terminated,
            "truncated": ~terminated & (self._steps >= self.max_steps),
            "is_success": success,
            "is_unsafe": unsafe,
            "largest_force_n": self._largest_n.copy(),
            "distance_m": apart_m,
            "fault": np.asarray(ticks.fault),
        }

    def observe(self) -> Observation:
        """What the operator sees of all catheters; positions are from the entry [m]."""
        shape = self.batch.shape_m
        forces = np.nan_to_num(self.batch.contact_forces_n)
        inside = ~np.isnan(shape)
        shape = np.where(inside, shape - self._entry_m, 0.0)
        of_points = forces[:, : POINTS * _NODES].reshape(self.n, POINTS, _NODES, 3).sum(axis=2)
        observed = {
            "contact_forces_n": of_points,
            "drive_force_n": self._drive_force_n[:, None],
            "drives": self._at,
            "shape_m": shape[:, : POINTS * _NODES : _NODES],
            "target_m": self.tree.positions_m[self._goal] - self._entry_m,
            "tip_m": self._tips_m() - self._entry_m,
            "way_m": self._way_m[:, None],
        }
        return {
            name: np.clip(of, -_MOST, _MOST).astype(np.float32) for name, of in observed.items()
        }

    def told(self, index: int) -> dict[str, Any]:
        """What an episode was drawn with."""
        draw = self._draws[index]
        return {
            "branch": self.tree.branch[self._goal[index]],
            "effect": draw.effect or "none",
            "parameters": dict(draw.parameters),
        }


class NavigateEnv(gymnasium.Env[Observation, np.ndarray]):
    """One catheter; see :class:`Navigation` for the arguments."""

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012

    def __init__(self, render_mode: str | None = None, **arguments: Any) -> None:
        self.render_mode = render_mode
        self.navigation = Navigation(1, **arguments)
        self.action_space = self.navigation.action_space
        self.observation_space = self.navigation.observation_space

    def _observed(self) -> Observation:
        return {name: of[0] for name, of in self.navigation.observe().items()}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.navigation.reset(np.array([0]), self.np_random)
        return self._observed(), self.navigation.told(0)

    def step(self, action: np.ndarray) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        found = self.navigation.step(np.asarray(action)[None])
        info = {name: of[0].item() for name, of in found.items()}
        reward = info.pop("reward")
        terminated, truncated = info.pop("terminated"), info.pop("truncated")
        return self._observed(), reward, terminated, truncated, info


class NavigateVectorEnv(VectorEnv[Observation, np.ndarray, np.ndarray]):
    """Many catheters at once; a run that has ended begins anew with the next step."""

    metadata: dict[str, Any] = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012

    def __init__(self, num_envs: int = 1, render_mode: str | None = None, **arguments: Any) -> None:
        self.num_envs = num_envs
        self.render_mode = render_mode
        self.navigation = Navigation(num_envs, **arguments)
        self.single_action_space = self.navigation.action_space
        self.single_observation_space = self.navigation.observation_space
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._ended = np.zeros(num_envs, dtype=bool)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self.navigation.reset(np.arange(self.num_envs), self.np_random)
        self._ended[:] = False
        return self.navigation.observe(), {}

    def step(
        self, actions: np.ndarray
    ) -> tuple[Observation, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        again = np.flatnonzero(self._ended)
        found = self.navigation.step(actions)
        if again.size:
            self.navigation.reset(again, self.np_random)
            found["reward"][again] = 0.0
            for name in ("terminated", "truncated", "is_success", "is_unsafe"):
                found[name][again] = False
        reward = found.pop("reward")
        terminated, truncated = found.pop("terminated"), found.pop("truncated")
        self._ended = terminated | truncated
        return self.navigation.observe(), reward, terminated, truncated, found


def register() -> None:
    """Tells Gymnasium of the environment; importing this module does."""
    if ID not in gymnasium.registry:
        gymnasium.register(
            id=ID,
            entry_point="cathforce.gym:NavigateEnv",
            vector_entry_point="cathforce.gym:NavigateVectorEnv",
        )


register()
