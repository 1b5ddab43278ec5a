"use strict";
// Draws a frame of the run on a canvas, and finds what was clicked.

// Bodies that are turned, with an arrow for the sense; a machine's steel is in front of its crop.
const TURNED = ["kinematic", "driven"];
const MOVED = ["dynamic", "coordinate"]; // by impulses
const KINDS = ["fixed", "kinematic", "dynamic", "coordinate", "driven"];
const FILL = { driven: ["#f5e3c3", "#8a6d2f"], fixed: ["#e2e2e2", "#7a7a7a"], kinematic: ["#f5e3c3", "#8a6d2f"], dynamic: ["#d3e5f3", "#33596f"], coordinate: ["#d3e5f3", "#33596f"] };
const COLOUR = { "stick": "#0072b2", "slip+": "#d55e00", "slip-": "#d55e00", "impact": "#cc79a7", "open": "#969696" };
const NO_FRICTION = "#00805a"; // a closed contact that nothing holds along its surface neither sticks nor slips
const MOST = 60; // arrows of a frame, the largest, unless all are asked for
const ARROW = 0.2; // length of a usual large impulse's arrow, of the canvas's shorter side

function moved([x, y, angle], [px, py]) {
  const c = Math.cos(angle), s = Math.sin(angle);
  return [x + c * px - s * py, y + s * px + c * py];
}

// The point of an outline that is next to p, if it is no farther than `most`; p itself otherwise.
function onOutline(pieces, p, most) {
  let best = p, least = most;
  const offer = (q) => {
    const far = Math.hypot(q[0] - p[0], q[1] - p[1]);
    if (far < least) [best, least] = [q, far];
  };
  for (const piece of pieces) {
    if (piece.disc) {
      const [x, y, radius] = piece.disc;
      const far = Math.hypot(p[0] - x, p[1] - y) || 1;
      offer([x + (radius * (p[0] - x)) / far, y + (radius * (p[1] - y)) / far]);
      continue;
    }
    const points = piece.area || piece.line;
    for (let k = piece.area ? 0 : 1; k < points.length; k++) {
      const b = points[k], a = points[(k || points.length) - 1];
      const along = [b[0] - a[0], b[1] - a[1]];
      const t = ((p[0] - a[0]) * along[0] + (p[1] - a[1]) * along[1]) / (along[0] ** 2 + along[1] ** 2 || 1);
      const s = Math.min(1, Math.max(0, t));
      offer([a[0] + s * along[0], a[1] + s * along[1]]);
    }
  }
  return best;
}

class Scene {
  constructor(canvas, run) {
    this.canvas = canvas;
    this.run = run;
    this.context = canvas.getContext("2d");
    this.arrows = 1;
    this.all = false;
    this.picked = null;
    this.whole();
  }
  whole() {
    const { x, y } = this.run.view;
    this.centre = [(x[0] + x[1]) / 2, (y[0] + y[1]) / 2];
    this.zoom = 1;
  }
  // Size in pixels of the page: as high as the scene needs, within the screen.
  fit() {
    const { x, y } = this.run.view;
    this.width = this.canvas.clientWidth;
    const high = (this.width * (y[1] - y[0])) / (x[1] - x[0]);
    this.height = Math.max(140, Math.min(high, Math.min(640, 0.62 * Math.max(window.innerHeight, 500))));
    this.canvas.style.height = this.height + "px";
    const ratio = window.devicePixelRatio || 1;
    this.canvas.width = Math.round(this.width * ratio);
    this.canvas.height = Math.round(this.height * ratio);
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
  }
  get scale() {
    const { x, y } = this.run.view;
    return this.zoom * Math.min(this.width / (x[1] - x[0]), this.height / (y[1] - y[0]));
  }
  px([x, y]) {
    return [this.width / 2 + this.scale * (x - this.centre[0]), this.height / 2 - this.scale * (y - this.centre[1])];
  }
  point([px, py]) {
    return [this.centre[0] + (px - this.width / 2) / this.scale, this.centre[1] - (py - this.height / 2) / this.scale];
  }
  // Zooms by a factor with the pixel `at` held.
  nearer(factor, at) {
    const before = this.point(at);
    this.zoom = Math.min(1e5, Math.max(0.05, this.zoom * factor));
    const after = this.point(at);
    this.centre = this.centre.map((c, k) => c + before[k] - after[k]);
  }

