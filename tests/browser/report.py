#!/usr/bin/env python3
"""Opens pages of `--report` in a headless Chromium, without network, and uses them.

    tests/browser/report.py PROGRAM

Checks that no error is on the console, that dragging the time bar changes picture and numbers, that
the figures of a clicked body and contact are those of the CSV files, that nothing is wider than a
screen of 400 pixels, and that the page can be printed. Ends with 0 where no Chromium is at hand, and
says so.
"""

import csv
import html
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

HERE = os.path.dirname(os.path.abspath(__file__))
# scene, arguments, whether it has contacts to click on; None for a machine without a replay
PAGES = [
    ("tower", ["--steps", "40"], True),
    ("chain", ["--time", "1"], True),
    ("bouncing-ball", ["--events", "--set", 'scene.title="</script><b>&"'], True),
    # a limit that makes red what is only bounded
    ("hit-heap", ["--time", "3", "--every", "5", "--set", "verdict.bounded=0"], True),
    ("pin-on-disc", [], True),
    ("thresher-study", [], None),
    ("thresher", "--every 5 --set step.dt=3.2e-4 --set wear.jump=2e-3 --set wear.revolutions=1 --set wear.max_hours=5".split(), True),
]
# pages without a replay, of other commands
COMPARED = [
    ["compare", "sliding-block", "--repeats", "1", "--no-sweep"],
    ["chart", "sliding-block", "--quick"],
    ["atlas", "tower", "--quick"],
]
WIDTHS = [400, 1280]
# no window of a browser is narrower than some 500 pixels, a frame is as narrow as it is told
FRAME = """<!doctype html><iframe src="probed.html" style="width:%dpx;height:900px;border:0"></iframe>
<pre id="found"></pre><script>
addEventListener("message", (event) => { document.getElementById("found").textContent = event.data; });
</script>"""


def browse(browser, page, width, *more):
    """Standard output and console messages of the browser on a page."""
    with tempfile.TemporaryDirectory() as profile:
        command = [
            browser, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
            "--user-data-dir=" + profile, "--host-resolver-rules=MAP * ~NOTFOUND",
            "--enable-logging=stderr", "--window-size=%d,900" % width,
            "--virtual-time-budget=5000", *more, "file://" + page,
        ]
        done = subprocess.run(command, capture_output=True, text=True, timeout=180)
    return done.stdout, [l for l in done.stderr.splitlines() if "CONSOLE" in l]


def rows(folder, name):
    with open(os.path.join(folder, name)) as file:
        return list(csv.DictReader(file))


def same(figures, row, page):
    """Every figure shown is that of the row, rounded to six digits."""
    shown = 0
    for name, text in figures:
        if name == "status":
            assert row["status"] == text, (page, row["status"], text)
        elif text == "—":
            assert row[name] == "", (page, name, row[name])
        else:
            assert float("%.6g" % float(row[name])) == float(text), (page, name, row[name], text)
        shown += 1
    assert shown > 4, (page, figures)


def written(program, scene, args, root, command="run"):
    """The folder of a run with its page."""
    folder = os.path.join(root, "%s-%s" % (command, scene))
    done = subprocess.run([program, command, scene, *args, "--report", "--quiet", "--out", folder])
    assert done.returncode in (0, 2), (scene, done.returncode)
    return folder


