"""The atlas of complaints with pymunk and MuJoCo: writes issues.csv beside this file.

    python -m venv py && py/bin/pip install pymunk==7.3.1 mujoco==4.0.0
    py/bin/python benches/peers/issues.py

Reads scenes/issues/*.toml, builds the same geometry, masses and joints, and measures by the same
closed forms and limits as `moreau2d atlas --issues`, which shows issues.csv as further columns.

Settings, none tuned to a scene:
- pymunk: Chipmunk's defaults, which are made for pixels: the thinnest moving body is 100 units thick;
  steps of 1/60 s.
- pymunk-stiff: 10 substeps of 50 iterations, collision slop 0.01 units.
- mujoco: its defaults, steps of 2 ms.
- mujoco-hard: what its documents advise against slip and softness: elliptic cones, impratio 10,
  10 no-slip iterations, contacts and joint limits with solref of two steps and solimp 0.99 0.9999.

What an engine cannot represent is left out: MuJoCo has no coefficient of restitution and no chains of
edges, and neither runs the belt of `rope-on-drum` here. Python 3.11 or newer.
"""

import copy
import csv
import math
import os
import re
import tomllib

import mujoco
import numpy as np
import pymunk

HERE = os.path.dirname(os.path.abspath(__file__))
SCENES = os.path.join(HERE, "..", "..", "scenes")
REQUIREMENTS = {"pymunk": "7.3.1", "mujoco": "4.0.0"}
HEADER = (
    "scene,rung,engine,scheme,solver,setting,dt_s,threads,precision,measure,value,unit,reference,"
    "seconds_per_simulated_second,spread,verdict,mode"
).split(",")
G = 9.81
FRAME = 1 / 60


class Cannot(Exception):
    """Why an engine cannot run a scene."""


# --- the scene file, as src/scene reads it ---------------------------------------------------------


def gear(teeth, phase):
    """As `gear` of src/scene/generate.rs."""
    pitch = 0.5 * teeth / math.tau
    parts = [{"disc": pitch - 0.14}]
    for k in range(teeth):
        angle = math.tau * (k + phase) / teeth
        corners = [[-0.2, -0.15], [0.12, -0.06], [0.12, 0.06], [-0.2, 0.15]]
        place = [pitch * math.cos(angle), pitch * math.sin(angle)]
        parts.append({"polygon": corners, "position": place, "angle": angle})
    return parts


def graft(node, change):
    """Applies `set` of a rung."""
    for key, value in change.items():
        if isinstance(node, list):
            node = {b.get("name", str(k)): b for k, b in enumerate(node)}
        if isinstance(value, dict) and "generate" in value:
            assert value["generate"] == "gear"
            node[key] = gear(value["teeth"], value["phase"])
        elif isinstance(value, dict) and key in node:
            graft(node[key], value)
        else:
            node[key] = value


def moments(shape):
    """Area, centre and moment of inertia per mass about the centre of a shape or body."""
    if "parts" in shape:
        # as src/scene does: the sum of the parts, which may overlap
        total, centre, second = 0.0, np.zeros(2), 0.0
        placed = []
        for part in shape["parts"]:
            area, middle, inertia = moments(part)
            at = np.array(part.get("position", [0, 0])) + turn(part.get("angle", 0)) @ middle
            placed.append((area, at, inertia))
            total += area
            centre = centre + area * at
        centre = centre / total
        for area, at, inertia in placed:
            second += area * (inertia + np.sum((at - centre) ** 2))
        return total, centre, second / total
    if "disc" in shape:
        return math.pi * shape["disc"] ** 2, np.zeros(2), shape["disc"] ** 2 / 2
    if "box" in shape:
        w, h = shape["box"]
        return w * h, np.zeros(2), (w * w + h * h) / 12
    if "capsule" in shape:
        length, r = shape["capsule"]
        box, ends = 2 * r * length, math.pi * r * r
        # two half discs, their centres of mass at 4 r / 3 pi from the ends of the axis
        gap = length / 2 + 4 * r / (3 * math.pi)
        half = ends * (r * r / 2 - (4 * r / (3 * math.pi)) ** 2 + gap * gap)
        return box + ends, np.zeros(2), (box * (length**2 + 4 * r * r) / 12 + half) / (box + ends)
    points = np.array(shape["polygon"], float)
    nexts = np.roll(points, -1, axis=0)
    cross = points[:, 0] * nexts[:, 1] - points[:, 1] * nexts[:, 0]
    area = cross.sum() / 2
    centre = ((points + nexts) * cross[:, None]).sum(axis=0) / (6 * area)
    squares = (points**2 + points * nexts + nexts**2).sum(axis=1)
    return area, centre, (squares * cross).sum() / (12 * area) - np.sum(centre**2)


