// Figures of a study's page: heat maps over two settings, and curves. Hover or tap to read, wheel to zoom.
// Reads what `gaitshift.report` wrote into the page; see there for the meaning of each entry.
import { shade, style, themed } from "./theme.js";
import { ticks, unpack } from "./unpack.js";

const LEFT = 70, RIGHT = 14, TOP = 10, AXIS = 44;

/** A canvas that redraws itself, with a line below it that says what is under the pointer. */
function plane(holder, label, high, paint, read) {
  const canvas = document.createElement("canvas"), note = document.createElement("div");
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", label);
  note.className = "note";
  holder.append(canvas, note);
  let view = [0, 1, 0, 1], at = null; // shares of the whole: left, right, bottom, top; the pointer

  const box = () => {
    const wide = holder.clientWidth;
    return { x: LEFT, y: TOP, w: wide - LEFT - RIGHT, h: high(wide) - TOP - AXIS };
  };

  function draw() {
    const wide = holder.clientWidth, tall = high(wide), ratio = Math.min(devicePixelRatio, 2);
    if (wide === 0) return; // folded away
    canvas.width = wide * ratio;
    canvas.height = tall * ratio;
    canvas.style.height = `${tall}px`;
    const pen = canvas.getContext("2d"), b = box();
    pen.scale(ratio, ratio);
    pen.clearRect(0, 0, wide, tall);
    pen.font = "12px system-ui, sans-serif";
    const x = (u) => b.x + ((u - view[0]) / (view[1] - view[0])) * b.w;
    const y = (v) => b.y + b.h - ((v - view[2]) / (view[3] - view[2])) * b.h;
    paint(pen, { x, y, view, at, box: b });
    note.textContent = read(at) ?? "";
  }

  const where = (e) => {
    const r = canvas.getBoundingClientRect(), b = box();
    const s = (e.clientX - r.left - b.x) / b.w, t = 1 - (e.clientY - r.top - b.y) / b.h;
    if (s < 0 || s > 1 || t < 0 || t > 1) return null;
    return [view[0] + s * (view[1] - view[0]), view[2] + t * (view[3] - view[2])];
  };
  const move = (e) => ((at = where(e)), draw());
  canvas.addEventListener("pointermove", move);
  canvas.addEventListener("pointerdown", move);
  canvas.addEventListener("pointerleave", () => ((at = null), draw()));
  canvas.addEventListener("dblclick", (e) => ((view = [0, 1, 0, 1]), move(e)));
  canvas.addEventListener("wheel", (e) => {
    const p = where(e);
    if (p === null) return;
    e.preventDefault();
    const factor = Math.exp(Math.max(-1, Math.min(1, e.deltaY / 200)));
    for (const axis of [0, 1]) {
      const [low, top] = [view[2 * axis], view[2 * axis + 1]];
      const width = Math.min(Math.max((top - low) * factor, 0.02), 1);
      const begin = p[axis] - ((p[axis] - low) / (top - low)) * width;
      view[2 * axis] = Math.min(Math.max(begin, 0), 1 - width);
      view[2 * axis + 1] = view[2 * axis] + width;
    }
    at = where(e);
    draw();
  }, { passive: false });
  new ResizeObserver(draw).observe(holder);
  return draw;
}

