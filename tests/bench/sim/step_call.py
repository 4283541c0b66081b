"""What a step call costs in Python beyond C++: step_call.py STEP_CALL SOURCE, with the module's folder in PYTHONPATH (ninja
bench_step_call).

The same steps of examples/library/cart.toml from both, in CPU time, the least of nine goes; C++ and Python in turn, the least of five
rounds.
Exit 1 where step() alone costs more than 2 us more.
"""

import pathlib
import subprocess
import sys
import time

import flexframe as ff

program, source = sys.argv[1], pathlib.Path(sys.argv[2])
scene, steps, dt = source / "examples/library/cart.toml", 2000, 1e-4


def least(sim, turns):
    start, best = sim.state(), 1e9
    for _ in range(9):
        sim.restore(start)
        begin = time.process_time()
        turns()
        best = min(best, time.process_time() - begin)
    sim.restore(start)
    return 1e6 * best / steps


def python():
    sim = ff.Simulation(ff.load(scene))

    def alone():
        step = sim.step
        for _ in range(steps):
            step(dt)

    def together():
        value = 0.0
        for _ in range(steps):
            sim.set_input("push", 1e-3 * value)
            sim.step(dt)
            value = sim.output("angle")

    return least(sim, alone), least(sim, together)


rounds = []
for _ in range(5):
    out = subprocess.run([program, scene, "push", "angle", str(steps), str(dt)], capture_output=True, text=True, check=True).stdout
    rounds.append((*map(float, out.split()), *python()))
cpp_step, cpp_all, py_step, py_all = map(min, zip(*rounds))
print(f"step(): C++ {cpp_step:.2f} us, Python {py_step:.2f} us, {py_step - cpp_step:.2f} us more")
print(f"set_input(), step(), output(): C++ {cpp_all:.2f} us, Python {py_all:.2f} us, {py_all - cpp_all:.2f} us more")
sys.exit(0 if py_step - cpp_step <= 2.0 else 1)
