// Plots over time as SVG: lines that can be switched off, and a cursor at the time that the picture shows.
const SVG = "http://www.w3.org/2000/svg";
function made(name, attributes, text) {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes || {})) node.setAttribute(key, value);
  if (text !== undefined) node.textContent = text;
  return node;
}
function element(name, className, text) {
  const node = document.createElement(name);
  if (className) node.className = className;
  if (text !== undefined) node.textContent = text;
  return node;
}

// 1, 2, 2.5 or 5 times a power of ten, in about so many steps.
function step(range, count) {
  const rough = range / count || 1;
  const power = 10 ** Math.floor(Math.log10(rough));
  return power * ([1, 2, 2.5, 5].find((k) => k * power >= rough) || 10);
}
function ticks(from, to, count) {
  const by = step(to - from, count);
  const first = Math.ceil(from / by - 1e-9);
  return Array.from({ length: Math.max(0, Math.floor(to / by + 1e-9) - first + 1) }, (_, k) => (first + k) * by);
}
function written(x, digits) {
  if (x === 0) return "0";
  const size = Math.abs(x);
  const rounded = Number(x.toPrecision(digits));
  const text = size >= 1e5 || size < 1e-3 ? rounded.toExponential() : String(rounded);
  return text.replaceAll("-", "−").replace("e+", "e");
}

// The span of time that all plots show: within that of the run, and at least two neighbouring rows long.
function timeSpan(times, changed) {
  const first = times[0];
  const last = Math.max(times[times.length - 1], first + 1e-9);
  const least = Math.min(last - first, (2 * (last - first)) / Math.max(1, times.length - 1));
  const span = { first, last, from: first, to: last };
  span.isWhole = () => span.from === first && span.to === last;
  span.set = (from, to) => {
    const size = Math.max(least, to - from);
    const isWhole = !(size < last - first);
    span.from = isWhole ? first : Math.min(last - size, Math.max(first, (from + to - size) / 2));
    span.to = isWhole ? last : span.from + size;
    changed();
  };
  span.zoom = (factor, about) => span.set(about + (span.from - about) * factor, about + (span.to - about) * factor);
  span.move = (part) => {
    const by = Math.min(last - span.to, Math.max(first - span.from, part * (span.to - span.from)));
    span.set(span.from + by, span.to + by);
  };
  span.reset = () => span.set(first, last);
  // The rows that are seen, and one more on each side.
  span.rows = () => {
    const before = (t) => {
      let [low, high] = [0, times.length];
      while (low < high) {
        const middle = (low + high) >> 1;
        if (times[middle] < t) low = middle + 1;
        else high = middle;
      }
      return low;
    };
    return [Math.max(0, before(span.from) - 1), Math.min(times.length - 1, before(span.to))];
  };
  return span;
}

const COLOURS = 10;
const HEIGHT = 170;
const EDGE = { left: 52, right: 12, top: 8, bottom: 22 };

// Points of a line from a row to a row; where several rows share a pixel, the lowest and the highest of them.
function path(times, values, [from, to], x, y) {
  const points = [];
  const put = (k) => points.push(`${x(times[k]).toFixed(1)} ${y(values[k]).toFixed(1)}`);
  for (let k = from; k <= to;) {
    const pixel = Math.floor(x(times[k]));
    let [end, low, high] = [k + 1, k, k];
    for (; end <= to && Math.floor(x(times[end])) === pixel; end++) {
      if (values[end] < values[low]) low = end;
      if (values[end] > values[high]) high = end;
    }
    const kept = [k, Math.min(low, high), Math.max(low, high), end - 1];
    kept.forEach((row, n) => (n === 0 || row !== kept[n - 1]) && put(row));
    k = end;
  }
  return points.length ? `M${points.join("L")}` : "";
}