/** Cells over two axes, shaded by a value; cells of a class have the colour of the class. */
function map(holder, data) {
  const nx = data.x.count, ny = data.y.count;
  const line = holder.appendChild(document.createElement("div"));
  line.className = "legend";
  line.append(...legend([
    [`linear-gradient(90deg, ${data.stops.join(", ")})`, data.scale],
    ...data.kinds.map(({ name, colour }) => [colour === "pale" ? "var(--pale)" : colour, name]),
  ]));
  const cell = (at) => {
    const i = Math.min(Math.floor(at[0] * nx), nx - 1), j = Math.min(Math.floor(at[1] * ny), ny - 1);
    return j * nx + i;
  };
  const high = (wide) => TOP + AXIS + (data.square ? Math.min(((wide - LEFT - RIGHT) / nx) * ny, 64 * ny) : 400);
  const mix = (v) => {
    const last = data.stops.length - 1;
    const s = Math.min(Math.max((v - data.range[0]) / (data.range[1] - data.range[0]), 0), 1) * last;
    const k = Math.min(Math.floor(s), last - 1);
    const [a, b] = [data.stops[k], data.stops[k + 1]].map((c) => [1, 3, 5].map((i) => parseInt(c.slice(i, i + 2), 16)));
    return `rgb(${a.map((p, i) => Math.round(p + (b[i] - p) * (s - k))).join(" ")})`;
  };

  function paint(pen, { x, y, view, at, box }) {
    pen.save();
    pen.beginPath();
    pen.rect(box.x, box.y, box.w, box.h);
    pen.clip();
    const gap = data.square ? 1 : 0;
    for (let j = Math.floor(view[2] * ny); j < Math.min(Math.ceil(view[3] * ny), ny); j++)
      for (let i = Math.floor(view[0] * nx); i < Math.min(Math.ceil(view[1] * nx), nx); i++) {
        const c = j * nx + i, kind = data.kind[c];
        pen.fillStyle = kind ? shade(data.kinds[kind - 1].colour) : mix(data.values[c]);
        const [left, right] = [x(i / nx), x((i + 1) / nx)].map(Math.round);
        const [top, bottom] = [y((j + 1) / ny), y(j / ny)].map(Math.round);
        pen.fillRect(left, top, right - left - gap, bottom - top - gap);
        if (data.words && data.words[c]) {
          pen.fillStyle = kind ? "#1f2933" : contrast(mix(data.values[c])); // kinds are light
          pen.textAlign = "center";
          pen.fillText(data.words[c], (left + right) / 2, (top + bottom) / 2 + 4);
        }
      }
    if (data.chosen) {
      const [i, j] = data.chosen;
      ring(pen, x((i + 0.5) / nx), y((j + 0.5) / ny));
    }
    if (at) {
      const c = cell(at), i = c % nx, j = Math.floor(c / nx);
      pen.strokeStyle = style("--accent");
      pen.lineWidth = 2;
      pen.strokeRect(x(i / nx), y((j + 1) / ny), x((i + 1) / nx) - x(i / nx), y(j / ny) - y((j + 1) / ny));
    }
    pen.restore();
    axes(pen, box, data, data.x.ticks.map(([i, word, colour]) => [x((i + 0.5) / nx), word, colour]),
      data.y.ticks.map(([j, word, colour]) => [y((j + 0.5) / ny), word, colour]));
  }

  function read(at) {
    const chosen = data.chosen ? data.chosen[1] * nx + data.chosen[0] : null;
    const c = at ? cell(at) : chosen;
    if (c === null) return null;
    const number = (v, digits) => (typeof v === "number" ? (Number.isFinite(v) ? `${+v.toFixed(digits)}` : "") : v);
    const said = data.says.map(({ name, values, digits, unit, of }) => {
      const text = number(values[c], digits), whole = of ? ` of ${number(of[c], 0)}` : "";
      return text && `${name} ${text}${whole}${unit && " " + unit}`;
    });
    const place = [data.y, data.x].map((axis, k) => `${axis.short} ${axis.values[k ? c % nx : Math.floor(c / nx)]}`);
    const kind = data.kind[c] ? [data.kinds[data.kind[c] - 1].name] : [];
    return (at ? [] : ["chosen"]).concat(place, said.filter(Boolean), kind).join("  ·  ");
  }

  return plane(holder, data.title, high, paint, read);
}

function ring(pen, x, y) {
  for (const [colour, width] of [[style("--ink"), 5], [style("--paper"), 2.5]]) {
    pen.beginPath();
    pen.arc(x, y, 7, 0, 2 * Math.PI);
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.stroke();
  }
}

function contrast(colour) {
  const [r, g, b] = colour.match(/\d+/g).map(Number);
  return 0.21 * r + 0.72 * g + 0.07 * b > 140 ? "#1f2933" : "#ffffff";
}

