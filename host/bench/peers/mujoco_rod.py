"""The insertion in MuJoCo: a one-dimensional flex (a discrete elastic rod), implicit in time.

The wall is exact and costs MuJoCo nothing: its contacts are computed here and handed over, and
only the time that MuJoCo itself takes is counted.
"""

import ctypes
import glob
import sys
import time

import mujoco
import numpy as np

from insertion import Insertion, write

STEP_S = 1e-3
# Viscous time of bending [s].
DAMPING_S = 5e-3
# Edges keep their length to 0.01 %; softer ones make the rod a spring.
EDGE = f'solref="{2 * STEP_S} 1" solimp="0.999 0.999 0.001"'
# Contact as stiff as the step allows, and friction ten times stiffer: at 1 it creeps, and the
# forces come out a quarter too small.
CONTACT_TIME_S = 2 * STEP_S
FRICTION_RATIO = 10
# Nodes in the guide are moved, not solved for: nothing can push such a mass aside [kg, kg m²].
IN_GUIDE_KG = 10.0
IN_GUIDE_KG_M2 = 1.0


def model(insertion):
    gravity = " ".join(map(str, insertion.gravity_m_per_s2))
    middle = insertion.start_m - insertion.length_m / 2
    spec = mujoco.MjSpec.from_string(f"""
        <mujoco>
          <option timestep="{STEP_S}" integrator="discrete" gravity="{gravity}" cone="elliptic"
                  impratio="{FRICTION_RATIO}"/>
          <worldbody>
            <geom name="wall" type="sphere" size="1" contype="0" conaffinity="0"/>
            <flexcomp name="rod" type="grid" count="{insertion.nodes} 1 1" dim="1"
                      spacing="{insertion.spacing_m} 1 1" pos="{middle} 0 0"
                      radius="{insertion.radius_m}" mass="{insertion.mass_kg}">
              <edge equality="true" {EDGE}/>
              <elasticity young="{insertion.youngs_modulus_pa}" damping="{DAMPING_S}"
                          poisson="{insertion.poissons_ratio}" section="circle"/>
              <contact selfcollide="none" contype="0" conaffinity="0"/>
            </flexcomp>
          </worldbody>
        </mujoco>""")
    for node in range(insertion.nodes):
        spec.body(f"rod_{node}").add_geom(
            name=f"node_{node}", type=mujoco.mjtGeom.mjGEOM_SPHERE, mass=0,
            size=[insertion.radius_m, 0, 0], contype=0, conaffinity=0,
        )
    return spec.compile()


class Rod:
    def __init__(self, insertion):
        self.insertion = insertion
        self.model = model(insertion)
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        nodes = insertion.nodes
        self.initial_x = self.data.flexvert_xpos[:, 0].copy()
        self.bodies = self.model.flex_vertbodyid
        self.dofs = self.model.body_dofadr[self.bodies]
        self.mass = self.model.body_mass[self.bodies].copy()
        twists = [f"rod_twist_{edge}" for edge in range(nodes - 2)] + ["rod_twist"]
        self.twists = np.array([self.model.jnt_dofadr[self.model.joint(name).id] for name in twists])
        self.geoms = [self.model.geom(f"node_{node}").id for node in range(nodes)]
        self.data.qvel[self.dofs] = insertion.speed_m_per_s
        self.in_guide = None
        self.cpu_s = 0.0
        # Not among the functions that Python sees: after contacts are added, the effective
        # inertia must be built again, as mj_fwdPosition does behind its own contacts.
        library = ctypes.CDLL(glob.glob(f"{mujoco.__path__[0]}/libmujoco.so*")[0])
        self.build_effective_inertia = library.mj_effBuild
        self.build_effective_inertia.argtypes = [ctypes.c_void_p, ctypes.c_void_p]
        self.build_effective_inertia.restype = None

    def feed(self, fed_m):
        """Moves the nodes in the guide; those that pass its mouth become free."""
        m, d = self.model, self.data
        inside = int(np.count_nonzero(self.initial_x + fed_m <= 0))
        if inside != self.in_guide:
            mass = np.where(np.arange(len(self.mass)) < inside, IN_GUIDE_KG, self.mass)
            m.body_mass[self.bodies] = mass
            m.dof_M0[self.dofs[:, None] + np.arange(3)] = mass[:, None]
            m.dof_armature[self.twists] = 0
            m.dof_armature[self.twists[: max(inside - 1, 0)]] = IN_GUIDE_KG_M2
            self.in_guide = inside
        x = self.dofs[:inside]
        d.qpos[x], d.qpos[x + 1], d.qpos[x + 2] = fed_m, 0, 0
        d.qvel[x], d.qvel[x + 1], d.qvel[x + 2] = self.insertion.speed_m_per_s, 0, 0

    def touch(self):
        """Hands over a contact for each node that is in the wall; gives their frames."""
        insertion = self.insertion
        nodes = self.data.flexvert_xpos[self.in_guide :]
        distance, normals = insertion.tube.wall(nodes)
        gap = distance - insertion.radius_m
        contact = mujoco.MjContact()
        contact.flex[:], contact.elem[:], contact.vert[:] = -1, -1, -1
        contact.geom1 = contact.geom[0] = 0
        contact.dim, contact.includemargin = 3, 0
        contact.friction[:] = [insertion.friction_coefficient] * 2 + [0, 0, 0]
        contact.solref[:] = [CONTACT_TIME_S, 1]
        contact.solimp[:] = [0.9, 0.95, 1e-3, 0.5, 2]
        frames = []
        for node in np.nonzero(gap < 0)[0]:
            normal = normals[node]
            across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
            across /= np.linalg.norm(across)
            frame = np.stack([normal, across, np.cross(normal, across)])
            contact.frame[:] = frame.ravel()
            contact.dist = gap[node]
            contact.pos[:] = nodes[node] - normal * insertion.radius_m
            contact.geom2 = contact.geom[1] = self.geoms[self.in_guide + node]
            mujoco.mj_addContact(self.model, self.data, contact)
            frames.append(frame)
        return frames

    def step(self):
        """One step; gives the force on the vessel [N]."""
        m, d = self.model, self.data
        begin = time.thread_time()
        mujoco.mj_fwdPosition(m, d)
        self.cpu_s += time.thread_time() - begin
        frames = self.touch()
        begin = time.thread_time()
        if frames:
            mujoco.mj_makeConstraint(m, d)
            mujoco.mj_island(m, d)
            mujoco.mj_projectConstraint(m, d)
            self.build_effective_inertia(m._address, d._address)
        mujoco.mj_fwdVelocity(m, d)
        mujoco.mj_step2(m, d)
        self.cpu_s += time.thread_time() - begin
        force = np.zeros(3)
        for contact, frame in zip(d.contact, frames):
            first = contact.efc_address
            force -= d.efc_force[first : first + 3] @ frame
        return force


def main():
    insertion = Insertion.read()
    rod = Rod(insertion)
    steps = round((insertion.end_m - insertion.start_m) / insertion.speed_m_per_s / STEP_S)
    samples = []
    for step in range(steps):
        fed_m = insertion.speed_m_per_s * STEP_S * step
        rod.feed(fed_m)
        samples.append([insertion.start_m + fed_m, *rod.step()])
    warnings = sum(int(warning.number) for warning in rod.data.warning)
    if warnings:
        sys.exit(f"MuJoCo raised {warnings} warnings; its figures would mean nothing")
    write(
        "MuJoCo", mujoco.__version__, STEP_S, rod.cpu_s, steps, samples,
        "flex rod, implicit, contacts handed over (not timed)",
    )


if __name__ == "__main__":
    main()
