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

const COLOURS = 10;
const HEIGHT = 170;
const EDGE = { left: 52, right: 12, top: 8, bottom: 22 };

// `seek` is called with a time where the plot is pressed; the plot has `show(time, row)`, where rows may lie between two.
function chart(of, { times, columns, seek }) {
  const box = element("details", "chart");
  box.open = of.open;
  const head = element("summary", "", of.title);
  if (of.unit) head.append(" ", element("span", "unit", `[${of.unit}]`));
  const svg = made("svg", { role: "img", "aria-label": `${of.title} over time`, height: HEIGHT });
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

  const first = times[0];
  const last = Math.max(times[times.length - 1], first + 1e-9);
  let width = 0, x = () => 0, y = () => 0, cursor, dots = [], now = [first, 0];

  function layOut() {
    width = svg.clientWidth || box.clientWidth;
    if (!box.open || width < 80) return;
    let [low, high] = [Infinity, -Infinity];
    for (const { on, values } of lines) if (on) for (const v of values) [low, high] = [Math.min(low, v), Math.max(high, v)];
    if (!(low <= high)) [low, high] = [-1, 1];
    // what does not move is a line in the middle
    const size = Math.max(Math.abs(low), Math.abs(high));
    const room = high - low > 1e-6 * size ? (high - low) * 0.06 : 0.1 * size || 1;
    [low, high] = [low - room, high + room];
    x = (t) => EDGE.left + ((t - first) / (last - first)) * (width - EDGE.left - EDGE.right);
    y = (v) => HEIGHT - EDGE.bottom - ((v - low) / (high - low)) * (HEIGHT - EDGE.top - EDGE.bottom);
    svg.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
    svg.replaceChildren();
    for (const v of ticks(low, high, 5)) {
      const at = y(v).toFixed(1);
      svg.append(made("path", { class: "grid", d: `M${EDGE.left} ${at}H${width - EDGE.right}` }));
      svg.append(made("text", { x: EDGE.left - 6, y: Number(at) + 4, "text-anchor": "end" }, written(v, 4)));
    }
    const marks = ticks(first, last, width / 90);
    marks.forEach((t, k) => {
      const unitText = k === marks.length - 1 ? " s" : "";
      svg.append(made("text", { x: Math.min(x(t), width - 16).toFixed(1), y: HEIGHT - 6, "text-anchor": "middle" }, written(t, 5) + unitText));
      svg.append(made("path", { class: "grid", d: `M${x(t).toFixed(1)} ${EDGE.top}V${HEIGHT - EDGE.bottom}` }));
    });
    for (const { on, values, classes } of lines) {
      if (!on) continue;
      let d = "";
      for (let k = 0; k < values.length; k++) d += `${k ? "L" : "M"}${x(times[k]).toFixed(1)} ${y(values[k]).toFixed(1)}`;
      svg.append(made("path", { class: classes, d }));
    }
    cursor = made("path", { class: "cursor" });
    dots = lines.map(({ line }) => made("circle", { class: `dot c${line.colour % COLOURS}`, r: 3 }));
    svg.append(cursor, ...dots);
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

  const press = (event) => {
    if (event.buttons !== 1) return;
    const place = (event.clientX - svg.getBoundingClientRect().left - EDGE.left) / (width - EDGE.left - EDGE.right);
    seek(first + Math.min(1, Math.max(0, place)) * (last - first));
    event.preventDefault();
  };
  svg.addEventListener("pointerdown", (event) => {
    svg.setPointerCapture(event.pointerId);
    press(event);
  });
  svg.addEventListener("pointermove", press);
  box.addEventListener("toggle", layOut);
  new ResizeObserver(() => svg.clientWidth !== width && layOut()).observe(box);
  return { box, show };
}