/** A line of colours and what they stand for. */
function legend(entries) {
  return entries.map(([background, words]) => {
    const entry = document.createElement("span"), swatch = document.createElement("i");
    swatch.style.background = background;
    entry.append(swatch, words);
    return entry;
  });
}

/** Curves over the unit square, each in its colour; the pointer reads all of them at its place. */
function curves(holder, data) {
  const high = () => 400;
  // Straight between points; where the curve rises upright, the upper end.
  const valueAt = (one, x) => {
    let i = 0;
    while (i + 1 < one.x.length && one.x[i + 1] <= x + 1e-9) i++;
    if (i + 1 === one.x.length) return one.y[i];
    return one.y[i] + ((one.y[i + 1] - one.y[i]) * (x - one.x[i])) / (one.x[i + 1] - one.x[i]);
  };

  function paint(pen, { x, y, view, at, box }) {
    const number = (v) => `${+v.toFixed(4)}`;
    const across = ticks(view[0], view[1], 6), up = ticks(view[2], view[3], 5);
    for (const v of up) (pen.fillStyle = style("--pale")), pen.fillRect(box.x, y(v), box.w, 1);
    pen.save();
    pen.beginPath();
    pen.rect(box.x, box.y - 2, box.w, box.h + 3);
    pen.clip();
    for (const one of data.series) {
      pen.beginPath();
      pen.strokeStyle = shade(one.colour);
      pen.lineWidth = 2;
      one.x.forEach((v, i) => pen.lineTo(x(v), y(one.y[i])));
      pen.stroke();
    }
    if (at) (pen.fillStyle = style("--quiet")), pen.fillRect(x(at[0]), box.y, 1, box.h);
    pen.restore();
    axes(pen, box, data, across.map((v) => [x(v), number(v)]), up.map((v) => [y(v), number(v)]));
  }

  const read = (at) =>
    at && [`${data.x.name} ${at[0].toFixed(3)}`, ...data.series.map((one) => `${one.name} ${valueAt(one, at[0]).toFixed(3)}`)].join("  ·  ");
  const line = holder.appendChild(document.createElement("div"));
  line.className = "legend";
  const redraw = plane(holder, data.title, high, paint, read);
  return () => {
    line.replaceChildren(...legend(data.series.map((one) => [shade(one.colour), one.label])));
    redraw();
  };
}

/** Ticks and names; a tick that would touch the one before it is left out. */
function axes(pen, box, data, across, up) {
  let taken = -Infinity;
  pen.textAlign = "center";
  for (const [x, word, colour] of across) {
    const half = pen.measureText(word).width / 2;
    if (x < box.x - 1 || x > box.x + box.w + 1 || x - half < taken + 6) continue;
    pen.fillStyle = colour ? shade(colour) : style("--quiet");
    pen.fillText(word, x, box.y + box.h + 16);
    taken = x + half;
  }
  pen.fillStyle = style("--quiet");
  pen.fillText(data.x.name, box.x + box.w / 2, box.y + box.h + 36);
  taken = Infinity;
  pen.textAlign = "right";
  for (const [y, word, colour] of [...up].sort((a, b) => b[0] - a[0])) {
    if (y < box.y - 1 || y > box.y + box.h + 1 || y > taken - 14) continue;
    pen.fillStyle = colour ? shade(colour) : style("--quiet");
    pen.fillText(word, box.x - 8, y + 4);
    taken = y;
  }
  pen.save();
  pen.translate(12, box.y + box.h / 2);
  pen.rotate(-Math.PI / 2);
  pen.textAlign = "center";
  pen.fillStyle = style("--quiet");
  pen.fillText(data.y.name, 0, 0);
  pen.restore();
}

const FIGURES = { map, curves };
const drawn = [...document.querySelectorAll("[data-figure]")].map((holder) => {
  const data = unpack(JSON.parse(document.getElementById(holder.dataset.figure).textContent));
  return FIGURES[data.figure](holder, data);
});
const redraw = () => drawn.forEach((draw) => draw());
themed(redraw);
redraw();