def turn(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])


class Body:
    def __init__(self, entry):
        self.__dict__.update(
            name=entry["name"],
            kind=entry.get("kind", "dynamic"),
            position=np.array(entry.get("position", [0, 0]), float),
            angle=float(entry.get("angle", 0)),
            velocity=np.array(entry.get("velocity", [0, 0]), float),
            damping=float(entry.get("angular_damping", 0)),
            parts=entry.get("parts") or [entry],
            mass=0.0,
            inertia=0.0,
        )
        self.shape = entry
        self.centre = np.zeros(2)
        if self.kind == "dynamic":
            area, self.centre, per_mass = moments(entry)
            self.mass = entry.get("mass", entry.get("density", 1000) * area)
            self.inertia = entry.get("inertia", self.mass * per_mass)


class Scene:
    def __init__(self, name):
        with open(os.path.join(SCENES, "issues", name + ".toml"), "rb") as file:
            whole = tomllib.load(file)
        self.name = name
        self.atlas = whole.pop("atlas")
        if "base" in self.atlas:
            with open(os.path.join(SCENES, self.atlas["base"] + ".toml"), "rb") as file:
                whole = tomllib.load(file)
        for rung in self.atlas.get("rungs", []):
            graft(whole, rung.get("set", {}))
        step = whole.get("step", {})
        self.time = step.get("time", 10)
        gravity = whole.get("gravity", {})
        angle = gravity.get("angle", math.atan(gravity.get("slope", 0)))
        size = gravity.get("magnitude", G)
        self.gravity = np.array([size * math.sin(angle), -size * math.cos(angle)])
        if "y" in gravity:
            self.gravity = np.array([gravity.get("x", 0), gravity["y"]], float)
        material = whole.get("material", [{}])[0]
        self.friction = material.get("friction", 0.5)
        self.restitution = material.get("restitution", 0)
        self.joints = []
        self.bodies = []
        repeats = {r["of"]: r for r in whole.get("repeat", [])}
        for entry in whole["body"]:
            repeat = repeats.get(entry["name"])
            if repeat is None:
                self.bodies.append(Body(entry))
            else:
                self.repeat(entry, repeat)
        for joint in whole.get("joint", []):
            self.joints.append(joint)
        self.of = {b.name: b for b in self.bodies}

    def repeat(self, entry, repeat):
        if "ring" in repeat:
            raise Cannot("rings are not built here")
        counts = repeat["count"]
        for index in np.ndindex(*reversed(counts)):
            at = list(reversed(index))
            copied = copy.deepcopy(entry)
            copied["name"] = f"{entry['name']}[{','.join(map(str, at))}]"
            start = np.array(entry.get("position", [0, 0]), float)
            for k, step in zip(at, repeat["step"]):
                start = start + k * np.array(step, float)
            copied["position"] = start.tolist()
            self.bodies.append(Body(copied))
            if "pin" in repeat and at[0] > 0:
                before = self.bodies[-2]
                pin = before.position + turn(before.angle) @ np.array(repeat["pin"])
                names = [before.name, copied["name"]]
                self.joints.append({"kind": "revolute", "bodies": names, "at": pin.tolist()})


# --- a run, the same for every engine --------------------------------------------------------------


class Run:
    """States (x, y, angle, vx, vy, spin) of the bodies' origins by time, and what contacts reported."""

    def __init__(self, scene):
        self.scene = scene
        self.times, self.states = [], []
        self.penetration = 0.0
        self.most = {b.name: 0.0 for b in scene.bodies}
        self.range = {b.name: [math.inf, 0.0] for b in scene.bodies}
        self.sizes = [0.0, 0.0]
        self.dt = FRAME
        self.said = False
        self.resumed = math.nan

    def record(self, time, states):
        self.times.append(time)
        self.states.append(np.array(states, float))

    def contacts(self, time, forces, sizes):
        """`forces`: normal impulse on each body in a step; `sizes`: of all normal and tangential ones."""
        late = time > 0.9 * self.scene.time
        for body in self.scene.bodies:
            size = float(np.linalg.norm(forces.get(body.name, np.zeros(2))))
            self.most[body.name] = max(self.most[body.name], size)
            if late:
                low, high = self.range[body.name]
                self.range[body.name] = [min(low, size / self.dt), max(high, size / self.dt)]
        if late:
            self.sizes = [a + b for a, b in zip(self.sizes, sizes)]

    def finish(self):
        self.t = np.array(self.times)
        self.s = np.array(self.states)
        names = [b.name for b in self.scene.bodies]
        self.index = {n: k for k, n in enumerate(names)}
        self.moving = [k for k, b in enumerate(self.scene.bodies) if b.kind == "dynamic"]


