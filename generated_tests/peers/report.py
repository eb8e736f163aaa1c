"""The record of a run of the peers: report.py WORK RECORD writes RECORD.md and RECORD.svg.

WORK is the harness's scratch folder with results.tsv and peak.tsv. Ratios are quotients of medians of ratios that the harness
measured back to back with its reference, so that a change of the machine's clock does not enter."""

import os
import subprocess
import sys

GENERATED = ["casadi", "casadi_fast", "casadi_cse", "casadi_clang", "cppadcg"]
OURS = ["straightline", "straightline_fma", "straightline_avx2", "straightline_wide", "straightline_portable"]
FUNCTIONS = {"id": "inverse dynamics", "crba": "mass matrix", "aba": "forward dynamics",
             "fkjac": "forward kinematics + Jacobian", "id_deriv": "derivatives of inverse dynamics",
             "fd_deriv": "derivatives of forward dynamics"}
DERIVATIVES = ("id_deriv", "fd_deriv")
ARMS = ["ur5", "puma560", "panda", "iiwa"]
# what is aimed at: time relative to the best generated C, and to Pinocchio by clang
AIMS = {"id": {"arm": (0.50, 0.165), "hyq": (0.55, 0.22), "talos": (0.60, 0.35)},
        "crba": {"arm": (0.55, 0.20), "hyq": (0.65, 0.31), "talos": (0.70, 0.45)},
        "aba": {"arm": (0.60, 0.165), "hyq": (0.40, 0.23), "talos": (0.50, 0.32)},
        "fkjac": {"arm": (0.80, 0.31), "hyq": (0.80, None), "talos": (0.80, None)},
        "id_deriv": {"ur5": (1 / 6, None), "panda": (1 / 4.5, None), "hyq": (1 / 3, None), "talos": (1 / 3, None)},
        "fd_deriv": {"ur5": (1 / 5, None), "panda": (1 / 3, None), "hyq": (1 / 2, None), "talos": (1 / 2, None)}}
LATENCY_AIM = 0.65  # inverse dynamics of arms, each call waiting for the last
# states per second relative to the best generated C; f32: twice f64
BATCH_AIMS = {"straightline_fma": {"arm": 8.0, "hyq": 6.0}, "straightline_avx2": {"arm": 4.5, "hyq": 3.5}}
BATCH_DERIVATIVES_AIM = 15.0  # by AVX-512, fused
BATCH_FUNCTIONS = {"id": "inverse_dynamics", "aba": "forward_dynamics", "id_deriv": "inverse_dynamics_derivatives",
                   "fd_deriv": "forward_dynamics_derivatives"}


def rows(path):
    with open(path) as file:
        return [line.rstrip("\n").split("\t") for line in file if line.strip()]


def kind(robot):
    return "arm" if robot in ARMS else robot


def aims(function, robot):
    of = AIMS.get(function, {})
    return of.get(robot, of.get(kind(robot), (None, None)))


def batch_aim(run, function, robot, name):
    """Times the states per second of the best generated C."""
    if function in DERIVATIVES:
        return BATCH_DERIVATIVES_AIM if name in ("straightline_fma", "straightline_wide") and "fma_avx512_gflops" in run.machine else None
    return BATCH_AIMS.get(name, {}).get(kind(robot))