  draw(frame, share) {
    const { run, context } = this;
    context.clearRect(0, 0, this.width, this.height);
    this.poses = run.stage.bodies.map((_, k) => run.pose(frame, k, share));
    this.pieces = run.stage.bodies.map((_, k) => run.pieces(frame, k));
    for (const kind of KINDS) {
      run.stage.bodies.forEach((body, k) => {
        if (body.kind === kind) this.drawBody(body.kind, this.pieces[k], this.poses[k], this.picked?.body === k);
      });
    }
    run.stage.bodies.forEach((body, k) => {
      if (body.belt) this.drawBelt(this.pieces[k], this.poses[k], body.belt);
      if (TURNED.includes(body.kind)) this.drawTurn(this.poses[k], run.body.get(run.bodyRow(frame, k), "omega_rad_s"));
    });
    for (const link of run.stage.links) this.drawLink(link);
    this.drawContacts(frame);
    this.drawGravity();
    if (!run.stage.lane) this.drawLength();
  }

  // A bar of a round length in the lower left corner, about an eighth of the picture.
  drawLength() {
    const { context } = this;
    const wanted = this.width / 8 / this.scale;
    const decade = 10 ** Math.floor(Math.log10(wanted));
    const length = decade * [5, 2, 1].find((k) => k * decade <= wanted);
    const [x, y, wide] = [10, this.height - 10, length * this.scale];
    context.strokeStyle = context.fillStyle = "#555";
    context.lineWidth = 1.6;
    this.trace([[x, y - 4], [x, y], [x + wide, y], [x + wide, y - 4]], false);
    context.stroke();
    context.font = "12px sans-serif";
    context.textAlign = "left";
    context.fillText(`${words(length)} m`, x + wide + 6, y + 2);
  }

  // Heads along the outline of a body whose surface runs as a belt; counter-clockwise if `speed` is positive.
  drawBelt(pieces, pose, speed) {
    const { context } = this;
    context.fillStyle = "#8a6d2f";
    const apart = 46, half = 4.5;
    for (const piece of pieces) {
      let points = piece.area || piece.line;
      if (piece.disc) {
        const [x, y, r] = piece.disc;
        points = Array.from({ length: 48 }, (_, k) => [x + r * Math.cos(k * Math.PI / 24), y + r * Math.sin(k * Math.PI / 24)]);
      }
      points = points.map((p) => this.px(moved(pose, p)));
      if (!piece.line) points.push(points[0]);
      // pixels point down: an outline that turns left has a negative area here
      const area = points.slice(1).reduce((sum, b, k) => sum + points[k][0] * b[1] - points[k][1] * b[0], 0);
      const sense = Math.sign(speed) * (piece.line || area <= 0 ? 1 : -1);
      let next = apart / 2;
      for (let k = 0; k + 1 < points.length; k++) {
        const [a, b] = [points[k], points[k + 1]];
        const long = Math.hypot(b[0] - a[0], b[1] - a[1]);
        const [ux, uy] = [(b[0] - a[0]) / long * sense, (b[1] - a[1]) / long * sense];
        // an edge without end has heads where it is seen
        const hidden = this.enters(a, b, long) - next;
        let at = next + (hidden > 0 ? apart * Math.ceil(hidden / apart) : 0);
        for (let heads = 0; at < long && heads < 200; at += apart, heads++) {
          const [x, y] = [a[0] + (b[0] - a[0]) * at / long, a[1] + (b[1] - a[1]) * at / long];
          this.trace([[x + 2 * half * ux, y + 2 * half * uy], [x - half * uy, y + half * ux], [x + half * uy, y - half * ux]], true);
          context.fill();
        }
        next = Math.min(apart, Math.max(0, at - long));
      }
    }
  }
  // Pixels along the edge from a to b before it may be seen.
  enters(a, b, long) {
    let enter = 0;
    [this.width, this.height].forEach((size, k) => {
      const slope = (b[k] - a[k]) / long;
      if (Math.abs(slope) < 1e-9) return;
      enter = Math.max(enter, ((slope > 0 ? -20 : size + 20) - a[k]) / slope);
    });
    return enter;
  }

