"""The insertion in PyElastica: a Cosserat rod, explicit in time, with a penalty wall."""

import sys
import time
from importlib.metadata import version

import elastica
import numpy as np
from numba import njit

from insertion import Insertion, write

# The largest step that stays stable: the shear waves across an element set it.
STEP_S = 5e-6
# Speed over which friction sets in [m/s]; the feed is ten times as fast.
FRICTION_SPEED_M_PER_S = 1e-3
# Time of the damping of all motion [1/s]: about the first mode of the free instrument.
DAMPING_PER_S = 15.0
# Damping of the wall, as a time [s].
WALL_DAMPING_S = 1e-4


@njit
def wall_forces(position, velocity, first, tube, radius, stiffness, friction, forces, total):
    """Adds penalty and friction forces to the nodes from `first` on, and their sum to `total`."""
    straight, bend, angle, slope, first_radius = tube
    cos, sin = np.cos(angle), np.sin(angle)
    for k in range(first, position.shape[1]):
        x, y, z = position[0, k], position[1, k], position[2, k]
        end_x, end_y = straight + bend * sin, bend * (1 - cos)
        past = (x - end_x) * cos + (y - end_y) * sin
        if x < straight:
            s, dx, dy = x, 0.0, y
        elif past > 0:
            s, dx, dy = straight + bend * angle + past, x - end_x - past * cos, y - end_y - past * sin
        else:
            turned = np.arctan2(x - straight, bend - y)
            s = straight + bend * turned
            dx, dy = x - straight - bend * np.sin(turned), y - bend * (1 - np.cos(turned))
        off_axis = np.sqrt(dx * dx + dy * dy + z * z)
        depth = off_axis + radius - (first_radius + slope * s)
        if depth <= 0:
            continue
        nx, ny, nz = -dx / off_axis, -dy / off_axis, -z / off_axis
        vx, vy, vz = velocity[0, k], velocity[1, k], velocity[2, k]
        outwards = vx * nx + vy * ny + vz * nz
        normal = max(0.0, stiffness * (depth - WALL_DAMPING_S * outwards))
        vx, vy, vz = vx - outwards * nx, vy - outwards * ny, vz - outwards * nz
        speed = np.sqrt(vx * vx + vy * vy + vz * vz)
        drag = friction * normal / max(speed, FRICTION_SPEED_M_PER_S)
        fx, fy, fz = normal * nx - drag * vx, normal * ny - drag * vy, normal * nz - drag * vz
        forces[0, k] += fx
        forces[1, k] += fy
        forces[2, k] += fz
        total[0] -= fx
        total[1] -= fy
        total[2] -= fz


class Guide(elastica.ConstraintBase):
    """What has not passed the mouth stays straight and moves with the feed."""

    def __init__(self, insertion, **rest):
        super().__init__(**rest)
        self.speed = insertion.speed_m_per_s
        self.initial = self._system.position_collection.copy()
        self.directors = self._system.director_collection.copy()
        self.inside = 0

    def constrain_values(self, system, time):
        fed = self.speed * time
        self.inside = inside = np.searchsorted(self.initial[0], -fed, side="right")
        system.position_collection[:, :inside] = self.initial[:, :inside]
        system.position_collection[0, :inside] += fed
        system.director_collection[..., : inside - 1] = self.directors[..., : inside - 1]

    def constrain_rates(self, system, time):
        system.velocity_collection[:, : self.inside] = 0.0
        system.velocity_collection[0, : self.inside] = self.speed
        system.omega_collection[:, : self.inside - 1] = 0.0


class Wall(elastica.NoForces):
    def __init__(self, insertion, total):
        super().__init__()
        tube = insertion.tube
        slope = (tube.last_radius_m - tube.first_radius_m) / tube.length_m
        self.tube = (tube.straight_m, tube.bend_radius_m, tube.bend_angle_rad, slope, tube.first_radius_m)
        self.insertion = insertion
        self.stiffness = insertion.wall_stiffness_n_per_m2 * insertion.spacing_m
        self.total = total

    def apply_forces(self, system, time=0.0):
        insertion = self.insertion
        first = np.searchsorted(system.position_collection[0], 0.0, side="right")
        wall_forces(
            system.position_collection, system.velocity_collection, first, self.tube,
            insertion.radius_m, self.stiffness, insertion.friction_coefficient,
            system.external_forces, self.total,
        )


class Scene(elastica.BaseSystemCollection, elastica.Constraints, elastica.Forcing, elastica.Damping):
    pass


def main():
    insertion = Insertion.read()
    area = np.pi * insertion.radius_m**2
    shear = insertion.youngs_modulus_pa / (2 * (1 + insertion.poissons_ratio))
    rod = elastica.CosseratRod.straight_rod(
        insertion.nodes - 1,
        np.array([insertion.start_m - insertion.length_m, 0.0, 0.0]),
        np.array([1.0, 0.0, 0.0]),
        np.array([0.0, 0.0, 1.0]),
        insertion.length_m,
        insertion.radius_m,
        insertion.mass_kg / (area * insertion.length_m),
        youngs_modulus=insertion.youngs_modulus_pa,
        shear_modulus=shear,
    )
    rod.velocity_collection[0] = insertion.speed_m_per_s
    scene = Scene()
    scene.append(rod)
    scene.constrain(rod).using(Guide, insertion=insertion)
    total = np.zeros(3)
    scene.add_forcing_to(rod).using(
        elastica.GravityForces, acc_gravity=np.array(insertion.gravity_m_per_s2)
    )
    scene.add_forcing_to(rod).using(Wall, insertion=insertion, total=total)
    scene.dampen(rod).using(
        elastica.AnalyticalLinearDamper, uniform_damping_constant=DAMPING_PER_S, time_step=STEP_S
    )
    scene.finalize()
    stepper = elastica.PositionVerlet()
    clock = stepper.step(scene, np.float64(0.0), STEP_S)  # compiles

    per_sample = round(insertion.sample_s / STEP_S)
    count = round((insertion.end_m - insertion.start_m) / insertion.speed_m_per_s / insertion.sample_s)
    samples = []
    begin = time.thread_time()
    for _ in range(count):
        total[:] = 0.0
        for _ in range(per_sample):
            clock = stepper.step(scene, clock, STEP_S)
        samples.append([insertion.start_m + insertion.speed_m_per_s * clock, *(total / per_sample)])
    cpu_s = time.thread_time() - begin
    write(
        "PyElastica", version("pyelastica"), STEP_S, cpu_s,
        count * per_sample, samples, "Cosserat rod, position Verlet, penalty wall",
    )


if __name__ == "__main__":
    sys.exit(main())
