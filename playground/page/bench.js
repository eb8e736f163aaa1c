// The robot on the bench: its motion, limits and sliders.
// Data of a motion of the same robot goes into the running view; another robot gets another view.
function showMotion(bench) {
  const { data } = bench;
  const shape = JSON.stringify([state.name, data.title, data.times, data.bodies.map(({ name, parent, kind }) => [name, parent, kind]), data.charts, bench.text.length > 0 && data.shapes.length]);
  if (state.view && shape === state.shape) state.view.update(data);
  else {
    if (state.view) state.view.stop();
    byId("viewed").replaceChildren(VIEW.content.cloneNode(true));
    byId("data").textContent = JSON.stringify(data);
    byId("moving").hidden = false;
    state.view = robotView();
    document.title = `${data.title}: Straightline playground`;
    state.shape = shape;
  }
  const names = bench.functions.map(({ name }) => name).join(", ");
  byId("moving-about").textContent = bench.module
    ? `${names}: WebAssembly of ${thousands(Math.round((bench.module.length * 3) / 4))} bytes made here in ${saidNumber(bench.milliseconds.all)} ms; the same bits as the interpreter's. Poses and torques are theirs.`
    : `Shown without functions of its own: ${bench.why_not || "there are none"}.`;
}

const greatest = (numbers) => numbers.reduce((most, x, k) => (Math.abs(x) > most.size ? { size: Math.abs(x), at: k } : most), { size: 0, at: 0 });
function showLimits(bench) {
  const rows = [];
  let exceeded = 0;
  const line = (what, of, unit, limit) => {
    const has = limit !== null && limit !== undefined;
    const over = has && of.size > limit * (1 + 1e-12);
    if (over) exceeded++;
    const verdict = !has ? "no limit given" : over ? `exceeded by ${saidNumber(100 * (of.size / limit - 1))} %${of.when === undefined ? "" : ` at ${saidNumber(of.when)} s`}` : `within, ${saidNumber((100 * of.size) / limit, 2)} %`;
    rows.push([what, `${saidNumber(of.size)}\u00a0${unit}`, has ? `${saidNumber(limit)}\u00a0${unit}` : "–", node("td", { class: over ? "exceeded" : "", text: verdict })]);
  };
  const { joints, tau, nv, drives } = bench;
  const times = decode(bench.times);
  const rate = decode(bench.qd);
  const of = (numbers, at, stride) => {
    const own = Float64Array.from(times, (_, k) => numbers[k * stride + at]);
    const { size, at: row } = greatest(own);
    return { size, when: times[row], own };
  };
  for (const { name, iv, slides, velocity, effort } of joints) {
    if (tau) line(`${name}: ${slides ? "force" : "torque"}`, of(tau, iv, nv), slides ? "N" : "N·m", effort);
    line(`${name}: speed`, of(rate, iv, nv), slides ? "m/s" : "rad/s", velocity);
  }
  let heat = 0;
  if (drives && drives.drives) {
    const count = times.length;
    const mean = (numbers) => {
      let sum = 0;
      for (let k = 0; k + 1 < count; k++) sum += ((numbers[k] + numbers[k + 1]) / 2) * (times[k + 1] - times[k]);
      return sum / (times[count - 1] - times[0]);
    };
    drives.drives.forEach((drive, k) => {
      const part = (key) => of(drives[key].subarray(k * count, (k + 1) * count), 0, 1);
      const power = mean(part("joule").own);
      heat += power;
      line(`${drive.name}: current`, part("current"), "A", drive.current);
      line(`${drive.name}: voltage`, part("input"), "V", drive.input);
      if (drive.speed !== null) line(`${drive.name}: motor speed`, part("speed"), "rad/s", drive.speed);
      if (drive.continuous_current !== null) line(`${drive.name}: lasting current`, { size: Math.sqrt(mean(part("current").own.map((i) => i * i))) }, "A", drive.continuous_current);
      line(`${drive.name}: Joule heat, mean`, { size: power }, "W", null);
      if (drive.thermal) {
        const [perWatt, air, limit] = drive.thermal;
        line(`${drive.name}: winding, if this goes on`, { size: air + perWatt * power }, "°C", limit);
      }
    });
  }
  table("limits", ["Quantity", "Greatest", "Limit", "Verdict"], rows);
  const why = drives && drives.why_not ? ` Motors are not shown: ${drives.why_not}.` : "";
  byId("limits-summary").textContent = `${exceeded ? `${exceeded} of ${rows.length} quantities exceed their limits.` : "All limits are kept."} The motors heat with ${saidNumber(heat)} W in the mean.${why}`;
  byId("limits-summary").className = exceeded ? "bad" : "";
  byId("limits-box").hidden = !rows.length;
}
function decode(text) {
  const raw = atob(text);
  return new Float64Array(Uint8Array.from(raw, (c) => c.charCodeAt(0)).buffer);
}

