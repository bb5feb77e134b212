"""The paper's statements about its results, sections 3.1 to 4 in order, and how each is judged.

Quotes are from Tribology Letters 69:139 (2021), with line breaks and hyphenation undone; square brackets
hold what is left out or added here.
"""

from __future__ import annotations

from itertools import chain

from rcstudy.report import measures
from rcstudy.report.judge import (
    ALMOST_SYMMETRIC,
    BEHIND,
    MUCH,
    SIGNIFICANT,
    SIMILAR,
    SMALL,
    area,
    at_least,
    at_most,
    bare_to,
    between_kinds,
    grows,
    largest_traction,
    lower,
    much_larger,
    much_smaller,
    panels,
    peak,
    radius,
    shrinks,
    similar_patterns,
    spreads,
    thicker,
    top_of_trailing_end,
    upper,
)
from rcstudy.report.paper import MAPS, along_creepage, select
from rcstudy.report.statements import Statement

SYMMETRY = f"odd part of the traction, |q(x,y) - q(x,-y)| / (2 |q|) in L2 norms, below {ALMOST_SYMMETRIC:g}"
TRAILING = f"share of slip cells that lie behind all stick cells of their row above {BEHIND:g} (rows with stick cells)"
SPIN_NOTE = (
    "By Eq. 5 as printed the rigid slip in x is xi_x - phi y: for phi > 0 spin adds to it at y < 0, so the sign of "
    "phi, or the direction of y, differs between the paper's equation and its text."
)