def energies(run):
    total = np.zeros(len(run.t))
    for k in run.moving:
        body, s = run.scene.bodies[k], run.s[:, k]
        arm = np.stack([np.cos(s[:, 2]), np.sin(s[:, 2])], axis=1) * body.centre[0]
        arm += np.stack([-np.sin(s[:, 2]), np.cos(s[:, 2])], axis=1) * body.centre[1]
        place = s[:, :2] + arm
        speed = s[:, 3:5] + np.stack([-arm[:, 1], arm[:, 0]], axis=1) * s[:, 5:6]
        total += body.mass * (0.5 * (speed**2).sum(axis=1) - place @ run.scene.gravity)
        total += 0.5 * body.inertia * s[:, 5] ** 2
    return total


def stretch(run):
    gaps = np.zeros(len(run.t))
    for joint in run.scene.joints:
        if joint["kind"] not in ("revolute", "fixed"):
            continue
        places = []
        for name in joint["bodies"]:
            at = np.array(joint.get("at", [0, 0]), float)
            if name == "world":
                places.append(np.tile(at, (len(run.t), 1)))
                continue
            body, s = run.scene.of[name], run.s[:, run.index[name]]
            x, y = turn(-body.angle) @ (at - body.position)
            c, d = np.cos(s[:, 2]), np.sin(s[:, 2])
            places.append(s[:, :2] + np.stack([c * x - d * y, d * x + c * y], axis=1))
        gaps += np.linalg.norm(places[0] - places[1], axis=1)
    return gaps.max()


def past_limits(run, after):
    late = run.t >= after
    worst = 0.0
    for joint in run.scene.joints:
        if "limits" in joint and joint["kind"] == "revolute":
            angle = 0.0
            for name, sign in zip(joint["bodies"], (-1, 1)):
                if name != "world":
                    a = run.s[:, run.index[name], 2]
                    angle = angle + sign * (a - a[0])
            low, high = joint["limits"]
            worst = max(worst, np.max((angle - high)[late]), np.max((low - angle)[late]))
    return worst


def measure(run, check):
    """The value of a check, as in src/experiment/atlas/measures.rs; NaN where it is not known."""
    scene = run.scene
    k = run.index[check["body"]] if "body" in check else len(scene.bodies) - 1
    s, body = run.s[:, k], scene.bodies[k]
    steps, moving, what = run.s, run.moving, check["measure"]
    g = np.linalg.norm(scene.gravity)
    off = steps[:, moving, :2] - steps[0, moving, :2]
    late = run.t >= check.get("after", 0)
    if what == "speed-lost":
        return np.abs(s[:, 3] / check["speed"] - 1).max()
    if what == "jump":
        return max(0.0, (s[:, 1] - check["at"]).max())
    if what == "hop":
        return np.abs(s[:, 1] - check["at"]).max()
    if what == "gap":
        w, h = body.shape["box"]
        x, y = w / 2, h / 2
        corners = [s[:, 1] + np.sin(s[:, 2]) * c - np.cos(s[:, 2]) * y for c in (-x, x)]
        return max(0.0, np.minimum(*corners).max())
    if what == "off-course":
        return math.hypot(s[-1, 0] - check["x"], s[-1, 1] - check["y"])
    if what == "penetration":
        return run.penetration / check.get("size", 1)
    if what == "moved":
        return np.linalg.norm(off, axis=2).max() / check.get("size", 1)
    if what == "sinking":
        return np.abs(off[:, :, 1]).max() / check["height"]
    if what == "lean":
        return np.abs(off[:, :, 0]).max() / check["height"]
    if what == "tilt":
        return np.abs(s[:, 2] - s[0, 2]).max()
    if what == "peak":
        return abs(s[late, 1].max() / check["exact"] - 1)
    if what == "way":
        return abs(s[-1, 0] - s[0, 0])
    if what == "distance":
        return abs((s[-1, 0] - s[0, 0]) / (0.5 * check["acceleration"] * run.t[-1] ** 2) - 1)
    if what == "beyond":
        return max(0.0, s[:, 0].max() - check["at"])
    if what == "turned":
        return abs((s[-1, 2] - s[0, 2]) / check["exact"] - 1)
    if what == "teeth-skipped":
        a, b = (steps[-1, j, 2] - steps[0, j, 2] for j in moving[:2])
        return abs(check["first"] * a + check["second"] * b) / math.tau
    if what == "stretch":
        return stretch(run) / check["length"]
    if what == "past-limits":
        return past_limits(run, check.get("after", 0))
    if what == "energy-kept":
        e = energies(run)
        return abs(e[-1] / e[0] - 1)
    if what == "energy-lift":
        e = energies(run)
        mass = sum(scene.bodies[j].mass for j in moving)
        return max(0.0, (e - e[0]).max()) / (mass * g)
    if what == "impact":
        worst = 0.0
        for j in moving:
            b = scene.bodies[j]
            exact = b.mass * math.sqrt(2 * g * (steps[0, j, 1] - steps[-1, j, 1]))
            excess = abs(run.most[b.name] - exact) - b.mass * g * run.dt
            worst = max(worst, max(0.0, excess) / exact)
        return worst
    if what == "load":
        return max(abs(f / (body.mass * g) - 1) for f in run.range[body.name])
    if what == "friction-read":
        return abs(run.sizes[1] / run.sizes[0] / check["exact"] - 1) if run.sizes[0] else math.nan
    if what == "unsaid":
        return 0.0 if run.said else 1.0
    if what == "resumed":
        return run.resumed
    if what == "closed-form":
        v = scene.of["striker"].velocity[0]
        order = sorted(moving, key=lambda j: scene.bodies[j].position[0])
        if check["name"] == "last-speed":
            return abs(steps[-1, order[-1], 3] / v - 1)
        if check["name"] == "others-at-rest":
            return max(abs(steps[-1, j, 3]) for j in order[:-1]) / v
    raise Cannot(f"measure {what} is not known here")


