"""Results of another program for flexframe render: writes @NAME@.h5, whose layout is in sim/RESULTS.md.

    python3 @NAME@.py && flexframe render @NAME@.h5 -o @NAME@

A bar that turns about z, and a ball that flies; put your own positions in their place. Needs numpy and h5py.
"""
import h5py
import numpy

times = numpy.linspace(0, 2, 101)  # s
angle = 2 * times

# The format with checksums, and texts of fixed length: the reader asks for both.
with h5py.File("@NAME@.h5", "w", libver="v110") as file:
    file.attrs["format"] = numpy.bytes_("flexframe results")
    file.attrs["format_version"] = 1
    file.attrs["title"] = numpy.bytes_("@NAME@")
    file["times"] = times

    def body(index, name, position, orientation):
        """position: nt x 3, m; orientation: nt x 4, quaternion w x y z from body axes to the world's."""
        group = file.create_group(f"bodies/{name}")
        group.attrs["kind"] = numpy.bytes_("rigid")
        group.attrs["index"] = index
        group["position"] = position
        group["orientation"] = orientation

    zero, one = numpy.zeros_like(times), numpy.ones_like(times)
    body(0, "bar", numpy.stack([zero, zero, zero], 1), numpy.stack([numpy.cos(angle / 2), zero, zero, numpy.sin(angle / 2)], 1))
    body(1, "ball", numpy.stack([times, 2 * times - times**2, zero], 1), numpy.stack([one, zero, zero, zero], 1))

    # Columns to plot: overlay = { plot = ["angle"] } in a scene given with --scene.
    outputs = file.create_group("outputs")
    outputs["columns"] = numpy.array([b"angle"])
    outputs["units"] = numpy.array([b"rad"])
    outputs["values"] = angle[:, None]