  // The sense of gravity, in the upper right corner.
  drawGravity() {
    const { context, run } = this;
    const [gx, gy] = run.stage.gravity;
    const size = Math.hypot(gx, gy);
    if (!(size > 0)) return;
    const [ux, uy] = [gx / size, -gy / size], x = this.width - 26, y = 28, half = 14;
    context.strokeStyle = context.fillStyle = "#555";
    context.lineWidth = 1.6;
    this.trace([[x - half * ux, y - half * uy], [x + (half - 7) * ux, y + (half - 7) * uy]], false);
    context.stroke();
    this.trace([[x + half * ux, y + half * uy], [x + (half - 8) * ux - 4 * uy, y + (half - 8) * uy + 4 * ux], [x + (half - 8) * ux + 4 * uy, y + (half - 8) * uy - 4 * ux]], true);
    context.fill();
    context.font = "italic 13px sans-serif";
    context.textAlign = "right";
    context.fillText("g", x - 7 - 6 * Math.abs(ux), y + 4 - 8 * Math.abs(ux));
  }

  trace(points, close) {
    const { context } = this;
    context.beginPath();
    points.forEach((p, k) => (k ? context.lineTo(...p) : context.moveTo(...p)));
    if (close) context.closePath();
  }

  drawBody(kind, pieces, pose, picked) {
    const { context } = this;
    const [fill, line] = FILL[kind];
    for (const piece of pieces) {
      context.fillStyle = picked ? "#fff0a8" : fill;
      context.strokeStyle = line;
      context.lineWidth = picked ? 2 : 1;
      if (piece.disc) {
        const [x, y, radius, spoke] = piece.disc;
        const centre = moved(pose, [x, y]);
        const at = this.px(centre), r = radius * this.scale;
        const rim = this.px(moved([centre[0], centre[1], pose[2] + spoke], [radius, 0]));
        context.beginPath();
        context.arc(at[0], at[1], r, 0, 2 * Math.PI);
        context.fill();
        context.stroke();
        this.trace([at, rim], false);
        context.stroke();
      } else {
        const points = (piece.area || piece.line).map((p) => this.px(moved(pose, p)));
        if (piece.line) context.lineWidth = 2;
        this.trace(points, !!piece.area);
        if (piece.area) context.fill();
        context.stroke();
      }
    }
  }

  // The sense in which a body is turned: an arc with a head round its origin.
  drawTurn(pose, omega) {
    if (!(Math.abs(omega) > 0)) return;
    const { context } = this;
    const [x, y] = this.px(pose), radius = 16, from = 0.75 * Math.PI, to = -0.6 * Math.PI;
    // the canvas's angles grow clockwise
    const mirror = omega > 0 ? 1 : -1;
    context.strokeStyle = context.fillStyle = "#8a6d2f";
    context.lineWidth = 1.6;
    const at = (angle, r) => [x + mirror * r * Math.cos(angle), y + r * Math.sin(angle)];
    const arc = [];
    for (let k = 0; k <= 24; k++) arc.push(at(from + ((to - from) * k) / 24, radius));
    this.trace(arc, false);
    context.stroke();
    this.trace([at(to - 0.35, radius), at(to, radius - 5), at(to, radius + 5)], true);
    context.fill();
  }

  // The ends of a joint in pixels, each with the origin of its body.
  ends(link) {
    return [0, 1].map((side) => {
      const k = link.bodies[side];
      const pose = k === null ? [0, 0, 0] : this.poses[k];
      return { at: this.px(moved(pose, link.at[side])), origin: k === null ? null : this.px(pose) };
    });
  }

