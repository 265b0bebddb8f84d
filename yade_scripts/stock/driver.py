"""The part that all scripts share: bodies, one stock bond at each integration point of a joint, stepping, records.

The text of this file, of one law and of the scene (`SCENE`, `LAW`) make a script for `yade -x -n script.py`. It needs
only YADE: a block is a clump of a core (with exact mass and inertia, without contact) and of one small sphere for each
of its bonds; two spheres that touch at an integration point carry the bond. The script writes LAW.csv, with a row for
each record, and LAW.json, the figures of the run.
"""

# The law and the head of the script define O, utils, SCENE, bond, ... ; the parts only work together.
# ruff: noqa: F821

import json
import math
import time

WEIGHTLESS = 1e-6
"""Density of the spheres [kg/m³], negligible since the core carries mass and inertia."""
INITIAL = {"energy": 0.0}
"""Kinetic, elastic and gravitational energy at the start [J]."""
NOTHING_MOVES = 1e-200
"""Length [s] of the step in which YADE sets up its bonds."""


def main():
    """Build the scene of SCENE, pull, write LAW.csv and LAW.json. Raises ArithmeticError for a record with NaN."""
    ids, members, bonds = build(SCENE)
    O.dt = SCENE["substep"]
    failed_at = {}
    rows, cpu = [measure(ids, members, bonds, None, failed_at)], []
    for record in range(SCENE["records"]):
        began = time.process_time()
        for _ in range(SCENE["substeps_per_record"]):
            O.step()
        cpu.append(time.process_time() - began)
        rows.append(measure(ids, members, bonds, rows[-1], failed_at))
        if any(value != value for value in rows[-1]):
            raise ArithmeticError(f"a number of record {record} is no number; use a shorter substep")
    write(rows, cpu, bonds, failed_at)


def build(scene):
    """Bodies and bonds → (clump of each block, block of each sphere, bonds)."""
    O.reset()
    stuff = O.materials.append(material(scene["joint"]))
    O.materials[stuff].density = WEIGHTLESS
    O.engines = engines(scene)
    ids, members = [], {}
    spheres = [[] for _ in scene["blocks"]]
    pairs = []
    for p in scene["points"]:
        pair = []
        for end, sign in (("a", -1.0), ("b", 1.0)):
            # the sphere of a lies inside a, that of b inside b; they touch at the point
            place = [x + sign * p["radius"] * n for x, n in zip(p["place"], p["normal"])]
            ball = utils.sphere(place, p["radius"], material=stuff, color=(1, 1, 1))
            if p[end] < 0:
                ball.state.blockedDOFs = "xyzXYZ"
            number = O.bodies.append(ball)
            pair.append(number)
            members[number] = p[end]
            if p[end] >= 0:
                spheres[p[end]].append(number)
        pairs.append(pair)
    for block, own in zip(scene["blocks"], spheres):
        ids.append(add_block(block, own, stuff))
    return ids, members, make_bonds(scene, pairs)


def engines(scene):
    """The engine list: contacts of spheres by the law, without numerical damping."""
    geometry, physics, law = functors(scene["joint"])
    return [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb()], verletDist=0.1 * scene["radius"]),
        InteractionLoop([geometry], [physics], [law]),
        NewtonIntegrator(damping=0, gravity=scene["gravity"], exactAsphericalRot=True),
    ]


def add_block(block, spheres, stuff):
    """Add a clump of a core without contact and the spheres of a block → its number."""
    core = utils.box(block["centre"], [0.5 * e for e in block["size"]], material=stuff)
    state = core.state
    state.ori = Quaternion(*block["orientation"])
    state.mass, state.inertia = block["mass"], block["inertia"]
    number = O.bodies.append(core)
    if spheres:
        number = O.bodies.clump([number, *spheres])
    state = O.bodies[number].state
    O.bodies[number].aspherical = True
    if block["held"]:
        state.blockedDOFs = "xyzXYZ"
    state.vel, state.angVel = block["velocity"], block["spin"]
    turn = state.ori.toRotationMatrix()
    local = turn.transpose() * Vector3(*block["spin"])
    state.angMom = turn * Vector3(*[i * w for i, w in zip(state.inertia, local)])
    return number