class Run:
    def __init__(self, work):
        self.time, self.latency, self.batch = {}, {}, {}
        for row in rows(os.path.join(work, "results.tsv")):
            if row[0] in ("time", "lat") and row[4] != "FAIL":
                table = self.time if row[0] == "time" else self.latency
                # nanoseconds, ratio to the reference, its quartiles, difference
                table.setdefault((row[1], row[2]), {})[row[3]] = tuple(float(row[k]) for k in (4, 6, 7, 8, 10))
            elif row[0] in ("time", "lat"):
                self.time.setdefault((row[1], row[2]), {})[row[3]] = None
            elif row[0] == "batch":
                self.batch.setdefault((row[1], row[2]), {})[(row[3], row[4])] = (float(row[6]), float(row[8]))
        self.work = work
        optional = lambda name: rows(os.path.join(work, name)) if os.path.exists(os.path.join(work, name)) else []
        self.single = {(row[0], row[1], row[2]): (float(row[3]), float(row[4])) for row in optional("single.tsv")}
        self.load = ", ".join(cell for row in optional("load.txt") for cell in row)
        self.machine = {row[0]: row[1] for row in rows(os.path.join(work, "peak.tsv")) if len(row) > 1}

    def robots(self):
        return list(dict.fromkeys(robot for robot, _ in self.time))

    def operations(self, robot, function):
        """Multiplications, additions and divisions of our function, as the head of its file counts them, fused ones as one."""
        path = os.path.join(self.work, "ours", f"{robot}.fma.header")
        if os.path.exists(path):
            for row in open(path):
                words = row.split()
                if words[1:2] == [BATCH_FUNCTIONS.get(function)]:
                    mul, add, fma, div = map(int, words[2:6])
                    return mul + add + div, fma + div
        return None

    def functions(self):
        return [f for f in FUNCTIONS if any(g == f for _, g in self.time)]


def measured(cells, names):
    return [n for n in names if cells.get(n)]


def best(cells, names):
    """The fastest of these contenders, or None."""
    return min(measured(cells, names), key=lambda n: cells[n][1], default=None)


def comparison(cells, ours="straightline"):
    """Time over that of the best generated C, its name, time over Pinocchio's, half the quartile distance."""
    rival = best(cells, GENERATED)
    if not cells.get(ours) or rival is None:
        return None
    mine = cells[ours]
    spread = (mine[3] - mine[2]) / 2 / mine[1] + (cells[rival][3] - cells[rival][2]) / 2 / cells[rival][1]
    return mine[1] / cells[rival][1], rival, mine[1], spread


def verdict(value, aim):
    if aim is None:
        return ""
    return f"{aim:.3g} {'holds' if value <= aim else '**missed**'}"


def comparisons(out, table, title, aim_of):
    out.append(f"\n## {title}\n")
    out.append("| function | robot | ns | best generated C | ns | time / generated C | aim | time / Pinocchio | aim | difference |")
    out.append("|---" * 10 + "|")
    for (robot, function), cells in table.items():
        found = comparison(cells)
        if function in FUNCTIONS and found is None and cells.get("straightline"):
            mine = cells["straightline"]
            out.append(f"| {FUNCTIONS[function]} | {robot} | {mine[0]:.1f} | not built | | | | {mine[1]:.3f} | | {mine[4]:.0e} |")
        if function not in FUNCTIONS or found is None:
            continue
        ratio, rival, to_reference, spread = found
        aim, reference_aim = aim_of(function, robot)
        out.append(f"| {FUNCTIONS[function]} | {robot} | {cells['straightline'][0]:.1f} | {rival} | {cells[rival][0]:.1f} "
                   f"| {ratio:.3f} ± {spread * ratio:.3f} | {verdict(ratio, aim)} | {to_reference:.3f} "
                   f"| {verdict(to_reference, reference_aim)} | {cells['straightline'][4]:.0e} |")


def all_contenders(out, table, title):
    names = list(dict.fromkeys(name for cells in table.values() for name in cells))
    out.append(f"\n## {title}\n")
    out.append("| robot | function | " + " | ".join(names) + " |")
    out.append("|---" * (2 + len(names)) + "|")
    for (robot, function), cells in table.items():
        text = [f"{cells[n][0]:.1f}" if cells.get(n) else ("off" if n in cells else "") for n in names]
        out.append(f"| {robot} | {function} | " + " | ".join(text) + " |")