  drawLink(link) {
    const { context } = this;
    const ends = this.ends(link);
    const [a, b] = ends.map((end) => end.at);
    context.strokeStyle = "#262626";
    context.fillStyle = "#fff";
    context.lineWidth = 1.2;
    if (link.kind === "spring") {
      const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
      const length = Math.hypot(dx, dy) || 1;
      const turns = Math.max(4, Math.min(40, Math.floor(length / 8)));
      const points = [a];
      for (let k = 0; k < turns; k++) {
        const t = (k + 0.5) / turns, side = k % 2 ? -5 : 5;
        points.push([a[0] + t * dx - (side * dy) / length, a[1] + t * dy + (side * dx) / length]);
      }
      this.trace([...points, b], false);
      context.stroke();
    } else if (link.kind === "rope") {
      this.trace([a, b], false);
      context.stroke();
    } else if (link.kind === "prismatic" || link.kind === "pin-slot") {
      // the way of the slider, through it
      const angle = link.axis + (link.bodies[0] === null ? 0 : this.poses[link.bodies[0]][2]);
      const [c, s] = [24 * Math.cos(angle), 24 * Math.sin(angle)];
      const at = (ends[1].origin || ends[0].origin);
      this.trace([[at[0] - c, at[1] + s], [at[0] + c, at[1] - s]], false);
      context.stroke();
      return;
    } else {
      // an arm from each body to its joint
      context.strokeStyle = "#8a9aa5";
      for (const { at, origin } of ends) {
        if (origin) { this.trace([origin, at], false); context.stroke(); }
      }
      context.strokeStyle = "#262626";
    }
    // many joints lie too close for marks
    const mark = this.run.stage.links.length > 500 ? 0.7 : 2.6;
    for (const at of [a, b]) {
      context.beginPath();
      if (link.kind === "fixed") context.rect(at[0] - mark, at[1] - mark, 2 * mark, 2 * mark);
      else context.arc(at[0], at[1], mark, 0, 2 * Math.PI);
      context.fill();
      context.stroke();
    }
  }

  // Impulse that nine in ten of those that the page holds stay below [N s].
  get usual() {
    if (this.usualImpulse === undefined) {
      const { contact, impact } = this.run;
      const sizes = [];
      for (const table of contact.rows ? [contact] : [impact]) {
        for (let row = 0; row < table.rows; row++) {
          const size = Math.hypot(table.get(row, "impulse_n_ns"), table.get(row, "impulse_t_ns"));
          if (size > 0) sizes.push(size);
        }
      }
      sizes.sort((a, b) => a - b);
      this.usualImpulse = sizes.length ? sizes[Math.floor(0.9 * (sizes.length - 1))] : 0;
    }
    return this.usualImpulse;
  }

  // A point that lay on a body when the contact was found, within the step, and its normal, as the body has
  // carried them on: back by the body's motion since then, and forth with the body as it is drawn. In a step with
  // an impact that motion is known roughly: the point is then put on the outline.
  carried(frame, table, row) {
    const { run } = this;
    const get = (name) => table.get(row, name);
    const place = [get("x_m"), get("y_m")], normal = [get("nx"), get("ny")];
    const body = ["body_2", "body_1"].map(get).find((k) => MOVED.includes(run.stage.bodies[k]?.kind));
    // a step detects its contacts at its middle; an impact has an instant of its own
    const dt = run.step.get(frame - 1, "dt_s"), since = run.time(frame) - get("time_s");
    const late = table === run.contact ? 0.5 * dt : since;
    if (body === undefined || run.stage.lane || !(late >= 0 && late <= dt)) return { place, normal };
    const at = (name) => run.body.get(run.bodyRow(frame, body), name);
    const turned = late * at("omega_rad_s");
    const then = [at("x_m") - late * at("vx_m_s"), at("y_m") - late * at("vy_m_s"), at("angle_rad") - turned];
    const now = this.poses[body];
    const own = moved([0, 0, -then[2]], [place[0] - then[0], place[1] - then[1]]);
    const out = Math.hypot(...own);
    const far = 0.05 * out + 2 * dt * (Math.hypot(at("vx_m_s"), at("vy_m_s")) + Math.abs(at("omega_rad_s")) * out);
    const carried = moved(now, onOutline(this.pieces[body], own, far + Math.abs(get("gap_m") || 0)));
    if (!carried.every(Number.isFinite)) return { place, normal };
    return { place: carried, normal: moved([0, 0, now[2] - then[2]], normal) };
  }