// `seek` is called with a time where the plot is pressed; the plot has `show(time, row)`, where rows may lie between two.
function chart(of, { times, columns, seek, span }) {
  const box = element("details", "chart");
  box.open = of.open;
  const head = element("summary", "", of.title);
  if (of.unit) head.append(" ", element("span", "unit", `[${of.unit}]`));
  const svg = made("svg", { role: "application", tabindex: 0, "aria-describedby": "plot-keys", height: HEIGHT });
  const legend = element("ul", "legend");
  box.append(head, svg, legend);
  const lines = of.lines.map((line) => {
    const values = columns[line.column];
    const classes = `line c${line.colour % COLOURS}${line.colour >= COLOURS ? " dashed" : ""}`;
    const key = element("button");
    key.type = "button";
    key.setAttribute("aria-pressed", "true");
    const value = element("span", "value");
    const swatch = made("svg", { width: 18, height: 10, "aria-hidden": "true" });
    swatch.append(made("path", { class: classes, d: "M0 5H18" }));
    key.append(swatch, element("bdi", "", line.name), value);
    const item = element("li");
    item.append(key);
    legend.append(item);
    const shown = { line, values, classes, value, on: true };
    key.addEventListener("click", () => {
      shown.on = !shown.on;
      key.setAttribute("aria-pressed", String(shown.on));
      layOut();
    });
    return shown;
  });

  let width = 0, x = () => 0, y = () => 0, cursor, chosen, dots = [], now = [times[0], 0];

  function layOut() {
    width = svg.clientWidth || box.clientWidth;
    if (!box.open || width < 80) return;
    const rows = span.rows();
    let [low, high] = [Infinity, -Infinity];
    for (const { on, values } of lines) {
      if (on) for (let k = rows[0]; k <= rows[1]; k++) [low, high] = [Math.min(low, values[k]), Math.max(high, values[k])];
    }
    if (!(low <= high)) [low, high] = [-1, 1];
    // what does not move is a line in the middle
    const size = Math.max(Math.abs(low), Math.abs(high));
    const room = high - low > 1e-6 * size ? (high - low) * 0.06 : 0.1 * size || 1;
    [low, high] = [low - room, high + room];
    x = (t) => EDGE.left + ((t - span.from) / (span.to - span.from)) * (width - EDGE.left - EDGE.right);
    y = (v) => HEIGHT - EDGE.bottom - ((v - low) / (high - low)) * (HEIGHT - EDGE.top - EDGE.bottom);
    const seen = span.isWhole() ? "" : `, from ${written(span.from, 6)} s to ${written(span.to, 6)} s`;
    svg.setAttribute("aria-label", `${of.title} over time${seen}`);
    svg.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
    svg.replaceChildren();
    for (const v of ticks(low, high, 5)) {
      const at = y(v).toFixed(1);
      svg.append(made("path", { class: "grid", d: `M${EDGE.left} ${at}H${width - EDGE.right}` }));
      svg.append(made("text", { x: EDGE.left - 6, y: Number(at) + 4, "text-anchor": "end" }, written(v, 4)));
    }
    const marks = ticks(span.from, span.to, width / 90);
    const digits = Math.max(5, Math.ceil(Math.log10(Math.max(Math.abs(span.from), Math.abs(span.to)) / (span.to - span.from))) + 3);
    marks.forEach((t, k) => {
      const unitText = k === marks.length - 1 ? " s" : "";
      svg.append(made("text", { x: Math.min(x(t), width - 16).toFixed(1), y: HEIGHT - 6, "text-anchor": "middle" }, written(t, digits) + unitText));
      svg.append(made("path", { class: "grid", d: `M${x(t).toFixed(1)} ${EDGE.top}V${HEIGHT - EDGE.bottom}` }));
    });
    // what lies outside of it is not seen
    const inner = width - EDGE.left - EDGE.right;
    const pane = made("svg", { x: EDGE.left, y: 0, width: inner, height: HEIGHT, viewBox: `${EDGE.left} 0 ${inner} ${HEIGHT}` });
    for (const { on, values, classes } of lines) if (on) pane.append(made("path", { class: classes, d: path(times, values, rows, x, y) }));
    cursor = made("path", { class: "cursor" });
    chosen = made("rect", { class: "chosen", y: EDGE.top, height: HEIGHT - EDGE.top - EDGE.bottom, width: 0 });
    dots = lines.map(({ line }) => made("circle", { class: `dot c${line.colour % COLOURS}`, r: 3 }));
    pane.append(chosen, cursor, ...dots);
    svg.append(pane);
    show(...now);
  }

  function show(time, row) {
    now = [time, row];
    if (!box.open || !cursor) return;
    const at = x(time).toFixed(1);
    cursor.setAttribute("d", `M${at} ${EDGE.top}V${HEIGHT - EDGE.bottom}`);
    const low = Math.floor(row);
    lines.forEach(({ on, values, value }, k) => {
      const v = mix(values[low], values[Math.min(low + 1, values.length - 1)], row - low);
      value.textContent = written(v, 4);
      dots[k].setAttribute("cx", at);
      dots[k].setAttribute("cy", y(v).toFixed(1));
      dots[k].setAttribute("visibility", on ? "visible" : "hidden");
    });
  }

  const timeAt = (place) => {
    const part = (place - svg.getBoundingClientRect().left - EDGE.left) / (width - EDGE.left - EDGE.right);
    return span.from + Math.min(1, Math.max(0, part)) * (span.to - span.from);
  };
  listenToPlot(svg, { timeAt, seek, span, time: () => now[0], mark: (from, to) => {
    const [left, right] = [x(Math.min(from, to)), x(Math.max(from, to))];
    chosen.setAttribute("x", left.toFixed(1));
    chosen.setAttribute("width", (right - left).toFixed(1));
  } });
  box.addEventListener("toggle", layOut);
  new ResizeObserver(() => svg.clientWidth !== width && layOut()).observe(box);
  return { box, show, layOut };
}