let sliderCount = 0;
function slider(title, unit, { min, max, value, log, neutral }, changed) {
  const id = `slider-${sliderCount++}`;
  const scale = log ? Math.log : (x) => x;
  const back = log ? Math.exp : (x) => x;
  const input = node("input", { id, type: "range", min: scale(min), max: scale(max), step: (scale(max) - scale(min)) / 200 });
  input.value = scale(value);
  const output = node("output", { for: id });
  const show = (x) => {
    const text = `${saidNumber(x)} ${unit}`.trim();
    output.textContent = text;
    input.setAttribute("aria-valuetext", text);
  };
  show(value);
  input.addEventListener("input", () => {
    let x = back(Number(input.value));
    // the file's own number is found again
    if (neutral !== undefined && Math.abs(scale(x) - scale(neutral)) < (scale(max) - scale(min)) / 120) x = neutral;
    show(x);
    changed(x);
  });
  return node("div", { class: "slider" }, node("label", { for: id, text: title }), output, input);
}
function showSliders() {
  const bench = state.bench;
  const key = JSON.stringify([state.name, bench.editables, bench.tip, bench.motors.map(({ joint }) => joint), state.round]);
  if (byId("sliders").dataset.of === key) return;
  byId("sliders").dataset.of = key;
  const box = byId("sliders");
  box.replaceChildren();
  const group = (title, ...of) => {
    const made = node("fieldset", {}, node("legend", { text: title }), ...of);
    box.append(made);
    return made;
  };
  const general = [slider("Period of the motion", "s", { min: 0.5, max: 20, value: state.period, log: true, neutral: 4 }, (x) => { state.period = x; bench_again(); })];
  if (bench.tip) general.push(slider(`Payload at ${bench.tip}`, "kg", { min: 0, max: 20, value: state.payload }, (x) => { state.payload = x; bench_again(); }));
  group("Motion and payload", ...general);
  const of = (kind, unit, list) => list.map(({ name, value }) => slider(name, unit, { min: value / 4, max: value * 4, value: value * (state.factors[kind][name] || 1), log: true, neutral: value }, (x) => {
    state.factors[kind][name] = x / value;
    bench_again();
  }));
  const { masses, lengths } = bench.editables;
  if (masses.length) group("Masses of links, with their inertias", ...of("masses", "kg", masses));
  if (lengths.length) group("Distances of joints from their parents", ...of("lengths", "m", lengths));
  if (bench.motors.length) {
    const choice = node("select", { "aria-label": "Motor of joint" }, ...bench.motors.map(({ joint }, k) => node("option", { value: k, text: joint })));
    const all = node("option", { value: "all", text: "all joints" });
    choice.prepend(all);
    choice.value = state.motor === "all" ? "all" : String(Math.min(state.motor, bench.motors.length - 1));
    const own = node("div");
    const rows = [
      ["ratio", "Gear ratio", "", 1, 1000], ["torque_constant", "Torque constant", "N·m/A", 1e-3, 2], ["resistance", "Resistance of the winding", "Ω", 0.01, 50],
      ["rotor_inertia", "Inertia of the rotor", "kg·m²", 1e-7, 1e-2], ["current", "Greatest current", "A", 0.5, 100], ["voltage", "Greatest voltage", "V", 5, 400],
      ["thermal_resistance", "Thermal resistance to the air", "K/W", 0.1, 20],
    ];
    const show = () => {
      const chosen = choice.value === "all" ? state.motors : [state.motors[Number(choice.value)]];
      own.replaceChildren(...rows.map(([name, title, unit, min, max]) => {
        const value = chosen[0][name];
        return slider(title, unit, { min: Math.min(min, value), max: Math.max(max, value), value, log: true, neutral: value }, (x) => {
          for (const motor of chosen) motor[name] = x;
          bench_again();
        });
      }));
    };
    choice.addEventListener("change", () => {
      state.motor = choice.value === "all" ? "all" : Number(choice.value);
      show();
    });
    show();
    group("Motors (made up to suit the motion, until you say more)", node("div", { class: "row" }, node("span", { text: "Of " }), choice), own);
  }
  byId("sliders-box").hidden = false;
}

// One bench at a time; what changed meanwhile is benched next.
let benching = false, benchWanted = false;
function bench_again() {
  benchWanted = true;
  if (!benching) runBench();
}
async function runBench() {
  benching = true;
  while (benchWanted) {
    benchWanted = false;
    const { factors, payload, period, motors, round } = state;
    const bench = await bencher.ask("bench", { ...files(), factors, payload, period, motors });
    if (!bench || round !== state.round) continue;
    if (bench.failure) {
      showComplaints([], bench.failure);
      say("The compiler stopped.", true);
      continue;
    }
    state.bench = bench;
    if (!bench.data) {
      if (bench.why_not) byId("moving-about").textContent = bench.why_not;
      if (bench.complaints.length) showComplaints(bench.complaints);
      continue;
    }
    if (!state.motors.length) state.motors = bench.motors.map((motor) => ({ ...motor }));
    state.module = bench.module;
    showMotion(bench);
    showLimits(bench);
    showSliders();
    document.body.dataset.bench = String(Number(document.body.dataset.bench || 0) + 1);
    if (state.times.moving === undefined) state.times.moving = performance.now() - state.times.began;
  }
  benching = false;
  settle();
}
