"""Random scenes, run by the program and checked by geometry that is not its own.

    python -m venv py && py/bin/pip install shapely==2.2.0
    cargo build --release
    py/bin/python benches/peers/fuzz.py target/release/moreau2d --first 0 --count 1000

Each scene drops 1 to 10 bodies into a closed container with one of six floors. From `bodies.csv`
alone, with shapely, it looks for bodies that lie in each other at the end, for bodies that left the
container, and for energy out of nothing. A scene is

- `held`: the program says so, and the geometry agrees;
- `said`: something is wrong, and the program said so (exit code 2);
- `strict`: only the program finds fault: its limits are lower, and it sees every step;
- `silent`: something is wrong, and the program said nothing. This is a fault of the program.

The same number always makes the same scene. The exit code is 1 if a scene is silent.
"""

import argparse
import collections
import csv
import json
import math
import os
import random
import subprocess
import tempfile

from shapely.affinity import affine_transform
from shapely.geometry import LineString, Point, Polygon
from shapely.ops import unary_union

KINDS = ["disc", "box", "capsule", "hull", "star", "parts"]
FLOORS = ["box", "tiles", "chain", "closed", "vee", "steps"]
DENSITY = 1000.0
GRAVITY = 9.81
# depth over the diameter of the smaller body, for the last 0.3 s, and growth of energy, that count as
# wrong; the program's own limits are half of that, and less
DEEP = 2e-3
GAIN = 5e-3
WALL = Polygon([(-0.5, -8), (0.5, -8), (0.5, 8), (-0.5, 8)])
LID = Polygon([(-6, -0.5), (6, -0.5), (6, 0.5), (-6, 0.5)])

# name, keys of the file, outline, diameter [m], start (x, y, angle), velocity (vx, vy, spin), fixed
Body = collections.namedtuple("Body", "name keys outline size start velocity fixed")


def placed(outline, pose):
    x, y, angle = pose
    c, s = math.cos(angle), math.sin(angle)
    return affine_transform(outline, [c, -s, s, c, x, y])


def corners(points):
    return [(round(x, 6), round(y, 6)) for x, y in points]


def listed(points):
    return "[" + ", ".join("[%r, %r]" % p for p in points) + "]"


def rectangle(width, height, x=0.0, y=0.0):
    w, h = 0.5 * width, 0.5 * height
    return Polygon([(x - w, y - h), (x + w, y - h), (x + w, y + h), (x - w, y + h)])


def hull(draw, size):
    """A convex polygon about its centroid, not too slender."""
    while True:
        angles = sorted(draw.uniform(0, math.tau) for _ in range(draw.randint(3, 7)))
        shape = Polygon([(size * math.cos(a), size * math.sin(a)) for a in angles]).convex_hull
        if shape.geom_type == "Polygon" and shape.area > 0.3 * size * size:
            break
    points = list(shape.exterior.coords)[:-1]
    points = points if shape.exterior.is_ccw else points[::-1]
    return corners((x - shape.centroid.x, y - shape.centroid.y) for x, y in points)


def star(draw, size):
    tips = draw.randint(3, 7)
    points = []
    for k in range(2 * tips):
        angle = math.pi * k / tips + draw.uniform(-0.1, 0.1)
        r = size * (1 if k % 2 == 0 else draw.uniform(0.4, 0.9))
        points.append((r * math.cos(angle), r * math.sin(angle)))
    return corners(points)


def shape(draw, kind, smallest):
    """Keys of the file, and outline, of a random body of a kind."""
    s = draw.uniform(smallest, 0.6)
    if kind == "disc":
        return f"disc = {s!r}", Point(0, 0).buffer(s, 64)
    if kind == "box":
        t = s * draw.uniform(0.3, 1.0)
        return f"box = [{2 * s!r}, {2 * t!r}]", rectangle(2 * s, 2 * t)
    if kind == "capsule":
        r = s * draw.uniform(0.2, 0.8)
        line = LineString([(-s, 0), (s, 0)])
        return f"capsule = [{2 * s!r}, {r!r}]", line.buffer(r, 64)
    if kind == "hull":
        points = hull(draw, s)
        return f"polygon = {listed(points)}", Polygon(points)
    if kind == "star":
        points = star(draw, s)
        return f"polyline = {listed(points)}\nclosed = true", Polygon(points)
    w = 0.6 * s
    parts = f"{{ box = [{2 * s!r}, {w!r}] }}, {{ box = [{w!r}, {2 * s!r}], position = [{s!r}, 0] }}"
    both = unary_union([rectangle(2 * s, w), rectangle(w, 2 * s, s)])
    return f"parts = [{parts}]", both


