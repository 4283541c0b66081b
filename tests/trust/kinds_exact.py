"""Asked accuracies of contacts, readings, controllers and couplings, against their exact truths."""
import dataclasses

import kinds_coupled
import kinds_read
import kinds_touch
from scene import pick

ASKED = (
    kinds_touch.dropped_ball,
    kinds_touch.landing_box,
    kinds_touch.row_of_balls,
    kinds_touch.cam,
    kinds_read.bang_bang,
    kinds_read.relaxation,
    kinds_read.gas_force,
    kinds_read.controlled,
    kinds_read.narrow_bump,
    kinds_coupled.geared_wheels,
    kinds_coupled.planetary,
    kinds_coupled.shaped_pendulum,
)


def asked_exactly(r):
    """Contacts, readings, controllers and couplings that ask for an accuracy"""
    kind, accuracy = pick(r, *ASKED), 10.0 ** -r.randint(1, 5)
    scene = kind(r)
    if scene is None:
        return None
    # Truths that are followed in small steps have four digits.
    accuracy = max(accuracy, 1e-2) if kind is kinds_coupled.geared_wheels else accuracy
    what = f"{kind.__name__}: {scene.what}; accuracy {accuracy:g}"
    return dataclasses.replace(scene, words=("--accuracy", repr(accuracy)), claim=accuracy, what=what)


KINDS = [asked_exactly]