def batches(out, run):
    if not run.batch:
        return
    widest = float(run.machine.get("fma_avx512_gflops", 0))
    peak = widest or float(run.machine.get("fma_avx2_gflops", 0))
    by_widest = f"{widest:.0f} by AVX-512" if widest else "which has no AVX-512"
    out.append("\n## Batches, one core: ns per state\n")
    out.append("States per second relative to the best generated C called in a loop. `straightline_fma` fuses, for the instructions of this machine, of which LLVM "
               "takes registers of 256 bits; `straightline_wide` is compiled with `-C target-feature=-prefer-256-bit`, too; `straightline_avx2` fuses and has AVX2 alone. "
               "`loop` is the plain function, `soa` a structure of arrays, `blocks` are eight states after eight, each component by eight (`…_lanes::<8>`). Peak of this core, measured: "
               f"{float(run.machine.get('fma_avx2_gflops', 0)):.0f} Gflop/s by AVX2, {by_widest}. Share of it: operations of the function, without those "
               "inside sines and cosines, over what the peak would do in that time.\n")
    out.append("| function | robot | ours | ns | best generated C, ns | times as many states per second | aim | share of peak |")
    out.append("|---" * 8 + "|")
    for (robot, function), cells in run.batch.items():
        generated = [cells[(n, "loop")][0] for n in GENERATED if (n, "loop") in cells]
        for (name, mode), (nanoseconds, _) in cells.items():
            if name not in OURS or (mode == "loop" and name != "straightline"):
                continue
            gain = min(generated) / nanoseconds if generated else None
            aim = batch_aim(run, function, robot, name) if mode in ("soa", "blocks") else None
            said = "" if aim is None or gain is None else f"{aim:g} {'holds' if gain >= aim else '**missed**'}"
            beside = f"{min(generated):.1f} | {gain:.2f}" if generated else "not built |"
            operations = run.operations(robot, function) if mode in ("soa", "blocks") else None
            share = f"{100 * operations[0] / nanoseconds / peak:.0f} %" if operations and peak else ""
            out.append(f"| {FUNCTIONS.get(function, function)} | {robot} | {name}, {mode} | {nanoseconds:.1f} | {beside} | {said} | {share} |")
    if not run.single:
        return
    out.append("\n## Batches in f32\n")
    out.append("Structure of arrays, fused, the libraries for f64 and f32 by turns (`single.py`). States per second relative to f64, and to the best "
               "generated C, which computes in f64; the aim is twice the multiple of f64.\n")
    out.append("| function | robot | instructions | f64, ns | f32, ns | times f64 | times the best generated C | aim |")
    out.append("|---" * 8 + "|")
    for (robot, function, name), (double, single) in run.single.items():
        cells = run.batch.get((robot, function), {})
        generated = [cells[(n, "loop")][0] for n in GENERATED if (n, "loop") in cells]
        gain = min(generated) / single if generated else None
        aim = batch_aim(run, function, robot, f"straightline_{name}")
        said = "" if aim is None or gain is None else f"{2 * aim:g} {'holds' if gain >= 2 * aim else '**missed**'}"
        out.append(f"| {FUNCTIONS[function]} | {robot} | {'AVX2' if name == 'avx2' else 'widest'} | {double:.1f} | {single:.1f} | {double / single:.2f} "
                   f"| {f'{gain:.1f}' if gain else ''} | {said} |")


