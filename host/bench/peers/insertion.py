"""The insertion that every peer plays, as `cathforce-bench` describes it on standard input.

Lengths in metres, forces in newtons. The instrument stands along x at first, its tip `start_m`
past the guide's mouth at x = 0, and is fed at `speed_m_per_s` until its tip is at `end_m`. The
vessel is one tube: straight along x, an arc towards y, straight again; its radius changes
evenly along its centre line.
"""

import json
import sys
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Tube:
    straight_m: float
    bend_radius_m: float
    bend_angle_rad: float
    length_m: float
    first_radius_m: float
    last_radius_m: float

    def wall(self, points):
        """Distance to the wall and unit normal into the lumen, of points (n, 3)."""
        x, y, z = points.T
        bend, angle = self.bend_radius_m, self.bend_angle_rad
        along = np.array([np.cos(angle), np.sin(angle)])
        end = np.array([self.straight_m + bend * along[1], bend * (1 - along[0])])
        past = (x - end[0]) * along[0] + (y - end[1]) * along[1]
        before, after = x < self.straight_m, (x >= self.straight_m) & (past > 0)
        turned = np.arctan2(x - self.straight_m, bend - y)
        arc = [self.straight_m + bend * np.sin(turned), bend * (1 - np.cos(turned))]
        here = lambda a, b, c: np.where(before, a, np.where(after, b, c))
        arc_length = here(x, self.straight_m + bend * angle + past, self.straight_m + bend * turned)
        from_axis = np.stack([
            x - here(x, end[0] + past * along[0], arc[0]),
            y - here(0, end[1] + past * along[1], arc[1]),
            z,
        ], axis=1)
        off_axis = np.linalg.norm(from_axis, axis=1)
        slope = (self.last_radius_m - self.first_radius_m) / self.length_m
        radius = self.first_radius_m + slope * arc_length
        return radius - off_axis, -from_axis / np.maximum(off_axis, 1e-12)[:, None]


@dataclass(frozen=True)
class Insertion:
    length_m: float
    nodes: int
    radius_m: float
    mass_kg: float
    youngs_modulus_pa: float
    poissons_ratio: float
    gravity_m_per_s2: list
    friction_coefficient: float
    wall_stiffness_n_per_m2: float
    start_m: float
    end_m: float
    speed_m_per_s: float
    sample_s: float
    tube: Tube

    @staticmethod
    def read():
        job = json.load(sys.stdin)
        return Insertion(**(job | {"tube": Tube(**job["tube"])}))

    @property
    def spacing_m(self):
        return self.length_m / (self.nodes - 1)


def write(name, version, step_s, cpu_s, steps, samples, remark):
    """The answer: `samples` are rows of insertion and force on the vessel in x, y, z."""
    json.dump({
        "name": name, "version": version, "step_s": step_s, "us_per_step": 1e6 * cpu_s / steps,
        "steps": steps, "samples": samples, "remark": remark,
    }, sys.stdout)