def floor(draw, kind):
    """The fixed bodies of a container from x = -5 to 5, as (keys, outline, place)."""
    walls = [("box = [1, 16]", WALL, (x, 7.0)) for x in (-5.5, 5.5)]
    walls.append(("box = [12, 1]", LID, (0.0, 15.5)))
    if kind == "box":
        return [("box = [12, 1]", LID, (0.0, -0.5))] + walls
    if kind == "tiles":
        tile = ("box = [1, 1]", rectangle(1, 1))
        return [tile + ((k - 5.5, -0.5),) for k in range(12)] + walls
    if kind == "steps":
        step = lambda h: (f"box = [3, {h!r}]", rectangle(3, h))
        return [step(1.0 + 0.3 * (k % 2)) + ((-4.5 + 3 * k, -0.5),) for k in range(4)] + walls
    if kind == "vee":
        left = [(-6, -2), (0, -2), (0, -1), (-6, 2)]
        right = [(0, -2), (6, -2), (6, 2), (0, -1)]
        halves = [(f"polygon = {listed(p)}", Polygon(p), (0.0, 0.0)) for p in (left, right)]
        return halves + walls
    count = draw.randint(3, 12)
    top = corners((-6 + 12 * k / count, draw.uniform(-0.4, 0.4)) for k in range(count + 1))
    if kind == "chain":
        solid = Polygon(top + [(6, -5), (-6, -5)])
        return [(f"polyline = {listed(top[::-1])}", solid, (0.0, 0.0))] + walls
    ring = [(-6, -2), (6, -2)] + top[::-1]
    return [(f"polyline = {listed(ring)}\nclosed = true", Polygon(ring), (0.0, 0.0))] + walls


def scene(seed, kinds, smallest):
    """The text of a random scene, and its bodies."""
    draw = random.Random(seed)
    dt = 1 / draw.choice([30, 60, 60, 120, 240])
    events = draw.random() < 0.3
    restitution = draw.choice([0, 0, 0.3, 0.8, 1.0])
    friction = draw.choice([0, 0.3, 0.5, 1.0])
    speed = draw.choice([0, 1, 5, 20])
    kinds = draw.sample(kinds, draw.randint(1, len(kinds)))
    ground = floor(draw, draw.choice(FLOORS))
    bodies = [
        Body(f"floor{k}", keys, outline, math.inf, (*place, 0.0), (0.0, 0.0, 0.0), True)
        for k, (keys, outline, place) in enumerate(ground)
    ]
    for k in range(draw.randint(1, 10)):
        keys, outline = shape(draw, draw.choice(kinds), smallest)
        size = 2 * max(math.hypot(*p) for p in outline.exterior.coords)
        for _ in range(60):
            start = (draw.uniform(-3.8, 3.8), draw.uniform(1.5, 9), draw.uniform(-3, 3))
            here = placed(outline, start)
            inside = here.bounds[0] > -4.9 and here.bounds[2] < 4.9 and here.bounds[1] > 1
            if inside and all(here.distance(placed(b.outline, b.start)) > 0.02 for b in bodies):
                velocity = tuple(draw.gauss(0, speed) for _ in range(3))
                bodies.append(Body(f"b{k}", keys, outline, size, start, velocity, False))
                break
    text = (
        f'[scene]\nname = "fuzz-{seed}"\ntitle = "Random scene {seed}"\n'
        f"[step]\ndt = {dt!r}\ntime = 3\nevents = {str(events).lower()}\n"
        f'[[material]]\nname = "m"\nfriction = {friction}\nrestitution = {restitution}\n'
    )
    for body in bodies:
        x, y, angle = body.start
        vx, vy, spin = body.velocity
        text += f'[[body]]\nname = "{body.name}"\n{body.keys}\nposition = [{x!r}, {y!r}]\n'
        if body.fixed:
            text += 'kind = "fixed"\n'
        else:
            text += f"angle = {angle!r}\nvelocity = [{vx!r}, {vy!r}]\nspin = {spin!r}\n"
    return text, bodies


def depth(a, b):
    """How deep two outlines lie in each other: the largest distance of a corner of their common part
    from the outline that it does not lie on."""
    common = a.intersection(b)
    parts = getattr(common, "geoms", [common])
    points = [Point(p) for q in parts if q.geom_type == "Polygon" for p in q.exterior.coords]
    return max((max(a.boundary.distance(p), b.boundary.distance(p)) for p in points), default=0.0)