# --- pymunk ----------------------------------------------------------------------------------------


def thickness(shape):
    if "parts" in shape:
        return max(thickness(part) for part in shape["parts"])
    if "box" in shape:
        return min(shape["box"])
    if "polygon" in shape:
        return float(np.ptp(np.array(shape["polygon"], float), axis=0).min())
    return 2 * shape.get("disc", shape.get("capsule", [0, 0])[1])


class Munk:
    def __init__(self, scene, substeps=1, iterations=None, slop=None):
        self.scene, self.substeps = scene, substeps
        self.scale = 100 / min(thickness(b.shape) for b in scene.bodies if b.kind == "dynamic")
        self.space = space = pymunk.Space()
        space.gravity = tuple(scene.gravity * self.scale)
        if iterations:
            space.iterations = iterations
        if slop:
            space.collision_slop = slop
        self.bodies = {}
        for b in scene.bodies:
            self.add(b)
        for j in scene.joints:
            self.join(j)

    def add(self, b):
        s = self.scale
        kinds = {"fixed": pymunk.Body.STATIC, "kinematic": pymunk.Body.KINEMATIC}
        if b.kind == "dynamic":
            body = pymunk.Body(b.mass, b.inertia * s * s)
            body.center_of_gravity = tuple(b.centre * s)
        else:
            body = pymunk.Body(body_type=kinds[b.kind])
        body.position, body.angle = tuple(b.position * s), b.angle
        body.velocity = tuple(b.velocity * s)
        if b.damping:
            rate = b.damping

            def damped(body, gravity, damping, dt):
                pymunk.Body.update_velocity(body, gravity, damping, dt)
                body.angular_velocity *= 1 - rate * dt

            body.velocity_func = damped
        shapes = []
        for part in b.parts:
            at, q = np.array(part.get("position", [0, 0]), float), turn(part.get("angle", 0))
            if part is b.shape:
                at, q = np.zeros(2), np.eye(2)
            place = lambda p: tuple((at + q @ np.array(p, float)) * s)
            if "disc" in part:
                shapes.append(pymunk.Circle(body, part["disc"] * s, place([0, 0])))
            elif "capsule" in part:
                half, r = part["capsule"][0] / 2, part["capsule"][1]
                shapes.append(pymunk.Segment(body, place([-half, 0]), place([half, 0]), r * s))
            elif "polyline" in part:
                ends = [place(p) for p in part["polyline"]]
                edges = [pymunk.Segment(body, a, c, 0) for a, c in zip(ends, ends[1:])]
                for k, edge in enumerate(edges):
                    edge.set_neighbors(ends[max(k - 1, 0)], ends[min(k + 2, len(ends) - 1)])
                shapes += edges
            else:
                x, y = (np.array(part["box"]) / 2) if "box" in part else (0, 0)
                corners = part.get("polygon", [[-x, -y], [x, -y], [x, y], [-x, y]])
                shapes.append(pymunk.Poly(body, [place(p) for p in corners]))
        for shape in shapes:
            # Chipmunk multiplies the two coefficients of a pair
            shape.friction = math.sqrt(self.scene.friction)
            shape.elasticity = math.sqrt(self.scene.restitution)
        self.space.add(body, *shapes)
        body.name = b.name
        self.bodies[b.name] = body

    def join(self, j):
        s, space = self.scale, self.space
        a, b = (self.bodies.get(n, space.static_body) for n in j["bodies"])
        at = tuple(np.array(j.get("at", [0, 0]), float) * s)
        joints = []
        if j["kind"] in ("revolute", "fixed"):
            joints.append(pymunk.PivotJoint(a, b, at))
            start = b.angle - a.angle
            if j["kind"] == "fixed":
                joints.append(pymunk.GearJoint(a, b, start, 1))
            if "limits" in j:
                low, high = j["limits"]
                joints.append(pymunk.RotaryLimitJoint(a, b, start + low, start + high))
            if "motor" in j:
                motor = pymunk.SimpleMotor(a, b, -j["motor"]["speed"])
                motor.max_force = j["motor"]["max_torque"] * s * s
                joints.append(motor)
        elif j["kind"] == "prismatic":
            axis = np.array(j["axis"], float)
            end = [tuple(np.array(at) + k * 1e4 * axis) for k in (-1, 1)]
            joints.append(pymunk.GrooveJoint(a, b, *end, b.world_to_local(at)))
            joints.append(pymunk.GearJoint(a, b, b.angle - a.angle, 1))
            # a force motor: its speed is far above what the scene reaches
            force = tuple(axis * j["motor"]["max_force"] * s)
            self.pushes = [(b, force)]
        else:
            raise Cannot(f"joint {j['kind']}")
        for joint in joints:
            joint.collide_bodies = False
        space.add(*joints)

    pushes = ()

    def state(self):
        s, out = self.scale, []
        for b in self.scene.bodies:
            body = self.bodies[b.name]
            v = body.velocity_at_local_point((0, 0))
            p = body.position
            out.append([p.x / s, p.y / s, body.angle, v.x / s, v.y / s, body.angular_velocity])
        return out

    def step(self, run=None, time=0.0):
        s = self.scale
        forces, sizes, seen = {}, [0.0, 0.0], set()

        def note(arbiter):
            key = tuple(id(x) for x in arbiter.shapes)
            if key in seen:
                return
            seen.add(key)
            points = arbiter.contact_point_set
            for p in points.points:
                run.penetration = max(run.penetration, -p.distance / s)
            normal = np.array(points.normal)
            total = np.array(arbiter.total_impulse) / s
            n = abs(float(total @ normal))
            sizes[0] += n
            sizes[1] += abs(float(total @ np.array([-normal[1], normal[0]])))
            for shape, sign in zip(arbiter.shapes, (-1, 1)):
                name = shape.body.name
                forces[name] = forces.get(name, np.zeros(2)) + sign * n * normal

        for _ in range(self.substeps):
            for body, force in self.pushes:
                body.apply_force_at_world_point(force, body.position)
            self.space.step(FRAME / self.substeps)
            if run:
                seen.clear()
                for b in self.scene.bodies:
                    if b.kind == "dynamic":
                        self.bodies[b.name].each_arbiter(note)
        if run:
            run.contacts(time, forces, sizes)

    def run(self):
        run = Run(self.scene)
        steps = math.ceil(self.scene.time / FRAME * (1 - 1e-12))
        asks = [c["measure"] for c in self.scene.atlas["judges"][0]["checks"]]
        watch = any(a in ("penetration", "impact", "load", "friction-read") for a in asks)
        copied = None
        run.record(0, self.state())
        for k in range(steps):
            if "resumed" in asks and k == steps // 2:
                copied = copy.copy(self)
                copied.space = self.space.copy()
                copied.bodies = {b.name: b for b in copied.space.bodies}
            self.step(run if watch else None, (k + 1) * FRAME)
            if copied:
                copied.step()
            run.record((k + 1) * FRAME, self.state())
        if copied:
            run.resumed = float(np.abs(np.array(copied.state()) - run.states[-1])[:, :3].max())
        run.finish()
        return run


