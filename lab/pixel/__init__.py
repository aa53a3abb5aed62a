"""Why a pixel looks as it does: its lights, its picks, what they are expected to be, and who answers for the error.

    frame = lab.render(scene, engine=engine)
    probe_pixel(engine, frame, x, y)     every grid light that lights the pixel, its picks and shadows
    sample_pixel(engine, frame, x, y)    its picks drawn some thousand times more, against their probabilities
    exact_shadow(engine, frame, x, y)    what its shadow estimator expects, from every ray
    account(engine, frame, x, y)         which grid lights answer for the difference to the sum over all lights
    pixel_of_point(gbuffer, point)       which pixel shows a point
    member_shares(hierarchy, index)      the input lights that a grid light is made of

``lab.probe(scene, params, x, y)`` renders a frame first.
"""

from lab.pixel.accounting import Account, account
from lab.pixel.exact import ExactShadow, exact_shadow
from lab.pixel.finding import pixel_of_point
from lab.pixel.members import member_shares
from lab.pixel.probing import probe, probe_pixel
from lab.pixel.records import PixelShadow, PixelValues, Probe, ProbedLights, ProbedPicks
from lab.pixel.samples import PickTrials, sample_pixel

__all__ = [
    "Account",
    "ExactShadow",
    "PickTrials",
    "PixelShadow",
    "PixelValues",
    "Probe",
    "ProbedLights",
    "ProbedPicks",
    "account",
    "exact_shadow",
    "member_shares",
    "pixel_of_point",
    "probe",
    "probe_pixel",
    "sample_pixel",
]
