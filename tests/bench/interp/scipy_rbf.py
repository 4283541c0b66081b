"""CPU time of scipy's RBFInterpolator (global cubic, and 24 neighbours) for 1000 nodes and 100 000 points against the kernel map, same
run."""
import subprocess
import sys
import time

try:
    import numpy
    from scipy.interpolate import RBFInterpolator
except ImportError as missing:
    sys.exit(
        f"{missing}: this Python has no numpy and scipy. Install python3-numpy and python3-scipy and run /usr/bin/python3 "
        + " ".join(sys.argv)
    )

nodes, points, ours = subprocess.run([sys.argv[1], "--evaluate"], capture_output=True, text=True, check=True).stdout.split()
rng = numpy.random.default_rng(1)


def torus(n):
    a, b = rng.uniform(0, 2 * numpy.pi, (2, n))
    r = 1 + 0.35 * numpy.cos(b)
    return numpy.stack([r * numpy.cos(a), r * numpy.sin(a), 0.35 * numpy.sin(b)], axis=1)


centres, targets = torus(int(nodes)), torus(int(points))
print("evaluation of %s nodes at %s vertices, CPU" % (nodes, points))
print("  flexframe kernel map            %10.2f ms" % (1e3 * float(ours)))
for name, neighbours in (("global cubic", None), ("24 neighbours, cubic", 24)):
    interpolant = RBFInterpolator(centres, 0.01 * centres, kernel="cubic", degree=1, neighbors=neighbours)
    start = time.process_time()
    interpolant(targets)
    spent = time.process_time() - start
    print("  scipy RBFInterpolator, %-20s %10.0f ms, %.0f times as much" % (name, 1e3 * spent, spent / float(ours)))