def check(browser, folder, scene, contacts, width, command="run"):
    page = os.path.join(folder, "report.html")
    text = open(page).read()
    probe = open(os.path.join(HERE, "probe.js")).read()
    copy = os.path.join(folder, "probed.html")
    with open(copy, "w") as file:
        file.write(text.replace("</body>", "<script>%s</script></body>" % probe))
    outer = os.path.join(folder, "frame.html")
    with open(outer, "w") as file:
        file.write(FRAME % width)
    dom, console = browse(browser, outer, 1400, "--dump-dom")
    assert not console, (scene, console)
    found = re.search(r'<pre id="found">(.*?)</pre>', dom, re.S)
    assert found and found.group(1), (scene, "the page did not run to its end")
    found = json.loads(html.unescape(found.group(1)))
    assert found["width"] == width, found["width"]
    assert found["wide"] <= width, "%s is %d pixels wide at %d" % (scene, found["wide"], width)
    assert found["smallest"] >= 12, found["smallest"]
    # text of 12.5 in the charts
    assert found["charts"] and min(12.5 * scale for scale in found["charts"]) >= 8.5, found["charts"]
    for word in ("What came out", "Trust", "What to do"):
        assert word in found["lead"], found["lead"]
    if contacts is None:
        print("%s %s at %d pixels" % (command, scene, width))
        return
    assert found["played"] != found["start"]["now"], "it does not play"
    start, middle = found["start"], found["middle"]
    for what in ("canvas", "now", "step"):
        if scene != "tower" or what != "canvas":  # a tower stands as it stood
            assert start[what] != middle[what], (scene, what)
    # contacts lie on the bodies as they are drawn
    assert found["off"] < 1e-3, (scene, found["off"])
    steps, bodies = rows(folder, "steps.csv"), rows(folder, "bodies.csv")
    hidden, differs = found["arrows"]
    assert differs == (hidden > 0), (scene, found["arrows"])
    if scene == "hit-heap":
        # what is not solved between two written steps is red as well
        red = found["next"]["frame"]
        same(found["next"]["step"], steps[red - 1], scene)
        assert [k for k, step in enumerate(steps, 1) if int(step["unsolved"])][0] == red, red
    kinds = set()
    for pick in found["picks"]:
        step = steps[pick["frame"] - 1]
        same(pick["step"], step, scene)
        kind = pick["name"].split()[0].rstrip(":")
        kinds.add(kind)
        if kind == "Body":
            k = pick["name"].split()[1].rstrip(":")
            mine = [b for b in bodies if b["body"] == k and b["time_s"] == step["time_s"]]
            same(pick["figures"], mine[0], scene)
        else:
            near = [c for c in rows(folder, "contacts.csv") if all(
                name == "status" or float("%.6g" % float(c[name])) == float(value)
                for name, value in pick["figures"])]
            assert near, (scene, pick)
            same(pick["figures"], near[0], scene)
    assert "Body" in kinds and (not contacts or "Contact" in kinds), (scene, kinds)
    if width == WIDTHS[-1]:
        pdf = os.path.join(folder, "page.pdf")
        _, console = browse(browser, page, width, "--print-to-pdf=" + pdf)
        assert not console, console
        assert open(pdf, "rb").read(5) == b"%PDF-", "not printed"
    print("%s at %d pixels: %d frames, %d picks, as in the CSV files"
          % (scene, width, found["frames"], len(found["picks"])))


def check_moving(browser, picture, root):
    """The moving picture plays: after one, two and three seconds it shows something else; without its values
    it does not."""
    text = open(picture).read()
    name = os.path.basename(picture)
    size = len(text.encode())
    assert size < 500000, (name, size)
    still = re.sub(r'<animate(Transform)? [^>]*/>', "", text)
    assert still != text, (name, "no animation")

    def shown(svg):
        page, shot = os.path.join(root, "moving.svg"), os.path.join(root, "moving.png")
        with open(page, "w") as file:
            file.write(svg)
        shots = set()
        for milliseconds in (1000, 2000, 3000):
            _, console = browse(browser, page, 800, "--run-all-compositor-stages-before-draw",
                                "--virtual-time-budget=%d" % milliseconds, "--screenshot=" + shot)
            assert not console, (name, console)
            shots.add(open(shot, "rb").read())
        return len(shots)

    assert shown(text) == 3, (name, "does not move")
    assert shown(still) == 1, (name, "moves without an animation")
    print("%s: %d kB, plays" % (name, size // 1000))


def main():
    names = ["chromium", "chromium-browser", "google-chrome", "chrome"]
    browser = next(filter(None, map(shutil.which, names)), None)
    if browser is None:
        print("no Chromium at hand: the pages are not tried in a browser")
        return
    program = os.path.abspath(sys.argv[1])
    with tempfile.TemporaryDirectory() as root:
        check_moving(browser, os.path.join(HERE, "../../benches/charts/hit-heap-moving.svg"), root)
        drawn = os.path.join(root, "moving")
        subprocess.run([program, "run", "pendulum", "--animate", "--quiet", "--out", drawn], check=True)
        check_moving(browser, os.path.join(drawn, "scene-moving.svg"), root)
        pages = [("run", *page) for page in PAGES]
        pages += [(command, scene, args, None) for command, scene, *args in COMPARED]

        def both(page):
            command, scene, args, contacts = page
            folder = written(program, scene, args, root, command)
            for width in WIDTHS:
                check(browser, folder, scene, contacts, width, command)

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(both, pages))


main()