def make_bonds(scene, pairs):
    """Bonds [(first sphere, second sphere, joint)], with exactly the numbers of `bond`."""
    for first, second in pairs:
        utils.createInteraction(first, second)
    dt, O.dt = O.dt, NOTHING_MOVES
    O.step()
    O.dt = dt
    made = []
    for (first, second), p in zip(pairs, scene["points"]):
        set_bond(O.interactions[first, second].phys, bond(p["area"], scene["joint"], scene["variant"]))
        made.append((first, second, p["joint"]))
    return made


def measure(ids, members, bonds, last, failed_at):
    """A record (see COLUMNS); the time at which a joint has lost all its bonds goes into `failed_at`."""
    now = O.time - NOTHING_MOVES
    speed = max([math.hypot(*b["velocity"]) for b in SCENE["blocks"] if b["held"]], default=0.0)
    pull, kinetic, potential = pull_and_energies(ids, members, speed)
    elastic, whole, gone = 0.0, set(), 0
    for first, second, joint in bonds:
        listed = O.interactions.has(first, second, True)
        phys = O.interactions[first, second].phys if listed else None
        if listed:
            elastic += stored(phys)
        if listed and not failed(phys):
            whole.add(joint)
        else:
            gone += 1
    for joint in {bond[2] for bond in bonds} - whole:
        failed_at.setdefault(joint, now)
    work = 0.0 if last is None else last[5] + 0.5 * (last[2] + pull) * (now - last[0]) * speed
    lost = 0.0 if last is None else work - (kinetic + potential + elastic) + INITIAL["energy"]
    if last is None:
        INITIAL["energy"] = kinetic + potential + elastic
    return (now, now * speed, pull, kinetic, elastic, work, lost, gone, len(failed_at))


def pull_and_energies(ids, members, speed):
    """Force on the driven blocks along their motion [N]; kinetic and gravitational energy of the others [J]."""
    power, kinetic, potential = 0.0, 0.0, 0.0
    for block, number, force in zip(SCENE["blocks"], ids, force_on_blocks(members)):
        if block["held"]:
            power -= sum(f * v for f, v in zip(force, block["velocity"]))
        else:
            state = O.bodies[number].state
            kinetic += kinetic_energy(state)
            potential -= state.mass * state.pos.dot(Vector3(*SCENE["gravity"]))
    return (power / speed if speed else 0.0), kinetic, potential


COLUMNS = (
    "time", "displacement", "force", "kinetic", "stored", "work", "dissipated", "bonds_broken", "joints_broken"
)  # fmt: skip
"""[s, m, N, J, J, J, -, -]: force and displacement of the driven blocks along their motion, and its work; the
dissipated energy is the remainder of the energy balance, lost in bonds (and friction)."""


def force_on_blocks(members):
    """Force of all contacts and bonds on each block (three numbers a block) [N]."""
    force = [[0.0, 0.0, 0.0] for _ in SCENE["blocks"]]
    for i in O.interactions:
        if not i.isReal:
            continue
        f = i.phys.normalForce + i.phys.shearForce
        for end, sign in ((i.id1, -1.0), (i.id2, 1.0)):
            row = members.get(end, -1)
            if row >= 0:
                for k in range(3):
                    force[row][k] += sign * f[k]
    return force


def kinetic_energy(state):
    """Kinetic energy of a body [J]."""
    local = state.ori.toRotationMatrix().transpose() * state.angVel
    turning = sum(i * w * w for i, w in zip(state.inertia, local))
    return 0.5 * (state.mass * state.vel.dot(state.vel) + turning)


def write(rows, cpu, bonds, failed_at):
    """Write LAW.csv and LAW.json to the working directory."""
    with open(LAW + ".csv", "w", encoding="utf-8") as table:
        print(",".join(COLUMNS), file=table)
        for row in rows:
            print(",".join(f"{value:.9g}" for value in row), file=table)
    substeps = SCENE["records"] * SCENE["substeps_per_record"]
    figures = {
        "cpu_seconds": sum(cpu),
        "cheapest_substep": min(cpu) / SCENE["substeps_per_record"],
        "substeps": substeps,
        "substep": O.dt,
        "bonds": len(bonds),
        "joints": len({bond[2] for bond in bonds}),
        "blocks": len(SCENE["blocks"]),
        "failed_at": failed_at,
    }
    with open(LAW + ".json", "w", encoding="utf-8") as file:
        json.dump(figures, file)
    print(f"{LAW}: {substeps} substeps in {sum(cpu):.3g} s, largest force {max(r[2] for r in rows):.6g} N")


if __name__ == "__main__":
    main()
