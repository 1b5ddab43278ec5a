"use strict";
// Draws a frame of the run on a canvas, and finds what was clicked.

// Bodies that are turned, with an arrow for the sense; a machine's steel is in front of its crop.
const TURNED = ["kinematic", "driven"];
const KINDS = ["fixed", "kinematic", "dynamic", "coordinate", "driven"];
const FILL = { driven: ["#f5e3c3", "#8a6d2f"], fixed: ["#e2e2e2", "#7a7a7a"], kinematic: ["#f5e3c3", "#8a6d2f"], dynamic: ["#d3e5f3", "#33596f"], coordinate: ["#d3e5f3", "#33596f"] };
const COLOUR = { "stick": "#0072b2", "slip+": "#d55e00", "slip-": "#d55e00", "impact": "#cc79a7", "open": "#969696" };
const ARROW = 0.2; // length of a usual large impulse's arrow, of the canvas's shorter side

function moved([x, y, angle], [px, py]) {
  const c = Math.cos(angle), s = Math.sin(angle);
  return [x + c * px - s * py, y + s * px + c * py];
}

class Scene {
  constructor(canvas, run) {
    this.canvas = canvas;
    this.run = run;
    this.context = canvas.getContext("2d");
    this.arrows = 1;
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
      if (TURNED.includes(body.kind)) this.drawTurn(this.poses[k], run.body.get(run.bodyRow(frame, k), "omega_rad_s"));
    });
    for (const link of run.stage.links) this.drawLink(link);
    this.drawContacts(frame);
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

  drawContacts(frame) {
    const { context, run } = this;
    const rows = run.contactRows(frame);
    const crowd = Math.max(1, Math.sqrt(rows.length) / 5);
    const longest = (ARROW * Math.max(200, Math.min(this.width, this.height)) * this.arrows) / crowd;
    this.dots = [];
    const one = (table, row, status) => {
      const get = (name) => table.get(row, name);
      const at = this.px([get("x_m"), get("y_m")]);
      const [nx, ny, n, t] = [get("nx"), get("ny"), get("impulse_n_ns"), get("impulse_t_ns")];
      const second = run.stage.bodies[get("body_2")];
      const sign = second && (second.kind === "dynamic" || second.kind === "coordinate") ? 1 : -1;
      const size = Math.hypot(n, t);
      const length = this.usual > 0 ? longest * Math.min(3, size / this.usual) : 0;
      const scale = size > 0 ? (sign * length) / size : 0;
      const dx = scale * (n * nx - t * ny), dy = -scale * (n * ny + t * nx);
      const chosen = this.picked && this.picked.table === table && this.picked.row === row;
      context.strokeStyle = context.fillStyle = COLOUR[status];
      context.lineWidth = chosen ? 3 : Math.max(0.8, 1.8 / crowd);
      context.beginPath();
      context.arc(at[0], at[1], chosen ? 5 : Math.max(1.2, 2.4 / crowd), 0, 2 * Math.PI);
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
    };
    for (const row of rows) one(run.contact, row, run.status(row));
    for (const row of run.impactsOf.get(frame) || []) one(run.impact, row, "impact");
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