  drawContacts(frame) {
    const { context, run } = this;
    const shown = run.contactRows(frame).map((row) => ({ table: run.contact, row, colour: run.frictionless(row) ? NO_FRICTION : COLOUR[run.status(row)] }));
    for (const row of run.impactsOf.get(frame) || []) shown.push({ table: run.impact, row, colour: COLOUR.impact });
    for (const one of shown) one.size = Math.hypot(one.table.get(one.row, "impulse_n_ns"), one.table.get(one.row, "impulse_t_ns"));
    const sizes = shown.map((one) => one.size).filter((size) => size > 0).sort((a, b) => b - a);
    const least = this.all || sizes.length <= MOST ? 0 : sizes[MOST - 1];
    this.hidden = sizes.filter((size) => size < least).length;
    const crowd = Math.max(1, Math.min(this.all ? Infinity : 2.5, Math.sqrt(sizes.length) / 5));
    const longest = (ARROW * Math.max(200, Math.min(this.width, this.height)) * this.arrows) / crowd;
    const dot = Math.max(1.2, 2.4 / Math.max(1, Math.sqrt(shown.length) / 5));
    this.dots = [];
    for (const { table, row, colour, size } of shown) {
      const get = (name) => table.get(row, name);
      const { place, normal: [nx, ny] } = this.carried(frame, table, row);
      const at = this.px(place);
      const [n, t] = [get("impulse_n_ns"), get("impulse_t_ns")];
      const second = run.stage.bodies[get("body_2")];
      const sign = second && MOVED.includes(second.kind) ? 1 : -1;
      const chosen = this.picked && this.picked.table === table && this.picked.row === row;
      const drawn = size >= least || chosen;
      const length = this.usual > 0 && drawn ? longest * Math.min(3, size / this.usual) : 0;
      const scale = size > 0 ? (sign * length) / size : 0;
      const dx = scale * (n * nx - t * ny), dy = -scale * (n * ny + t * nx);
      context.strokeStyle = context.fillStyle = colour;
      context.lineWidth = chosen ? 3 : Math.max(0.8, 1.8 / crowd);
      context.beginPath();
      context.arc(at[0], at[1], chosen ? 5 : dot, 0, 2 * Math.PI);
      context.fill();
      if (length >= 2 && Number.isFinite(length)) {
        const head = Math.min(8, Math.max(2.5, 0.35 * length));
        const [ux, uy] = [dx / length, dy / length];
        const base = [at[0] + dx - head * ux, at[1] + dy - head * uy];
        this.trace([at, base], false);
        context.stroke();
        this.trace([[at[0] + dx, at[1] + dy], [base[0] - 0.45 * head * uy, base[1] + 0.45 * head * ux], [base[0] + 0.45 * head * uy, base[1] - 0.45 * head * ux]], true);
        context.fill();
      }
      if (chosen) {
        context.setLineDash([4, 3]);
        this.trace([at, [at[0] + 40 * nx, at[1] - 40 * ny]], false);
        context.stroke();
        context.setLineDash([]);
      }
      this.dots.push({ table, row, at });
    }
  }

  // The contact within 10 pixels, else the body under the pixel.
  find(at) {
    let best = null, least = 10;
    for (const dot of this.dots) {
      const far = Math.hypot(dot.at[0] - at[0], dot.at[1] - at[1]);
      if (far < least) [best, least] = [dot, far];
    }
    if (best) return { table: best.table, row: best.row };
    const world = this.point(at);
    for (let k = this.run.stage.bodies.length - 1; k >= 0; k--) {
      if (this.covers(this.pieces[k], this.poses[k], world)) return { body: k };
    }
    return null;
  }
  covers(pieces, [x, y, angle], world) {
    const near = 5 / this.scale;
    const p = moved([0, 0, -angle], [world[0] - x, world[1] - y]);
    return pieces.some((piece) => {
      if (piece.disc) return Math.hypot(p[0] - piece.disc[0], p[1] - piece.disc[1]) <= Math.max(piece.disc[2], near);
      const points = piece.area || piece.line;
      let inside = false;
      for (let k = 0; k < points.length; k++) {
        const a = points[k], b = points[(k + 1) % points.length];
        if (piece.line && k + 1 === points.length) break;
        const along = [b[0] - a[0], b[1] - a[1]];
        const t = ((p[0] - a[0]) * along[0] + (p[1] - a[1]) * along[1]) / (along[0] ** 2 + along[1] ** 2 || 1);
        const s = Math.min(1, Math.max(0, t));
        if (Math.hypot(p[0] - a[0] - s * along[0], p[1] - a[1] - s * along[1]) < (piece.line ? near : 0)) return true;
        if (a[1] > p[1] !== b[1] > p[1] && p[0] < a[0] + ((p[1] - a[1]) / along[1]) * along[0]) inside = !inside;
      }
      return piece.area ? inside : false;
    });
  }
}