STATEMENTS = (
    Statement(
        "3.1",
        "The present results for a single layer with a thickness of a and the results of two layers, both with a "
        "thickness of 0.5a, are in good agreement with the results in Yu's work [28].",
        "",
        untestable="needs Yu's data",
    ),
    Statement(
        "3.1",
        "for layered conditions, the contact radius is increasing with the decreasing elastic modulus of layers",
        "contact radius (mm), Fig. 3: stiff to no layer, no layer to compliant",
        lambda c: chain(shrinks(bare_to(c, "stiff"), radius), grows(bare_to(c, "compliant"), radius)),
    ),
    Statement(
        "3.1",
        "For compliant layers [...] the thicker the layer thickness, the larger the contact radius.",
        "contact radius (mm) grows with thickness, Fig. 3",
        lambda c: grows(thicker(c, [3], "compliant"), radius),
    ),
    Statement(
        "3.1",
        "Due to the larger contact area for compliant layer conditions, the maximum contact pressure results are much "
        "smaller by comparing with the hard one or no layer conditions.",
        f"peak pressure (MPa) of compliant below {MUCH:g} of no layer's and of the stiff one's, Fig. 3",
        lambda c: chain(
            much_smaller(bare_to(c, "compliant"), peak),
            much_smaller(((s, k) for k, s in between_kinds(c, [3])), peak),
        ),
    ),
    Statement(
        "3.1",
        "for stiff layers, i.e. larger layer elastic modulus, the contact radius is decreasing with increasing layer "
        "thickness",
        "contact radius (mm) shrinks with thickness, Fig. 3",
        lambda c: shrinks(thicker(c, [3], "stiff"), radius),
    ),
    Statement(
        "3.1",
        "the present results for all conditions agree well with the ones obtained with the LCP method",
        "",
        untestable="needs the results of the LCP method",
    ),
    Statement(
        "3.2",
        "From Fig. 5a to 5c, [...] for the compliant layer conditions the ratio of slip zones to the whole contact "
        "zones is increasing with increasing layer thickness",
        "slip area / contact area grows with thickness, Fig. 5a-c",
        lambda c: grows(thicker(c, [5], "compliant"), measures.slip_ratio),
    ),
    Statement(
        "3.2",
        "the ratio of slip zones is decreasing with increasing layer thickness for the stiff layer conditions as "
        "shown from Fig. 5d to 5f",
        "slip area / contact area shrinks with thickness, Fig. 5d-f",
        lambda c: shrinks(thicker(c, [5], "stiff"), measures.slip_ratio),
    ),
    Statement(
        "3.2",
        "the slip zones are more predominated for hard ones with the same longitudinal creepage conditions",
        "slip area / contact area, compliant to stiff, Fig. 5",
        lambda c: grows(between_kinds(c, [5]), measures.slip_ratio),
    ),
    Statement(
        "3.2",
        "larger slip zone ratios can also be found for the results of two hard layers, and smaller ones for the "
        "results of two compliant layers",
        "slip area / contact area, compliant to stiff, Fig. 6",
        lambda c: grows(between_kinds(c, [6]), measures.slip_ratio),
    ),
    Statement(
        "3.2",
        "for the compliant layer conditions, slip zones also show more aggressive behavior for thick layers",
        "slip area / contact area grows with thickness, Fig. 6a-c",
        lambda c: grows(thicker(c, [6], "compliant"), measures.slip_ratio),
    ),
    Statement(
        "3.2",
        "for the hard ones, more slip zones can be found for thinner layers",
        "slip area / contact area shrinks with thickness, Fig. 6d-f",
        lambda c: shrinks(thicker(c, [6], "stiff"), measures.slip_ratio),
    ),
    Statement(
        "3.2",
        "the longitudinal creepage is a significant factor to determine the traction distribution and the stick/slip "
        "zones",
        "slip area / contact area grows with longitudinal creepage, Figs 5 and 6",
        lambda c: grows(along_creepage(select(c, [5, 6])), measures.slip_ratio),
    ),
    Statement(
        "3.3",
        "The traction results are almost symmetric with respect to the x-axis [7a, 7b]",
        SYMMETRY,
        lambda c: at_most(select(c, [7], panels="ab"), measures.asymmetry, ALMOST_SYMMETRIC),
        note="The text has Fig. 6a and 6b for 7a and 7b.",
    ),
    Statement(
        "3.3",
        "the slip zones are located at the trailing edges [7a, 7b]",
        TRAILING,
        lambda c: at_least(select(c, [7], panels="ab"), measures.slip_behind_stick, BEHIND),
    ),
    Statement(
        "3.3",
        "For larger lateral creepage, the slip zones become larger. [7a, 7b]",
        "slip area / contact area, 7a to 7b",
        lambda c: grows(panels(c, ["ab"], [7]), measures.slip_ratio),
        instead=lambda c: grows(panels(c, ["ab", "gh"], MAPS), measures.slip_ratio),
        instead_of="In Figs 7 to 10 (a to b, g to h)",
    ),
    Statement(
        "3.3",
        "Due to the involving spin creepage, the symmetrical behavior of the traction distribution is ruined. [7c to "
        "7f]",
        SYMMETRY.replace("below", "above"),
        lambda c: at_least(select(c, [7], panels="cdef"), measures.asymmetry, ALMOST_SYMMETRIC),
    ),
    Statement(
        "3.3",
        "By comparing with the results of Fig. 7c with 7d, more stick zones can be found for smaller spin creepage "
        "condition [...]. Similar behavior can also be found in Fig. 7e and 7f.",
        "slip area / contact area grows with spin, 7c to 7d and 7e to 7f",
        lambda c: grows(panels(c, ["cd", "ef"], [7]), measures.slip_ratio),
    ),
    Statement(
        "3.3",
        "the slip zones are located at the top part of the trailing end [7c to 7f]",
        "centroid of the slip cells at x < 0 and y > 0; numbers: its y over the contact radius",
        lambda c: top_of_trailing_end(select(c, [7], panels="cdef"), upwards=True),
        instead=lambda c: top_of_trailing_end(select(c, [7], panels="cdef"), upwards=False),
        instead_of="At y < 0 instead",
        note=SPIN_NOTE,
    ),
    Statement(
        "3.3",
        "at the area of x < 0 and y > 0, the spin creepage can enhance the traction and therefore to make more grids "
        "to reach the corresponding traction limits",
        "slip cells / contact cells at x < 0, y > 0 grow with spin: 7a to 7e, 7a to 7f, 7c to 7d, 7e to 7f",
        lambda c: grows(panels(c, ["ae", "af", "cd", "ef"], [7]), upper),
        instead=lambda c: grows(panels(c, ["ae", "af", "cd", "ef"], [7]), lower),
        instead_of="At x < 0, y < 0 instead",
        note=SPIN_NOTE,
    ),
    Statement(
        "3.3",
        "in the area of x < 0 and y < 0, the effects of the longitudinal and the lateral creepages on the traction "
        "are neutralized partly by the spin creepage, and some original slip zones are taken over by stick domain",
        "slip cells / contact cells at x < 0, y < 0 shrink with spin: the same pairs",
        lambda c: shrinks(panels(c, ["ae", "af", "cd", "ef"], [7]), lower),
        instead=lambda c: shrinks(panels(c, ["ae", "af", "cd", "ef"], [7]), upper),
        instead_of="At x < 0, y > 0 instead",
        note=SPIN_NOTE,
    ),
    Statement(
        "3.3",
        "By comparing the results [7g to 7l] with the ones as provided in Fig. 7a to 7f, similar patterns for each "
        "case can be found",
        f"angle between the directions of slip's centroid from the contact's centre below {SIMILAR:g} degrees",
        similar_patterns,
    ),
    Statement(
        "3.3",
        "the contact areas are significantly smaller than the ones with a compliant layer [7g to 7l against 7a to 7f]",
        f"contact area (mm2), compliant to stiff, Fig. 7: below {MUCH:g} of it",
        lambda c: much_smaller(between_kinds(c, [7]), area),
    ),
    Statement(
        "3.3",
        "for the same creepage conditions the slip zones account for larger ratio within the contact area [7g to 7l]",
        "slip area / contact area, compliant to stiff, Fig. 7",
        lambda c: grows(between_kinds(c, [7]), measures.slip_ratio),
    ),
    Statement(
        "3.3",
        "for the compliant layer larger traction results can be obtained with thinner layer under same creepage "
        "conditions",
        "largest traction (MPa) shrinks with thickness, Fig. 7a-f to 8a-f",
        lambda c: shrinks(thicker(c, [7, 8], "compliant"), largest_traction),
        instead=lambda c: shrinks(thicker(c, [7, 8], "compliant"), measures.tangential_force),
        instead_of="By the tangential force",
    ),
    Statement(
        "3.3",
        "the slip portions are increasing for thicker compliant layer conditions",
        "slip area / contact area grows with thickness, Fig. 7a-f to 8a-f",
        lambda c: grows(thicker(c, [7, 8], "compliant"), measures.slip_ratio),
    ),
    Statement(
        "3.3",
        "the opposite behaviors can be found from the results as given by Fig. 8g to 8l and Fig. 7g to 7l for stiff "
        "layer conditions [traction]",
        "largest traction (MPa) grows with thickness, Fig. 7g-l to 8g-l",
        lambda c: grows(thicker(c, [7, 8], "stiff"), largest_traction),
        instead=lambda c: grows(thicker(c, [7, 8], "stiff"), measures.tangential_force),
        instead_of="By the tangential force",
    ),
    Statement(
        "3.3",
        "the opposite behaviors can be found from the results as given by Fig. 8g to 8l and Fig. 7g to 7l for stiff "
        "layer conditions [slip]",
        "slip area / contact area shrinks with thickness, Fig. 7g-l to 8g-l",
        lambda c: shrinks(thicker(c, [7, 8], "stiff"), measures.slip_ratio),
    ),
    Statement(
        "3.3",
        "for the conditions with both longitudinal and lateral creepages, the slip zones are located at the trailing "
        "edge [two compliant layers, 9a, 9b]",
        TRAILING,
        lambda c: at_least(select(c, [9], panels="ab"), measures.slip_behind_stick, BEHIND),
    ),
    Statement(
        "3.3",
        "[the slip zones] show symmetrical behaviors [9a, 9b]",
        SYMMETRY,
        lambda c: at_most(select(c, [9], panels="ab"), measures.asymmetry, ALMOST_SYMMETRIC),
    ),
    Statement(
        "3.3",
        "the slip zones are relatively small [9a, 9b]",
        f"slip area / contact area below {SMALL:g}",
        lambda c: at_most(select(c, [9], panels="ab"), measures.slip_ratio, SMALL),
    ),
    Statement(
        "3.3",
        "For the cases with spin creepage, the slip zones prefer to locate at the top part of the trailing edge. [9c "
        "to 9f]",
        "centroid of the slip cells at x < 0 and y > 0; numbers: its y over the contact radius",
        lambda c: top_of_trailing_end(select(c, [9], panels="cdef"), upwards=True),
        instead=lambda c: top_of_trailing_end(select(c, [9], panels="cdef"), upwards=False),
        instead_of="At y < 0 instead",
        note=SPIN_NOTE,
    ),
    Statement(
        "3.3",
        "For the stiff layer conditions, the contact areas are much smaller than the ones with compliant layers [Fig. "
        "9]",
        f"contact area (mm2), compliant to stiff, Fig. 9: below {MUCH:g} of it",
        lambda c: much_smaller(between_kinds(c, [9]), area),
    ),
    Statement(
        "3.3",
        "the ratios of slip zones are significantly higher [9g to 9l against 9a to 9f]",
        f"slip area / contact area, compliant to stiff, Fig. 9: above 1/{MUCH:g} of it",
        lambda c: much_larger(between_kinds(c, [9]), measures.slip_ratio),
    ),
    Statement(
        "3.3",
        "for compliant layers, the ratios of slip zones are larger when the thicker layers are adopted [10a to 10f "
        "against 9a to 9f]",
        "slip area / contact area grows with thickness, Fig. 9a-f to 10a-f",
        lambda c: grows(thicker(c, [9, 10], "compliant"), measures.slip_ratio),
    ),
    Statement(
        "3.3",
        "for the stiff layers, smaller ratios of slip zones can be found for thicker layers",
        "slip area / contact area shrinks with thickness, Fig. 9g-l to 10g-l",
        lambda c: shrinks(thicker(c, [9, 10], "stiff"), measures.slip_ratio),
    ),
    Statement(
        "3.3",
        "for compliant coating layers, larger contact area can be achieved, and at the same time the mean contact "
        "pressure results are smaller",
        "load / contact area (MPa), no layer to compliant, Fig. 3",
        lambda c: shrinks(bare_to(c, "compliant"), measures.mean_pressure),
    ),
    Statement(
        "3.3",
        "for hard coating layers, the contact area results are smaller and larger contact pressure results can be "
        "found",
        "load / contact area (MPa), no layer to stiff, Fig. 3",
        lambda c: grows(bare_to(c, "stiff"), measures.mean_pressure),
    ),
    Statement(
        "3.3",
        "Under the same creepage combinations, for thicker compliant layers, the slip zone ratios are increasing.",
        "slip area / contact area grows with thickness, Figs 7 to 10, compliant",
        lambda c: grows(thicker(c, MAPS, "compliant"), measures.slip_ratio),
    ),
    Statement(
        "3.3",
        "The slip zone ratios are decreasing with decreasing layer thickness. [hard coating layers]",
        "slip area / contact area grows with thickness, Figs 7 to 10, stiff",
        lambda c: grows(thicker(c, MAPS, "stiff"), measures.slip_ratio),
        note="Contradicts sections 3.2 and 4 and the same section's reading of Figs 7 to 10.",
    ),
    Statement(
        "4",
        "Larger contact area [...] results can be obtained with compliant coating layers",
        "contact area (mm2), no layer to compliant, Fig. 3",
        lambda c: grows(bare_to(c, "compliant"), area),
    ),
    Statement(
        "4",
        "smaller normal pressure results can be obtained with compliant coating layers",
        "peak pressure (MPa), no layer to compliant, Fig. 3",
        lambda c: shrinks(bare_to(c, "compliant"), peak),
    ),
    Statement(
        "4",
        "smaller contact area [...] results can be achieved using hard coating layers",
        "contact area (mm2), no layer to stiff, Fig. 3",
        lambda c: shrinks(bare_to(c, "stiff"), area),
    ),
    Statement(
        "4",
        "larger normal pressure results can be achieved using hard coating layers",
        "peak pressure (MPa), no layer to stiff, Fig. 3",
        lambda c: grows(bare_to(c, "stiff"), peak),
    ),
    Statement(
        "4",
        "The traction distributions can be significantly adjusted by different coating layers with the same creepage "
        "combinations",
        f"tangential force varies over Figs 7 to 10 by more than {SIGNIFICANT:g} of the largest, for each creepage set",
        lambda c: spreads(c, measures.tangential_force),
        instead=lambda c: spreads(c, measures.slip_ratio),
        instead_of="By slip area / contact area",
    ),
    Statement(
        "4",
        "the slip zones are more predominated for hard coating layers",
        "slip area / contact area, compliant to stiff, Figs 5 to 10",
        lambda c: grows(between_kinds(c, (5, 6, *MAPS)), measures.slip_ratio),
    ),
    Statement(
        "4",
        "For compliant coating layers, the slip zone ratios are increasing with increasing layer thickness.",
        "slip area / contact area grows with thickness, Figs 5 to 10, compliant",
        lambda c: grows(thicker(c, (5, 6, *MAPS), "compliant"), measures.slip_ratio),
    ),
    Statement(
        "4",
        "For hard coating layers, the slip zone ratios are increasing with decreasing layer thickness.",
        "slip area / contact area shrinks with thickness, Figs 5 to 10, stiff",
        lambda c: shrinks(thicker(c, (5, 6, *MAPS), "stiff"), measures.slip_ratio),
    ),
)
"""All statements, in the paper's order."""
