"""Batches in f32 beside batches in f64: single.py FOLDER STATES FUNCTION,FUNCTION ROBOT...

Each robot's two libraries take turns in one process; a line per robot, function and instructions (`fma`: the
machine's widest, `avx2`): nanoseconds of the thread's time per state in f64 and
in f32, medians of the turns."""
import ctypes, os, statistics, sys, time

folder, states, asked = sys.argv[1], int(sys.argv[2]), sys.argv[3].split(",")
if "id_deriv" in asked or "fd_deriv" in asked:
    functions, states = ("id_deriv", "fd_deriv"), max(states // 10, 1)
else:
    functions = ("id", "aba")
for robot in sys.argv[4:]:
    for double, single in (("fma", "single"), ("avx2", "single_avx2")):
        paths = [os.path.join(folder, f"{robot}.{name}.so") for name in (double, single)]
        if not all(os.path.exists(path) for path in paths):
            continue
        subjects = []
        for library in map(ctypes.CDLL, paths):
            library.batch_of.restype, library.batch_of.argtypes = ctypes.c_void_p, (ctypes.c_long,)
            library.batch_run.restype, library.batch_run.argtypes = ctypes.c_double, (ctypes.c_void_p, ctypes.c_int)
            subjects.append((library.batch_run, library.batch_of(states)))

        def nanoseconds(run, batch, function):
            start = time.thread_time_ns()
            run(batch, function)
            return (time.thread_time_ns() - start) / states

        for number, function in enumerate(functions):
            turns = [[nanoseconds(run, batch, number) for run, batch in subjects] for _ in range(31)]
            print(robot, function, double, *(f"{statistics.median(turn):.2f}" for turn in zip(*turns[1:])), sep="\t")
