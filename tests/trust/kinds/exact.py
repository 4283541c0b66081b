"""Asked accuracies of contacts, readings, controllers and couplings, against their exact truths."""
import dataclasses

import kinds.coupled
import kinds.read
import kinds.touch
from scene import pick

ASKED = (
    kinds.touch.dropped_ball,
    kinds.touch.landing_box,
    kinds.touch.row_of_balls,
    kinds.touch.cam,
    kinds.read.bang_bang,
    kinds.read.relaxation,
    kinds.read.gas_force,
    kinds.read.controlled,
    kinds.read.narrow_bump,
    kinds.coupled.geared_wheels,
    kinds.coupled.planetary,
    kinds.coupled.shaped_pendulum,
)


def asked_exactly(r):
    """Contacts, readings, controllers and couplings that ask for an accuracy"""
    kind, accuracy = pick(r, *ASKED), 10.0 ** -r.randint(1, 5)
    scene = kind(r)
    if scene is None:
        return None
    # Truths that are followed in small steps have four digits.
    accuracy = max(accuracy, 1e-2) if kind is kinds.coupled.geared_wheels else accuracy
    what = f"{kind.__name__}: {scene.what}; accuracy {accuracy:g}"
    return dataclasses.replace(scene, words=("--accuracy", repr(accuracy)), claim=accuracy, what=what)


KINDS = [asked_exactly]
