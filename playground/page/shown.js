// Complaints, counts, code and the waterfall, as the compiler answered.
function showComplaints(list, failure) {
  const box = byId("complaints");
  box.replaceChildren();
  for (const { severity, code, line, column, file, text } of list) {
    const item = node("li", { class: severity });
    const isHere = line > 0 && file === state.name;
    const head = isHere ? node("button", { type: "button", text: `${severity} in line ${line}, column ${column}` }) : node("strong", { text: line > 0 ? `${severity} in ${file}, line ${line}` : severity });
    if (isHere) head.addEventListener("click", () => goTo(line, column));
    item.append(head, " ", node("code", { class: "muted", text: code }), node("pre", { text, tabindex: "0" }));
    box.append(item);
  }
  if (failure) box.append(node("li", { class: "error" }, node("strong", { text: "The compiler stopped" }), node("pre", { text: failure, tabindex: "0" })));
  const count = (of) => list.filter(({ severity }) => severity === of).length;
  const words = (n, word) => `${n} ${word}${n === 1 ? "" : "s"}`;
  byId("complaints-box").hidden = !list.length && !failure;
  byId("complaints-summary").textContent = failure ? "This should not happen; please report the file." : `${words(count("error"), "error")}, ${words(count("warning"), "warning")}.`;
}
function goTo(line, column) {
  const area = byId("robot");
  const lines = area.value.split("\n");
  const start = lines.slice(0, line - 1).reduce((sum, text) => sum + text.length + 1, 0);
  const own = lines[line - 1] || "";
  const from = start + [...own].slice(0, column - 1).join("").length;
  area.focus();
  area.setSelectionRange(from, start + own.length);
  area.scrollTop = Math.max(0, (line - 4) * parseFloat(getComputedStyle(area).lineHeight));
}

function table(id, head, rows, caption) {
  const made = byId(id);
  made.replaceChildren();
  if (caption) made.append(node("caption", { class: "muted small", text: caption }));
  const row = node("tr");
  head.forEach((text, k) => row.append(node("th", { scope: "col", class: k ? "" : "left", text })));
  made.append(node("thead", {}, row));
  const body = node("tbody");
  for (const cells of rows) {
    const line = node("tr");
    cells.forEach((cell, k) => {
      if (cell instanceof Node) line.append(cell);
      else line.append(k ? node("td", { text: cell }) : node("th", { scope: "row", text: cell }));
    });
    body.append(line);
  }
  made.append(body);
}
function showCounts() {
  const { report, quick, milliseconds } = state.code;
  const rows = Object.entries(report.functions).map(([name, of]) => [
    name, ...[of.mul, of.add, of.div, of.sqrt, of.sincos].map(thousands), thousands(of.mul + of.add + of.div + of.sqrt), thousands(of.lines),
  ]);
  table("counts", ["Function", "mul", "add", "div", "√", "sin & cos", "flops", "lines"], rows);
  byId("counts-about").textContent = quick
    ? `First text in ${saidNumber(milliseconds / 1000)} s, of one form of the robot; the full search goes on.`
    : `The fewest operations that the compiler finds, in ${saidNumber(milliseconds / 1000)} s. Flops are multiplications, additions, divisions and roots.`;
  byId("counts-box").hidden = false;
}
function showCode() {
  const { text, quick } = state.code;
  // a text of megabytes is slow to lay out: its beginning is shown, all of it is copied and saved
  const most = 200000;
  byId("code").textContent = text.length > most ? `${text.slice(0, text.lastIndexOf("\n", most))}\n… ${thousands(text.length - most)} characters more: copy or save them.` : text;
  byId("code-about").textContent = `${thousands(text.split("\n").length - 1)} lines of Rust${quick ? ", not the final ones yet" : ""}.`;
  byId("code-box").hidden = false;
}
function showWaterfall() {
  const report = state.explained;
  const choice = byId("waterfall-function");
  byId("waterfall-of").hidden = !report;
  byId("waterfall").hidden = !report;
  byId("explain").hidden = !!report;
  if (!report) return;
  const names = Object.keys(report.functions).filter((name) => report.functions[name].savings);
  if (choice.dataset.of !== names.join()) {
    choice.replaceChildren(...names.map((name) => node("option", { value: name, text: name })));
    choice.dataset.of = names.join();
    if (names.includes("inverse_dynamics")) choice.value = "inverse_dynamics";
  }
  const water = report.functions[choice.value];
  if (!water || !water.savings) return;
  const flops = (c) => c.mul + c.add + c.div + c.sqrt;
  const all = flops(water.plain);
  const most = Math.max(all, ...water.savings.map(({ after }) => flops(after)));
  const bar = (from, to, kind) => {
    const cell = node("td", { class: "bar", "aria-hidden": "true" });
    const piece = node("span", { class: kind });
    piece.style.marginLeft = `${(100 * Math.min(from, to)) / most}%`;
    piece.style.width = `${Math.max(0.4, (100 * Math.abs(to - from)) / most)}%`;
    cell.append(piece);
    return cell;
  };
  const rows = [["Plain unrolling", thousands(all), "", bar(0, all, "")]];
  let now = all;
  for (const { what, operations, after } of water.savings) {
    const next = flops(after);
    rows.push([what, thousands(next), (operations > 0 ? "+" : "−") + thousands(Math.abs(operations)), bar(now, next, next <= now ? "saved" : "more")]);
    now = next;
  }
  rows.push(["Generated", thousands(now), `${saidNumber((100 * now) / all)} %`, bar(0, now, "")]);
  table("waterfall", ["Step", "flops", "change", ""], rows);
  byId("waterfall-about").textContent = `${choice.value}: ${thousands(all)} operations as they are unrolled, ${thousands(now)} in the generated function. Each step was compiled.`;
}