def energy(bodies, states):
    """Kinetic and potential energy [J]; None if the mass of a body is not that of its outline."""
    total = 0.0
    for body, (x, y, angle, vx, vy, spin) in zip(bodies, states):
        if body.fixed:
            continue
        if "parts" in body.keys:
            return None
        area, centre = body.outline.area, body.outline.centroid
        second = 0.0
        ring = list(body.outline.exterior.coords)
        for (x0, y0), (x1, y1) in zip(ring, ring[1:]):
            squares = x0 * x0 + x0 * x1 + x1 * x1 + y0 * y0 + y0 * y1 + y1 * y1
            second += (x0 * y1 - x1 * y0) * squares / 12
        inertia = abs(second) - area * (centre.x**2 + centre.y**2)
        height = y + math.sin(angle) * centre.x + math.cos(angle) * centre.y
        total += DENSITY * (0.5 * area * (vx * vx + vy * vy) + 0.5 * inertia * spin * spin)
        total += DENSITY * area * GRAVITY * height
    return total


def faults(bodies, path):
    """What is wrong with a run, from its `bodies.csv` alone."""
    frames = collections.defaultdict(dict)
    with open(path) as rows:
        for row in csv.DictReader(rows):
            keys = "x_m y_m angle_rad vx_m_s vy_m_s omega_rad_s".split()
            frames[float(row["time_s"])][int(row["body"])] = [float(row[k]) for k in keys]
    times = sorted(frames)
    found = []
    least = {}
    for time in [t for t in times if t > times[-1] - 0.3]:
        here = [placed(b.outline, frames[time][k][:3]) for k, b in enumerate(bodies)]
        for i, one in enumerate(bodies):
            for j in range(i):
                if not one.fixed and here[i].intersects(here[j]):
                    size = min(one.size, bodies[j].size)
                    share = depth(here[i], here[j]) / size
                else:
                    share = 0.0
                least[i, j] = min(least.get((i, j), math.inf), share)
    for (i, j), share in least.items():
        if share > DEEP:
            found.append(f"{bodies[j].name} and {bodies[i].name} overlap by {share:.2g}")
    for k, body in enumerate(bodies):
        x, y = frames[times[-1]][k][:2]
        if not body.fixed and not (-5.2 < x < 5.2 and -2.2 < y < 15.2):
            found.append(f"{body.name} has left the container")
    energies = [energy(bodies, [frames[t][k] for k in range(len(bodies))]) for t in times]
    if energies[0] is not None and max(energies) > energies[0] + GAIN * abs(energies[0]) + 1e-6:
        found.append(f"energy grew from {energies[0]:.6g} to {max(energies):.6g} J")
    return found


def judge(program, text, bodies):
    """One of the four words of the head of this file, and why."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "scene.toml")
        with open(path, "w") as file:
            file.write(text)
        out = os.path.join(folder, "out")
        command = [program, "run", path, "--out", out, "--quiet"]
        ended = subprocess.run(command, capture_output=True, text=True)
        if ended.returncode not in (0, 2):
            return "silent", f"exit code {ended.returncode}: {ended.stderr.strip()}"
        with open(os.path.join(out, "summary.json")) as file:
            sentence = json.load(file)["verdict"]["sentence"]
        found = faults(bodies, os.path.join(out, "bodies.csv"))
    if not found:
        return ("held", "") if ended.returncode == 0 else ("strict", sentence)
    word = "said" if ended.returncode == 2 else "silent"
    return word, "; ".join(found)


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("program", help="path of moreau2d")
    arguments.add_argument("--first", type=int, default=0, help="number of the first scene")
    arguments.add_argument("--count", type=int, default=100)
    arguments.add_argument("--kinds", default=",".join(KINDS), help="kinds of bodies")
    arguments.add_argument("--smallest", type=float, default=0.1, help="least radius of a body [m]")
    arguments.add_argument("--keep", help="folder for the scenes that are not held")
    chosen = arguments.parse_args()
    totals = collections.Counter()
    for seed in range(chosen.first, chosen.first + chosen.count):
        text, bodies = scene(seed, chosen.kinds.split(","), chosen.smallest)
        word, why = judge(os.path.abspath(chosen.program), text, bodies)
        totals[word] += 1
        if word == "held":
            continue
        print(f"{seed} {word}: {why}", flush=True)
        if chosen.keep:
            os.makedirs(chosen.keep, exist_ok=True)
            with open(os.path.join(chosen.keep, f"fuzz-{seed}.toml"), "w") as file:
                file.write(text)
    print(", ".join(f"{totals[word]} {word}" for word in ("held", "strict", "said", "silent")))
    raise SystemExit(1 if totals["silent"] else 0)


if __name__ == "__main__":
    main()