# --- MuJoCo ----------------------------------------------------------------------------------------


class Joco:
    """The plane is x and z, bodies turn about -y. The kinematic tree follows the joints."""

    DT = 0.002

    def __init__(self, scene, hard=False):
        self.scene = scene
        if scene.restitution > 0:
            raise Cannot("MuJoCo has no coefficient of restitution")
        meshes, self.assets = [], {}
        parent, self.hinges = {}, {}
        for j in scene.joints:
            a, b = j["bodies"]
            if j["kind"] not in ("revolute", "fixed", "prismatic"):
                raise Cannot(f"joint {j['kind']}")
            parent[b] = (a, j)
        children = {}
        for b in scene.bodies:
            up = parent.get(b.name, ("world", None))[0]
            children.setdefault(up, []).append(b)
        actuators = []
        g = scene.gravity

        def geom(part, b, whole):
            at, angle = np.array(part.get("position", [0, 0]), float), part.get("angle", 0)
            if whole:
                at, angle = np.zeros(2), 0.0
            place = f'pos="{at[0]:.17g} 0 {at[1]:.17g}" euler="0 {-angle:.17g} 0" mass="0"'
            name = f'name="g{len(self.geoms)}"'
            self.geoms.append(b.name)
            if "disc" in part:
                return f'<geom {name} type="sphere" size="{part["disc"]}" {place}/>'
            if "box" in part:
                w, h = part["box"]
                return f'<geom {name} type="box" size="{w / 2} 0.5 {h / 2}" {place}/>'
            if "capsule" in part:
                half, r = part["capsule"][0] / 2, part["capsule"][1]
                x, y = turn(angle) @ np.array([half, 0])
                ends = " ".join(f"{float(v):.17g}" for v in (at[0] - x, 0, at[1] - y, at[0] + x, 0, at[1] + y))
                return f'<geom {name} type="capsule" fromto="{ends}" size="{r}" mass="0"/>'
            if "polygon" in part:
                points = [(x, y, z) for x, z in part["polygon"] for y in (-0.5, 0.5)]
                # MuJoCo centres the mesh, and keeps its place in the body
                text = " ".join(f"{v:.17g}" for p in points for v in p)
                mesh = f"m{len(meshes)}"
                meshes.append(f'<mesh name="{mesh}" vertex="{text}" inertia="shell"/>')
                return f'<geom {name} type="mesh" mesh="{mesh}" {place}/>'
            raise Cannot("MuJoCo has no chains of edges")

        self.geoms = []

        def write(b, base):
            """The body in the frame of its parent, which starts at `base`: position, angle."""
            at = turn(-base[1]) @ (b.position - base[0])
            angle = b.angle - base[1]
            pos = f"{float(at[0]):.17g} 0 {float(at[1]):.17g}"
            mocap = ' mocap="true"' if b.kind == "kinematic" else ""
            out = f'<body name="{b.name}" pos="{pos}" euler="0 {-angle:.17g} 0"{mocap}>'
            if b.kind == "dynamic":
                c, i = b.centre, b.inertia
                out += f'<inertial pos="{c[0]:.17g} 0 {c[1]:.17g}" mass="{b.mass}" diaginertia="{i} {i} {i}"/>'
                up, j = parent.get(b.name, ("world", None))
                if j is None:
                    out += f'<joint name="{b.name} x" type="slide" axis="{math.cos(b.angle):.17g} 0 {-math.sin(b.angle):.17g}"/>'
                    out += f'<joint name="{b.name} z" type="slide" axis="{math.sin(b.angle):.17g} 0 {math.cos(b.angle):.17g}"/>'
                    # in the body's own frame: the centre of mass need not be its origin
                    out += f'<joint name="{b.name} r" type="hinge" axis="0 -1 0" damping="{b.damping * b.inertia}"/>'
                elif j["kind"] == "revolute":
                    pin = turn(-b.angle) @ (np.array(j.get("at", [0, 0]), float) - b.position)
                    limits = ""
                    if "limits" in j:
                        limits = f'limited="true" range="{j["limits"][0]} {j["limits"][1]}"'
                    out += f'<joint name="{b.name} r" type="hinge" axis="0 -1 0" pos="{pin[0]:.17g} 0 {pin[1]:.17g}" {limits} damping="{b.damping * b.inertia}"/>'
                    if "motor" in j:
                        m = j["motor"]
                        top = m["max_torque"]
                        # a speed servo that reaches its largest torque at 1 % below the speed
                        gain = top / (0.01 * abs(m["speed"]))
                        actuators.append(f'<velocity joint="{b.name} r" kv="{gain}" forcerange="{-top} {top}"/>')
                elif j["kind"] == "prismatic":
                    axis = turn(-b.angle) @ np.array(j["axis"], float)
                    out += f'<joint name="{b.name} p" type="slide" axis="{axis[0]:.17g} 0 {axis[1]:.17g}"/>'
                    actuators.append(f'<motor joint="{b.name} p" forcelimited="false"/>')
                self.hinges[b.name] = j
            out += "".join(geom(p, b, p is b.shape) for p in b.parts)
            for child in children.get(b.name, []):
                out += write(child, (b.position, b.angle))
            return out + "</body>"

        tree = "".join(write(b, (np.zeros(2), 0.0)) for b in children.get("world", []))
        # the integrator that MuJoCo's documents give for speed servos
        servo = ' integrator="implicitfast"' if any("<velocity" in a for a in actuators) else ""
        option = f'timestep="{self.DT}" gravity="{g[0]:.17g} 0 {g[1]:.17g}"{servo}'
        default, limits = f'friction="{scene.friction} 0 0" condim="3"', ""
        if hard:
            option += ' cone="elliptic" impratio="10" noslip_iterations="10"'
            default += f' solref="{2 * self.DT} 1" solimp="0.99 0.9999 0.0001"'
            limits = f'<joint solreflimit="{2 * self.DT} 1" solimplimit="0.99 0.9999 0.0001"/>'
        xml = f"""<mujoco><compiler angle="radian" inertiafromgeom="false"/>
            <option {option}/><default><geom {default}/>{limits}</default>
            <asset>{"".join(meshes)}</asset><worldbody>{tree}</worldbody>
            <actuator>{"".join(actuators)}</actuator></mujoco>"""
        self.model = mujoco.MjModel.from_xml_string(xml)
        self.data = mujoco.MjData(self.model)
        self.ids = {b.name: self.model.body(b.name).id for b in scene.bodies}
        self.start()

    def start(self):
        model, data = self.model, self.data
        mocap = 0
        self.driven = []
        for b in self.scene.bodies:
            if b.kind == "kinematic":
                self.driven.append((mocap, b))
                mocap += 1
            elif b.kind == "dynamic" and self.hinges.get(b.name) is None:
                data.joint(b.name + " x").qvel[0] = b.velocity[0]
                data.joint(b.name + " z").qvel[0] = b.velocity[1]
        k = 0
        for b in self.scene.bodies:
            j = self.hinges.get(b.name)
            if j and "motor" in j:
                m = j["motor"]
                data.ctrl[k] = m["speed"] if j["kind"] == "revolute" else m["max_force"]
                k += 1
        mujoco.mj_forward(model, data)
        self.turns = {b.name: b.angle for b in self.scene.bodies}

    def state(self, data):
        out = []
        velocity = np.zeros(6)
        for b in self.scene.bodies:
            k = self.ids[b.name]
            x, _, z = data.xpos[k]
            m = data.xmat[k]
            angle = math.atan2(m[6], m[0])
            last = self.turns[b.name]
            angle += math.tau * round((last - angle) / math.tau)
            self.turns[b.name] = angle
            mujoco.mj_objectVelocity(self.model, data, mujoco.mjtObj.mjOBJ_XBODY, k, velocity, 0)
            out.append([x, z, angle, velocity[3], velocity[5], -velocity[1]])
        return out

    def push(self, data, time):
        for k, b in self.driven:
            x, z = b.position + b.velocity * time
            data.mocap_pos[k] = [x, 0, z]

    def contacts(self, run, time):
        data, forces, sizes = self.data, {}, [0.0, 0.0]
        six = np.zeros(6)
        for k in range(data.ncon):
            c = data.contact[k]
            run.penetration = max(run.penetration, -c.dist)
            mujoco.mj_contactForce(self.model, data, k, six)
            normal = np.array([c.frame[0], c.frame[2]])
            sizes[0] += abs(six[0]) * self.DT
            sizes[1] += math.hypot(six[1], six[2]) * self.DT
            for geom, sign in zip((c.geom1, c.geom2), (-1, 1)):
                name = self.geoms[geom]
                forces[name] = forces.get(name, np.zeros(2)) + sign * six[0] * self.DT * normal
        run.contacts(time, forces, sizes)

    def run(self):
        scene, model, data = self.scene, self.model, self.data
        run = Run(scene)
        run.dt = self.DT
        steps = math.ceil(scene.time / self.DT * (1 - 1e-12))
        asks = [c["measure"] for c in scene.atlas["judges"][0]["checks"]]
        watch = any(a in ("penetration", "impact", "load", "friction-read") for a in asks)
        every = max(1, steps // 20000)
        other = None
        run.record(0, self.state(data))
        k = 0
        while k < steps:
            if "resumed" in asks and k == steps // 2:
                kind = mujoco.mjtState.mjSTATE_INTEGRATION
                saved = np.zeros(mujoco.mj_stateSize(model, kind))
                mujoco.mj_getState(model, data, saved, kind)
                other = mujoco.MjData(model)
                mujoco.mj_setState(model, other, saved, kind)
            self.push(data, k * self.DT)
            mujoco.mj_step(model, data, every)
            if other is not None:
                self.push(other, k * self.DT)
                mujoco.mj_step(model, other, every)
            k += every
            if watch:
                self.contacts(run, k * self.DT)
            run.record(k * self.DT, self.state(data))
        run.said = any(w.number > 0 for w in data.warning)
        if other is not None:
            run.resumed = float(np.abs(other.qpos - data.qpos).max())
        run.finish()
        return run


# --- the table -------------------------------------------------------------------------------------

ENGINES = [
    ("pymunk", "pymunk", "default", FRAME, "f64", lambda s: Munk(s)),
    ("pymunk-stiff", "pymunk", "10 substeps of 50 iterations", FRAME, "f64",
     lambda s: Munk(s, 10, 50, 0.01)),
    ("mujoco", "mujoco", "default", Joco.DT, "f64", lambda s: Joco(s)),
    ("mujoco-hard", "mujoco", "elliptic; impratio 10; noslip 10; solref 2 steps; solimp 0.99", Joco.DT,
     "f64", lambda s: Joco(s, hard=True)),
]


def modes():
    """Unit and mode of failure of each measure, from the table in measures.rs."""
    source = os.path.join(HERE, "..", "..", "src", "experiment", "atlas", "measures.rs")
    with open(source, encoding="utf-8") as file:
        text = file.read()
    row = re.compile(r'row\("([a-z-]+)", &\[.*?\], (RELATIVE|"[^"]*"), "([a-z-]+)",')
    return {m[1]: ("relative error" if m[2] == "RELATIVE" else m[2].strip('"'), m[3]) for m in row.finditer(text)}


def judge(name, engine, known):
    label, library, setting, dt, precision, build = engine
    base = dict.fromkeys(HEADER, "")
    version = REQUIREMENTS[library]
    base.update(scene=name, engine=label, solver="soft", setting=f"{library} {version}: {setting}",
                dt_s=repr(dt), threads="1", precision=precision)
    try:
        scene = Scene(name)
        run = build(scene).run()
        judge = scene.atlas["judges"][0]
        rows, broken = [], None
        for check in judge["checks"]:
            value = float(measure(run, check))
            unit, fails = known[check["measure"]]
            limit = check.get("limit", math.inf)
            if broken is None and not value <= limit:
                broken = check.get("fails", fails)
            rows.append({**base, "measure": check.get("name", check["measure"]), "value": repr(value),
                         "unit": check.get("unit", unit), "reference": f"at most {limit:g}"})
        rows.append({**base, "measure": "said", "value": repr(float(run.said)), "unit": "yes or no",
                     "reference": "at most inf"})
        verdict, mode = ("pass", judge.get("mode", judge["name"])) if broken is None else ("fail", broken)
        if not np.isfinite(run.s).all():
            verdict, mode = "fail", "explodes"
        return [{**row, "verdict": verdict, "mode": mode} for row in rows]
    except Cannot as why:
        print(f"{name}, {label}: cannot: {why}")
        return [{**base, "measure": "verdict", "value": "NaN", "mode": "cannot"}]


def main():
    for library, module in (("pymunk", pymunk.version), ("mujoco", mujoco.__version__)):
        assert module == REQUIREMENTS[library], f"{library} {module}, not {REQUIREMENTS[library]}"
    with open(os.path.join(HERE, "..", "..", "src", "scene", "issues.rs"), encoding="utf-8") as file:
        names = re.findall(r'"([a-z-]+)"', file.read().split('"issues":')[1].split("};")[0])
    known = modes()
    rows = []
    for name in names:
        for engine in ENGINES:
            found = judge(name, engine, known)
            worst = ", ".join(f"{r['measure']} {float(r['value']):.3g}" for r in found)
            print(f"{name:18} {engine[0]:13} {found[0]['verdict']:5} {found[0]['mode']:14} {worst}", flush=True)
            rows += found
    with open(os.path.join(HERE, "issues.csv"), "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, HEADER, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