// A pointer goes to a time, with Shift it chooses a span; two fingers or the wheel with Ctrl zoom, as do keys.
function listenToPlot(svg, { timeAt, seek, span, time, mark }) {
  const fingers = new Map();
  let begun = null;
  svg.addEventListener("pointerdown", (event) => {
    svg.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, timeAt(event.clientX));
    begun = event.shiftKey && event.buttons === 1 ? timeAt(event.clientX) : null;
    drag(event);
  });
  const drag = (event) => {
    if (!fingers.has(event.pointerId) || event.buttons !== 1) return;
    const at = timeAt(event.clientX);
    const other = [...fingers].find(([id]) => id !== event.pointerId);
    if (other) {
      // the times that the fingers took hold of stay under them
      const [held, still] = [fingers.get(event.pointerId), other[1]];
      const factor = (held - still) / (at - still);
      if (factor > 0.1 && factor < 10) span.zoom(factor, still);
    } else if (begun !== null) mark(begun, at);
    else seek(at);
    event.preventDefault();
  };
  svg.addEventListener("pointermove", drag);
  const end = (event) => {
    fingers.delete(event.pointerId);
    const [from, to] = [begun, timeAt(event.clientX)];
    begun = null;
    if (from === null) return;
    if (event.type === "pointerup" && from !== to) span.set(Math.min(from, to), Math.max(from, to));
    else mark(from, from);
  };
  for (const name of ["pointerup", "pointercancel"]) svg.addEventListener(name, end);
  svg.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.metaKey) return;
    event.preventDefault();
    span.zoom(Math.exp(Math.max(-60, Math.min(60, event.deltaY)) * 0.005), timeAt(event.clientX));
  }, { passive: false });
  svg.addEventListener("dblclick", () => span.reset());
  svg.addEventListener("keydown", (event) => {
    const about = Math.min(span.to, Math.max(span.from, time()));
    if (event.key === "+" || event.key === "=") span.zoom(0.8, about);
    else if (event.key === "-") span.zoom(1.25, about);
    else if (event.key === "0") span.reset();
    else if (event.key === "ArrowLeft") span.move(-0.1);
    else if (event.key === "ArrowRight") span.move(0.1);
    else return;
    event.preventDefault();
  });
}
