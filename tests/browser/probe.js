// Put at the end of a copy of report.html by report.py: uses the page as a reader would, and tells
// the page round it what it saw, as JSON.
addEventListener("load", () => setTimeout(async () => {
  const get = (id) => document.getElementById(id);
  const size = () => {
    const texts = [...document.querySelectorAll("p, td, button, figcaption span, pre")].filter((e) => e.offsetParent);
    return {
      width: innerWidth,
      wide: document.documentElement.scrollWidth,
      smallest: Math.min(...texts.map((e) => parseFloat(getComputedStyle(e).fontSize))),
      charts: [...document.querySelectorAll("svg")].filter((svg) => !svg.parentElement.closest("svg")).map((svg) => svg.clientWidth / svg.viewBox.baseVal.width * 10),
    };
  };
  const tell = (found) => parent.postMessage(JSON.stringify({ ...size(), lead: get("lead").innerText, ...found }), "*");
  if (!get("scene")) return tell({});
  const canvas = get("scene"), bar = get("time");
  const cells = (id) => [...get(id).rows].map((row) => [...row.cells].map((cell) => cell.textContent));
  const seen = () => ({ canvas: sum(canvas.toDataURL()), now: get("now").textContent, step: cells("step") });
  function sum(text) {
    let hash = 0;
    for (let k = 0; k < text.length; k++) hash = (hash * 31 + text.charCodeAt(k)) | 0;
    return hash;
  }
  const to = (frame) => { bar.value = frame; bar.dispatchEvent(new Event("input", { bubbles: true })); return seen(); };
  // the drawn scene, to be measured
  let drawn = null;
  const draw = Scene.prototype.draw;
  Scene.prototype.draw = function (...args) { drawn = this; return draw.apply(this, args); };
  // how far a contact is drawn from the rim of its disc, beyond its gap, over the disc's radius
  const off = () => Math.max(0, ...drawn.dots.filter((dot) => dot.table === drawn.run.contact).map(({ row, at }) => {
    const body = ["body_2", "body_1"].map((side) => drawn.run.contact.get(row, side)).find((k) => drawn.run.stage.bodies[k]?.kind === "dynamic");
    const disc = drawn.pieces[body]?.length === 1 && drawn.pieces[body][0].disc;
    if (!disc) return 0;
    const [x, y] = moved(drawn.poses[body], disc), place = drawn.point(at);
    const gap = Math.abs(drawn.run.contact.get(row, "gap_m"));
    return (Math.abs(Math.hypot(place[0] - x, place[1] - y) - disc[2]) - gap) / disc[2];
  }));
  const found = { frames: Number(bar.max) + 1, picks: [] };
  found.start = to(0);
  found.middle = to(Math.floor(bar.max / 2));
  // a click at every place of finer and finer grids, until a body and a contact are picked
  const box = canvas.getBoundingClientRect();
  const kinds = new Set();
  for (const wide of [48, 24, 12, 6]) {
    for (const part of [0.5, 1]) {
      if (kinds.size === 2) break;
      to(Math.floor(part * bar.max));
      const frame = Number(bar.value);
      for (let y = 3; y < box.height && kinds.size < 2; y += wide) {
        for (let x = 3; x < box.width && kinds.size < 2; x += wide) {
          const at = { clientX: box.left + x, clientY: box.top + y, buttons: 1, bubbles: true };
          canvas.dispatchEvent(new PointerEvent("pointerdown", at));
          canvas.dispatchEvent(new PointerEvent("pointerup", at));
          const name = get("picked-name").textContent, kind = name.split(/[ :]/)[0];
          if ((kind === "Body" && name.includes("dynamic") || kind === "Contact") && !kinds.has(kind)) {
            kinds.add(kind);
            found.picks.push({ frame, name, figures: cells("picked"), step: cells("step") });
          }
        }
      }
    }
  }
  found.off = 0;
  for (let k = 1; k <= 40; k++) {
    to(Math.floor((k * bar.max) / 40));
    found.off = Math.max(found.off, off());
  }
  const few = seen().canvas, hidden = drawn.hidden;
  get("all").click();
  found.arrows = [hidden, few !== seen().canvas];
  get("all").click();
  to(0);
  get("next").click();
  found.next = get("next").hidden ? null : { frame: Number(bar.value), step: cells("step") };
  to(0);
  // the browser's clock runs ahead of the frames that it draws
  window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 16);
  get("play").click();
  await new Promise((done) => setTimeout(done, 400));
  found.played = get("now").textContent;
  tell(found);
}, 50));
