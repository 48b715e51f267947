// Signals over time, each in a row of its own on one axis; hover to read, drag to go there, wheel to zoom.
// Without `seek` there is nowhere to go: the course of a training, over its iterations.
import { shade, style } from "./theme.js";
import { ticks } from "./unpack.js";

const LEFT = 58, RIGHT = 12, ROW = 92, BARS = 76, GAP = 30, AXIS = 34;

/** A value with its unit; a dash where there is none yet. */
const told = (value, { digits, unit }) =>
  Number.isFinite(value) ? `${value.toFixed(digits)}${unit && " " + unit}` : "–";

export function charts(holder, data, seek = null) {
  const canvas = document.createElement("canvas");
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", data.rows.map((row) => row.title).join(", "));
  const note = document.createElement("div");
  note.className = "note";
  holder.append(canvas, note);
  const last = data.time[data.time.length - 1];
  let span = [0, last], now = seek ? 0 : null, hover = null;
  const rows = data.rows;
  const heights = rows.map((row) => (row.kind === "contacts" ? BARS : ROW));
  const high = heights.reduce((sum, h) => sum + h + GAP, 0) + AXIS;
  const index = (t) => Math.min(Math.max(Math.round(t / data.period) - 1, 0), data.time.length - 1);

  function draw() {
    const wide = holder.clientWidth, ratio = Math.min(devicePixelRatio, 2);
    canvas.width = wide * ratio;
    canvas.height = high * ratio;
    canvas.style.height = `${high}px`;
    const pen = canvas.getContext("2d");
    pen.scale(ratio, ratio);
    pen.clearRect(0, 0, wide, high);
    const ink = style("--ink"), quiet = style("--quiet"), pale = style("--pale");
    const x = (t) => LEFT + ((t - span[0]) / (span[1] - span[0])) * (wide - LEFT - RIGHT);
    pen.font = "12px system-ui, sans-serif";
    let top = 0;
    rows.forEach((row, r) => {
      const height = heights[r], y0 = top + GAP - 8;
      pen.fillStyle = ink;
      pen.textAlign = "left";
      pen.fillText(row.title, LEFT, top + 14);
      legend(pen, row, wide, top + 14, quiet, LEFT + pen.measureText(row.title).width);
      pen.save();
      if (row.kind === "contacts") contacts(pen, row, x, y0, height, quiet, pale, wide);
      else lines(pen, row, x, y0, height, quiet, pale, wide);
      pen.restore();
      top += height + GAP;
    });
    pen.fillStyle = quiet;
    pen.textAlign = "center";
    for (const t of ticks(span[0], span[1], wide / 90)) {
      pen.fillText(`${+t.toFixed(3)}`, x(t), top + 12);
      pen.fillRect(x(t), top - 6, 1, 4);
    }
    pen.fillText(data.axis ?? "time [s]", (LEFT + wide - RIGHT) / 2, top + 28);
    for (const t of data.shifts) {
      if (t < span[0] || t > span[1]) continue;
      pen.fillStyle = quiet;
      for (let y = 0; y < top - 8; y += 6) pen.fillRect(x(t), y, 1, 3);
    }
    pen.fillStyle = style("--accent");
    if (now !== null && now >= span[0] && now <= span[1]) pen.fillRect(x(now) - 0.75, 0, 1.5, top - 6);
    if (hover !== null) {
      pen.fillStyle = quiet;
      pen.fillRect(x(hover), 0, 1, top - 6);
    }
    const i = index(hover ?? now ?? last);
    note.textContent = (data.axis ? [`${data.axis} ${data.time[i]}`] : [`${data.time[i].toFixed(2)} s`, data.gaits[data.gait[i]].title])
      .concat(rows.filter((row) => row.kind === "lines").flatMap((row) =>
        row.series.map((one) => `${one.name} ${told(one.values[i], row)}`)))
      .join("  ·  ");
  }

  function legend(pen, row, wide, y, quiet, taken) {
    if (row.kind !== "lines" || row.series.length < 2) return;
    let x = wide - RIGHT;
    const needs = row.series.reduce((sum, one) => sum + pen.measureText(one.name).width + 28, 0);
    if (x - needs < taken) y += 16; // no room beside the title
    pen.textAlign = "right";
    for (const one of [...row.series].reverse()) {
      pen.fillStyle = quiet;
      pen.fillText(one.name, x, y);
      x -= pen.measureText(one.name).width + 6;
      pen.fillStyle = shade(one.colour);
      pen.fillRect(x - 12, y - 5, 12, 3);
      x -= 22;
    }
  }

  function contacts(pen, row, x, y0, height, quiet, pale, wide) {
    const each = height / 4;
    row.names.forEach((name, leg) => {
      const y = y0 + leg * each;
      pen.fillStyle = quiet;
      pen.textAlign = "right";
      pen.fillText(name, LEFT - 8, y + each / 2 + 4);
      pen.fillStyle = pale;
      pen.fillRect(LEFT, y + 1, wide - LEFT - RIGHT, each - 2);
    });
    pen.beginPath();
    pen.rect(LEFT, y0, wide - LEFT - RIGHT, height);
    pen.clip();
    const from = index(span[0]), to = index(span[1]);
    for (let leg = 0; leg < 4; leg++)
      for (let i = from; i <= to; i++) {
        if (!((data.contact[i] >> leg) & 1)) continue;
        let end = i;
        while (end < to && (data.contact[end + 1] >> leg) & 1 && data.gait[end + 1] === data.gait[i]) end++;
        pen.fillStyle = data.gaits[data.gait[i]].colour;
        const left = x(data.time[i] - data.period);
        pen.fillRect(left, y0 + leg * each + 1, Math.max(x(data.time[end]) - left, 0.6), each - 2);
        i = end;
      }
  }

  function lines(pen, row, x, y0, height, quiet, pale, wide) {
    const from = index(span[0]), to = index(span[1]);
    let low = Infinity, top = -Infinity;
    for (const one of row.series)
      for (let i = from; i <= to; i++)
        if (Number.isFinite(one.values[i])) (low = Math.min(low, one.values[i])), (top = Math.max(top, one.values[i]));
    if (!Number.isFinite(low)) return;
    if (row.zero) low = Math.min(low, 0);
    if (top - low < row.least) (top += row.least / 2), (low -= row.zero && low === 0 ? 0 : row.least / 2);
    const y = (v) => y0 + height - ((v - low) / (top - low)) * height;
    pen.textAlign = "right";
    for (const v of ticks(low, top, 4)) {
      pen.fillStyle = pale;
      pen.fillRect(LEFT, y(v), wide - LEFT - RIGHT, 1);
      pen.fillStyle = quiet;
      pen.fillText(`${+v.toFixed(3)}`, LEFT - 8, y(v) + 4);
    }
    pen.beginPath();
    pen.rect(LEFT, y0 - 2, wide - LEFT - RIGHT, height + 4);
    pen.clip();
    for (const one of row.series) {
      pen.beginPath();
      pen.strokeStyle = shade(one.colour);
      pen.lineWidth = 1.4;
      for (let i = from; i <= to; i++) {
        const v = one.values[i];
        if (!Number.isFinite(v)) continue;
        pen.lineTo(x(data.time[i]), y(v));
      }
      if (one.fill) {
        pen.lineTo(x(data.time[to]), y0 + height);
        pen.lineTo(x(data.time[from]), y0 + height);
        pen.fillStyle = shade(one.colour);
        pen.fill();
      } else pen.stroke();
    }
  }

  const timeAt = (e) => {
    const box = canvas.getBoundingClientRect();
    const share = (e.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT);
    return Math.min(Math.max(span[0] + share * (span[1] - span[0]), span[0]), span[1]);
  };
  let drags = false;
  canvas.addEventListener("pointerdown", (e) => ((drags = seek !== null), drags && (canvas.setPointerCapture(e.pointerId), seek(timeAt(e)))));
  canvas.addEventListener("pointermove", (e) => {
    hover = timeAt(e);
    if (drags) seek(hover);
    else draw();
  });
  canvas.addEventListener("pointerup", () => (drags = false));
  canvas.addEventListener("pointerleave", () => ((hover = null), draw()));
  canvas.addEventListener("wheel", (e) => {
    e.preventDefault();
    const t = timeAt(e), factor = Math.exp(Math.max(-1, Math.min(1, e.deltaY / 200)));
    const width = Math.min(Math.max((span[1] - span[0]) * factor, 0.5), last);
    const share = (t - span[0]) / (span[1] - span[0]);
    const begin = Math.min(Math.max(t - share * width, 0), last - width);
    span = [begin, begin + width];
    draw();
  }, { passive: false });
  canvas.addEventListener("dblclick", () => whole());
  new ResizeObserver(draw).observe(holder);

  function whole() {
    span = [0, last];
    draw();
  }

  function show(time) {
    now = time;
    if (now === null) return draw();
    const width = span[1] - span[0];
    if (width < last && (time < span[0] || time > span[1])) {
      const begin = Math.min(Math.max(time - width / 2, 0), last - width);
      span = [begin, begin + width];
    }
    draw();
  }

  return { show, whole };
}
