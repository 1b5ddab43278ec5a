"use strict";
// Reads the numbers of the page: five characters each, see packed.rs.

const DIGITS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
const VALUE = new Map([...DIGITS].map((digit, k) => [digit, k]));

function number(text, at) {
  let code = 0;
  for (let k = at; k < at + 5; k++) code = code * 64 + VALUE.get(text[k]);
  if (code === 0) return NaN;
  const mantissa = Math.floor(code / 512) - 2 ** 20;
  return Number(mantissa + "e" + ((code % 512) - 256));
}

// A table of packed numbers: rows are counted from 0, columns have names.
class Table {
  constructor({ columns, data }) {
    this.columns = columns;
    this.data = data;
    this.place = new Map(columns.map((name, k) => [name, k]));
    this.rows = columns.length ? data.length / (5 * columns.length) : 0;
  }
  get(row, name) {
    const column = this.place.get(name);
    if (column === undefined || row < 0 || row >= this.rows) return NaN;
    return number(this.data, 5 * (row * this.columns.length + column));
  }
  figures(row) {
    return this.columns.map((name) => [name, this.get(row, name)]);
  }
}

// Where the rows of each frame start, and where the last ends.
function starts(counts) {
  const at = [0];
  for (const count of counts) at.push(at[at.length - 1] + count);
  return at;
}

const WORDS = { s: "stick", p: "slip+", m: "slip-", i: "impact", o: "open" };

class Run {
  constructor(data) {
    Object.assign(this, data);
    this.body = new Table(data.body);
    this.contact = new Table(data.contact);
    this.impact = new Table(data.impact);
    this.step = new Table(data.step);
    this.contactStart = starts(data.contacts);
    const last = this.frames - 1;
    this.impactsOf = new Map();
    data.impacts.forEach((frame, row) => {
      if (!this.impactsOf.has(frame)) this.impactsOf.set(frame, []);
      this.impactsOf.get(frame).push(row);
    });
    this.end = this.time(last);
    // of a machine, whose bodies come and go
    this.sparse = this.stage.bodies.some((body) => body.kind === "driven");
  }
  // End of the step of a frame; the first frame is the start.
  time(frame) {
    return frame === 0 ? this.start : this.step.get(frame - 1, "time_s");
  }
  frameAt(time) {
    let low = 0, high = this.frames - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.time(middle) <= time) low = middle; else high = middle - 1;
    }
    return low;
  }
  bodyRow(frame, k) {
    return frame * this.stage.bodies.length + k;
  }
  // Pose at a frame, and a share of the way to the next one while it plays.
  pose(frame, k, share) {
    const row = this.bodyRow(frame, k);
    const at = (name) => this.body.get(row, name);
    let [x, y, angle] = [at("x_m"), at("y_m"), at("angle_rad")];
    if (share > 0 && frame + 1 < this.frames) {
      const next = (name) => this.body.get(this.bodyRow(frame + 1, k), name);
      // the angle is known up to whole turns: the spin says how many
      const span = this.time(frame + 1) - this.time(frame);
      const turned = 0.5 * span * (at("omega_rad_s") + next("omega_rad_s"));
      const off = next("angle_rad") - angle - turned;
      const way = turned + off - 2 * Math.PI * Math.round(off / (2 * Math.PI));
      const way_x = next("x_m") - x, way_y = next("y_m") - y;
      // a number may pass to another body, far away: it has not moved there
      const speed = Math.max(Math.hypot(at("vx_m_s"), at("vy_m_s")), Math.hypot(next("vx_m_s"), next("vy_m_s")));
      const far = this.sparse && Math.hypot(way_x, way_y) > 3 * span * speed;
      if (!far && !Number.isNaN(way_x)) {
        x += share * way_x;
        y += share * way_y;
        angle += share * way;
      }
    }
    return [x, y - this.stage.lane * k, angle];
  }
  // The pieces of a body at a frame: a number passes from grain to grain, each with a radius of its own.
  pieces(frame, k) {
    const pieces = this.stage.bodies[k].pieces;
    const radius = this.body.get(this.bodyRow(frame, k), "radius_m");
    if (Number.isNaN(radius)) return pieces;
    return pieces.map(({ disc: [x, y, , spoke] }) => ({ disc: [x, y, radius, spoke] }));
  }
  contactRows(frame) {
    const rows = [];
    for (let k = this.contactStart[frame]; k < this.contactStart[frame + 1]; k++) rows.push(k);
    return rows;
  }
  status(row) {
    return WORDS[this.statuses[row]];
  }
  // A contact that slips has all of the friction that its normal impulse allows: without any, it has none.
  frictionless(row) {
    return "pm".includes(this.statuses[row]) && this.contact.get(row, "impulse_t_ns") === 0;
  }
}

// A number as in the CSV file, rounded to six digits.
function words(value) {
  if (Number.isNaN(value)) return "—";
  const size = Math.abs(value);
  const long = size !== 0 && (size < 1e-3 || size >= 1e6);
  return long ? value.toExponential(5).replace(/\.?0*e\+?/, "e") : String(Number(value.toPrecision(6)));
}