def picture(run, path):
    try:
        import matplotlib
    except ImportError:
        print("peers: no matplotlib, no picture", file=sys.stderr)
        return
    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.hashsalt": "peers", "font.size": 9, "svg.fonttype": "none",
                                "font.family": "sans-serif"})
    from matplotlib import pyplot
    shown = [("Straightline", "#0b6e4f", lambda cells: "straightline"),
             ("best generated C (CasADi, CppADCodeGen)", "#e09f3e", lambda cells: best(cells, GENERATED)),
             ("Pinocchio (C++)", "#5b7db1", lambda cells: "pin"),
             ("MuJoCo", "#9a9a9a", lambda cells: "mujoco")]
    shown = [row for row in shown if any(row[2](cells) in cells for cells in run.time.values())]
    longest = 16  # longer bars are cut
    functions, robots = run.functions(), run.robots()
    figure, axes = pyplot.subplots(1, len(functions), figsize=(max(3.6 * len(functions), 8.4), 0.95 * len(robots) + 1.6), sharey=True,
                                   squeeze=False)
    for axis, function in zip(axes[0], functions):
        for i, robot in enumerate(robots):
            cells = run.time.get((robot, function), {})
            if not cells.get("straightline"):
                continue
            for k, (label, colour, name_of) in enumerate(shown):
                name = name_of(cells)
                if name is None or not cells.get(name):
                    continue
                ratio = cells[name][1] / cells["straightline"][1]
                y = i + (k - 1.5) * 0.21
                axis.barh(y, min(ratio, longest), height=0.19, color=colour)
                said = f"{cells[name][0]:.0f} ns" + ("" if k == 0 else f"  ×{ratio:.1f}")
                axis.text(min(ratio, longest) + 0.1, y, said + (" →" if ratio > longest else ""), va="center", fontsize=7)
        axis.set_title(FUNCTIONS[function], fontsize=10)
        axis.axvline(1, color="#0b6e4f", linewidth=0.8, linestyle=":")
        axis.set_xlim(0, 1.3 * longest)
        axis.set_xlabel("time per call, Straightline = 1 (shorter is better)")
        axis.spines[["top", "right"]].set_visible(False)
    axes[0][0].set_yticks(range(len(robots)), robots)
    axes[0][0].invert_yaxis()
    handles = [pyplot.Rectangle((0, 0), 1, 1, color=colour) for _, colour, _ in shown]
    figure.legend(handles, [label for label, _, _ in shown], loc="upper center", ncol=len(shown), frameon=False)
    figure.tight_layout(rect=(0, 0, 1, 0.94))
    figure.savefig(path, metadata={"Date": None})


def main():
    work, record = sys.argv[1:3]
    run = Run(work)
    here = os.path.dirname(os.path.abspath(__file__))
    commit = subprocess.run(["git", "-C", here, "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout.strip()
    rustc = subprocess.run(["rustc", "--version"], capture_output=True, text=True).stdout.strip()
    name = os.path.basename(record)
    derived = any(function in DERIVATIVES for function in run.functions())
    subject = [""] if not derived else [
        "", "Derivatives of inverse dynamics are ∂τ/∂q and ∂τ/∂q̇; Straightline and Pinocchio make H with them, generated C does not. Those of forward "
        "dynamics are ∂q̈/∂q, ∂q̈/∂q̇ and H⁻¹, by all. Of batches H and H⁻¹ are made, too; what generated C keeps by structure is not scattered.", ""]
    out = ["# Derivatives beside other systems" if derived else "# Beside other systems", "",
           f"`generated_tests/peers/run --harness DIR{' --derivatives' if derived else ''}` at {commit}; {run.machine.get('cpu', '')}, {run.machine.get('clock_ghz', '?')} GHz while measuring; "
           f"{rustc}; generated C by {run.machine.get('gcc', 'gcc')}, Pinocchio by {run.machine.get('pincxx', 'clang')}.", "",
           "One process, one pinned core, 4096 states, another one at each call; thread CPU time, medians over rounds, each contender measured "
           "back to back with Pinocchio. Every output of every contender is compared with Pinocchio's before it is timed: the last column, relative to the "
           "largest entry. `straightline` is built with `-C target-cpu=native`, `straightline_portable` without; neither fuses a*b + c, and both give the same bits. "
           f"`straightline_fma` is compiled with `--fma`. Load averages of the machine (two cores) at the end: {run.load or 'not known'}.",
           *subject, f"![time per call]({name}.svg)"]
    comparisons(out, run.time, "Calls that may overlap", aims)
    comparisons(out, run.latency, "Latency: each call waits for the last",
                lambda function, robot: (LATENCY_AIM if function == "id" and kind(robot) == "arm" else None, None))
    batches(out, run)
    all_contenders(out, run.time, "All contenders, ns per call")
    with open(record + ".md", "w") as file:
        file.write("\n".join(out) + "\n")
    picture(run, record + ".svg")


main()
