"use strict";
// The controls of the page: time bar, play, zoom, clicks, and the cursor of the charts.

// Columns of steps.csv that are shown at once.
const MAIN = ["time_s", "contacts", "unsolved", "residual", "kinetic_j", "potential_j", "imbalance_j", "penetration_m", "joint_gap_m"];

(function () {
  const data = JSON.parse(document.getElementById("data").textContent);
  const get = (id) => document.getElementById(id);
  if (!data) return;
  const run = new Run(data);
  const canvas = get("scene"), bar = get("time"), play = get("play");
  const scene = new Scene(canvas, run);
  let frame = 0, share = 0, since = null;
  bar.max = run.frames - 1;
  if (run.stride > 1) get("thinned").textContent = ` One written step in ${run.stride} is shown here; all are in the CSV files.`;
  if (run.impacts_left_out) get("thinned").textContent += ` ${run.impacts_left_out} weaker impacts are in impacts.csv only.`;
  if (scene.usual > 0) get("longest").textContent = `: nine in ten of the run are below ${words(scene.usual)} N s, which is a fifth of the picture where contacts are few; longer arrows are cut at three times that`;

  if (run.stage.bodies.some((body) => body.belt)) get("belts").textContent = " Heads along an outline: its surface runs that way, as a belt.";
  // a motion of less than a second would be over at once
  if (run.end - run.start < 1) get("speed").value = [...get("speed").options].map((option) => option.value).findLast((speed) => Number(speed) * 2 <= run.end - run.start) ?? "0.01";
  const charts = [...document.querySelectorAll(".plot[data-from]")].map((plot) => {
    const [left, right, from, to] = ["left", "right", "from", "to"].map((name) => Number(plot.dataset[name]));
    const cursor = plot.querySelector("i");
    const seek = (event) => {
      if (event.buttons !== 1 && event.type !== "click") return;
      const box = plot.getBoundingClientRect();
      const along = ((event.clientX - box.left) / box.width - left) / (right - left);
      stop();
      show(run.frameAt(from + along * (to - from)), 0);
    };
    plot.addEventListener("click", seek);
    plot.addEventListener("pointermove", seek);
    return (time) => {
      cursor.style.left = 100 * (left + (right - left) * ((time - from) / (to - from))) + "%";
    };
  });

  function fill(table, figures) {
    table.replaceChildren(...figures.map(([name, value]) => {
      const row = document.createElement("tr");
      for (const text of [name, value]) {
        const cell = document.createElement("td");
        cell.textContent = text;
        row.append(cell);
      }
      row.lastChild.className = "number";
      return row;
    }));
  }
  const figures = (table, row) => table.figures(row).map(([name, value]) => [name, words(value)]);
  const nameOf = (k) => run.stage.bodies[k]?.name ?? "the world";

  function showPicked() {
    const { picked } = scene;
    get("picked-none").hidden = !!picked;
    if (!picked) {
      get("picked-name").textContent = "Nothing picked";
      return fill(get("picked"), []);
    }
    if (picked.body !== undefined) {
      const body = run.stage.bodies[picked.body];
      get("picked-name").textContent = `Body ${picked.body}: ${body.name} (${body.kind})`;
      return fill(get("picked"), figures(run.body, run.bodyRow(frame, picked.body)));
    }
    const pair = ["body_1", "body_2"].map((side) => nameOf(picked.table.get(picked.row, side)));
    const what = picked.table === run.contact ? "Contact" : "Impact";
    const free = picked.table === run.contact && run.frictionless(picked.row) ? ", without friction" : "";
    get("picked-name").textContent = `${what}: ${pair.join(" and ")}${free}`;
    const status = picked.table === run.contact ? [["status", run.status(picked.row)]] : [];
    fill(get("picked"), [...status, ...figures(picked.table, picked.row)]);
  }

  function show(to, part) {
    if (to !== frame && scene.picked && scene.picked.body === undefined) scene.picked = null;
    const changed = to !== frame || !get("now").textContent;
    frame = Math.max(0, Math.min(run.frames - 1, to));
    share = part;
    scene.draw(frame, share);
    get("hidden").textContent = scene.hidden ? ` Here the ${MOST} largest impulses have arrows, ${scene.hidden} smaller ones only a dot.` : "";
    const time = run.time(frame);
    const next = frame + 1 < run.frames ? run.time(frame + 1) : time;
    charts.forEach((place) => place(time + share * (next - time)));
    bar.value = frame;
    get("now").textContent = `t = ${words(time)} s of ${words(run.end)} s`;
    if (changed || !share) {
      const step = frame ? figures(run.step, frame - 1) : [];
      fill(get("step"), step);
      fill(get("main"), frame ? step.filter(([name]) => MAIN.includes(name)) : [["start of the run", ""]]);
      showPicked();
    }
  }

  function stop() {
    since = null;
    play.textContent = "Play";
  }
  function tick(clock) {
    if (since === null) return;
    const time = since.time + Number(get("speed").value) * (clock - since.clock) / 1000;
    const at = run.frameAt(time);
    if (at >= run.frames - 1) {
      stop();
      return show(run.frames - 1, 0);
    }
    show(at, (time - run.time(at)) / (run.time(at + 1) - run.time(at)));
    requestAnimationFrame(tick);
  }
  function start() {
    if (frame === run.frames - 1) frame = 0;
    play.textContent = "Pause";
    since = { time: run.time(frame), clock: performance.now() };
    requestAnimationFrame(tick);
  }
  play.addEventListener("click", () => {
    if (since === null) return start();
    stop();
    show(frame, 0);
  });
  get("speed").addEventListener("change", () => { if (since !== null) start(); });
  bar.addEventListener("input", () => { stop(); show(Number(bar.value), 0); });
  get("back").addEventListener("click", () => { stop(); show(frame - 1, 0); });
  get("on").addEventListener("click", () => { stop(); show(frame + 1, 0); });
  get("arrows").addEventListener("input", (event) => { scene.arrows = 10 ** (Number(event.target.value) / 2); show(frame, share); });
  get("all").addEventListener("change", (event) => { scene.all = event.target.checked; show(frame, share); });
  const middle = () => [scene.width / 2, scene.height / 2];
  get("nearer").addEventListener("click", () => { scene.nearer(1.5, middle()); show(frame, share); });
  get("farther").addEventListener("click", () => { scene.nearer(1 / 1.5, middle()); show(frame, share); });
  get("whole").addEventListener("click", () => { scene.whole(); show(frame, share); });

  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    scene.nearer(Math.exp(-0.0015 * event.deltaY), place(event));
    show(frame, share);
  }, { passive: false });
  let dragged = null;
  canvas.addEventListener("pointerdown", (event) => { dragged = { from: place(event), last: place(event), far: false }; });
  canvas.addEventListener("pointermove", (event) => {
    if (!dragged || !event.buttons) return;
    const at = place(event);
    dragged.far ||= Math.hypot(at[0] - dragged.from[0], at[1] - dragged.from[1]) > 4;
    if (!dragged.far) return;
    scene.centre[0] -= (at[0] - dragged.last[0]) / scene.scale;
    scene.centre[1] += (at[1] - dragged.last[1]) / scene.scale;
    dragged.last = at;
    show(frame, share);
  });
  canvas.addEventListener("pointerup", (event) => {
    if (dragged && !dragged.far) {
      stop();
      scene.picked = scene.find(place(event));
      show(frame, 0);
    }
    dragged = null;
  });

  // Marked pieces of the time bar, in a line for each cause: unsolved, overlap, energy balance. Problems
  // that are bounded within the limit are no failure, and not red.
  const red = get("red");
  red.width = run.red.length;
  red.height = 3;
  const paint = red.getContext("2d");
  const marks = [...run.red].map((digit) => parseInt(digit, 16));
  for (const [bit, line, colour] of [[8, 0, "#e69f00"], [1, 0, "#c00"], [2, 1, "#c00"], [4, 2, "#c00"]]) {
    paint.fillStyle = colour;
    marks.forEach((bits, k) => { if (bits & bit) paint.fillRect(k, line, 1, 1); });
  }
  // On to the first frame of the next red place, and from the last one to the first.
  const [begin, end] = [run.time(0), run.time(run.frames - 1)];
  const isRed = (at) => {
    const piece = (time) => marks.length * (time - begin) / (end - begin);
    const [from, to] = [piece(run.time(at - 1)), piece(run.time(at))];
    // those wholly inside, and that of the middle: a frame may be shorter than a piece
    return [...marks.slice(Math.ceil(from), Math.floor(to)), marks[Math.floor((from + to) / 2)]].some((bits) => bits & 7);
  };
  const next = get("next");
  next.hidden = !marks.some((bits) => bits & 7);
  next.addEventListener("click", () => {
    stop();
    const after = [...Array(run.frames).keys()].map((k) => (frame + 1 + k) % run.frames);
    show(after.find((at) => at > 0 && isRed(at) && (at === 1 || !isRed(at - 1))) ?? frame, 0);
  });

  const resize = () => { scene.fit(); show(frame, share); };
  window.addEventListener("resize", resize);
  window.addEventListener("beforeprint", resize);
  // first the moment at which something is to be seen: the last
  scene.fit();
  show(run.frames - 1, 0);
})();
