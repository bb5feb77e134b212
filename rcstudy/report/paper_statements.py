"""The paper's statements about its results, sections 3.1 to 4 in order, and how each is judged.

Quotes are from Tribology Letters 69:139 (2021), with line breaks and hyphenation undone; square brackets
hold what is left out or added here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain

from rcstudy.report import measures
from rcstudy.report.judge import (
    ALMOST_SYMMETRIC,
    BEHIND,
    MUCH,
    REPRESENTATIVE,
    SIGNIFICANT,
    SIMILAR,
    SMALL,
    Cases,
    area,
    at_least,
    at_most,
    bare_to,
    between_creepages,
    between_kinds,
    grows,
    largest_traction,
    lower,
    much_larger,
    much_smaller,
    papers_mesh,
    peak,
    radius,
    representative,
    shrinks,
    similar_patterns,
    spreads,
    thicker,
    top_of_trailing_end,
    upper,
)
from rcstudy.report.paper import (
    LATERAL,
    MAPS,
    SPIN,
    Pair,
    PaperCase,
    along_creepage,
    same_creepage,
    same_layers,
    select,
    with_more_spin,
)
from rcstudy.report.statements import Statement

OF_SYMMETRY, OF_SPIN = "compliant, lateral creepage without spin", "compliant, with spin"
ODD_PART = "odd part of the traction's magnitude, ||q(x,y)| - |q(x,-y)|| / (2 |q|) in L2 norms"
VECTORS = "By the vector, whose y component changes sign in a mirror image"
TRAILING = (
    f"share of slip cells that lie behind all stick cells of their row above {BEHIND:g} (rows with stick cells); "
    f"{OF_SYMMETRY}"
)
TOP = f"centroid of the slip cells at x < 0 and y > 0, {OF_SPIN}; numbers: its y over the contact radius"
SPIN_NOTE = (
    "By Eq. 5 as printed the rigid slip in x is xi_x - phi y: for phi > 0 spin adds to it at y < 0. The paper's text "
    "has the sign of phi reversed, or its y-axis, which reverses xi_y, too."
)
ON_AXIS = "By slip cells on the x-axis, which the figure shows"
AT_THE_BOUND = (
    "Where the contact's centre slips, the largest traction is that of the bound, mu times the peak pressure."
)


def symmetric_creepage(cases: Cases, figure: int) -> list[PaperCase]:
    """Compliant cases of a figure with lateral creepage and no spin (the paper's panels a and b)."""
    return select(cases, [figure], "compliant", lateral=True, spin=False)


def with_spin(cases: Cases, figure: int) -> list[PaperCase]:
    """Compliant cases of a figure with spin (the paper's panels c to f)."""
    return select(cases, [figure], "compliant", spin=True)


def more_lateral(cases: Cases, figures: Iterable[int], kind: str = "") -> Iterator[Pair]:
    """Pairs of cases without spin that differ in lateral creepage (the paper's a to b, and g to h)."""
    return along_creepage(select(cases, figures, kind, lateral=True, spin=False), LATERAL)


def more_spin(cases: Cases) -> Iterator[Pair]:
    """Pairs of compliant cases of Figure 7 that differ in spin (the paper's a to e, a to f, e to f, c to d)."""
    return with_more_spin(select(cases, [7], "compliant"))


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
        "for the numerical solutions presented here, a 64 × 64 mesh was considered to yield representative results",
        f"estimated error of the tangential force over its value below {REPRESENTATIVE:g}; cells of 2/64 mm, Figs 4 to "
        "10",
        lambda c: representative(papers_mesh(c), measures.tangential_force),
        instead=lambda c: representative(papers_mesh(c), measures.slip_ratio),
        instead_of="By slip area / contact area",
    ),
    Statement(
        "3.1",
        "the running time for each case is normally less than 6 s",
        "",
        untestable="a matter of the paper's program and computer",
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
        instead=lambda c: grows(thicker(c, [5], "compliant"), measures.slip_on_axis),
        instead_of=ON_AXIS,
    ),
    Statement(
        "3.2",
        "the ratio of slip zones is decreasing with increasing layer thickness for the stiff layer conditions as "
        "shown from Fig. 5d to 5f",
        "slip area / contact area shrinks with thickness, Fig. 5d-f",
        lambda c: shrinks(thicker(c, [5], "stiff"), measures.slip_ratio),
        instead=lambda c: shrinks(thicker(c, [5], "stiff"), measures.slip_on_axis),
        instead_of=ON_AXIS,
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
        instead=lambda c: grows(thicker(c, [6], "compliant"), measures.slip_on_axis),
        instead_of=ON_AXIS,
    ),
    Statement(
        "3.2",
        "for the hard ones, more slip zones can be found for thinner layers",
        "slip area / contact area shrinks with thickness, Fig. 6d-f",
        lambda c: shrinks(thicker(c, [6], "stiff"), measures.slip_ratio),
        instead=lambda c: shrinks(thicker(c, [6], "stiff"), measures.slip_on_axis),
        instead_of=ON_AXIS,
    ),
    Statement(
        "3.2",
        "the longitudinal creepage is a significant factor to determine the traction distribution and the stick/slip "
        "zones",
        f"smallest below {1 - SIGNIFICANT:g} of the largest over the creepages of each panel of Figs 5 and 6: "
        "tangential force (N), slip area / contact area",
        lambda c: chain(
            spreads(same_layers(select(c, [5, 6])), measures.tangential_force),
            spreads(same_layers(select(c, [5, 6])), measures.slip_ratio),
        ),
    ),
    Statement(
        "3.2",
        "These derived behaviors agree well with the conclusions proposed by Guler et al. [13, 15]",
        "",
        untestable="needs Guler's data",
    ),
    Statement(
        "3.3",
        "The traction results are almost symmetric with respect to the x-axis [7a, 7b]",
        f"{ODD_PART}, below {ALMOST_SYMMETRIC:g}; {OF_SYMMETRY}",
        lambda c: at_most(symmetric_creepage(c, 7), measures.asymmetry, ALMOST_SYMMETRIC),
        instead=lambda c: at_most(symmetric_creepage(c, 7), measures.vector_asymmetry, ALMOST_SYMMETRIC),
        instead_of=VECTORS,
        note="The text has Fig. 6a and 6b for 7a and 7b.",
    ),
    Statement(
        "3.3",
        "the slip zones are located at the trailing edges [7a, 7b]",
        TRAILING,
        lambda c: at_least(symmetric_creepage(c, 7), measures.slip_behind_stick, BEHIND),
    ),
    Statement(
        "3.3",
        "For larger lateral creepage, the slip zones become larger. [7a, 7b]",
        "slip area / contact area grows with lateral creepage, no spin, compliant, Fig. 7",
        lambda c: grows(more_lateral(c, [7], "compliant"), measures.slip_ratio),
        instead=lambda c: grows(more_lateral(c, MAPS), measures.slip_ratio),
        instead_of="In Figs 7 to 10, compliant and stiff",
    ),
    Statement(
        "3.3",
        "Due to the involving spin creepage, the symmetrical behavior of the traction distribution is ruined. [7c to "
        "7f]",
        f"{ODD_PART}, above {ALMOST_SYMMETRIC:g}; {OF_SPIN}",
        lambda c: at_least(with_spin(c, 7), measures.asymmetry, ALMOST_SYMMETRIC),
        instead=lambda c: at_least(with_spin(c, 7), measures.vector_asymmetry, ALMOST_SYMMETRIC),
        instead_of=VECTORS,
    ),
    Statement(
        "3.3",
        "By comparing with the results of Fig. 7c with 7d, more stick zones can be found for smaller spin creepage "
        "condition [...]. Similar behavior can also be found in Fig. 7e and 7f.",
        "slip area / contact area grows with spin (not from none), compliant, Fig. 7",
        lambda c: grows(along_creepage(with_spin(c, 7), SPIN), measures.slip_ratio),
    ),
    Statement(
        "3.3",
        "the slip zones are located at the top part of the trailing end [7c to 7f]",
        TOP,
        lambda c: top_of_trailing_end(with_spin(c, 7), upwards=True),
        instead=lambda c: top_of_trailing_end(with_spin(c, 7), upwards=False),
        instead_of="At y < 0 instead",
        note=SPIN_NOTE,
    ),
    Statement(
        "3.3",
        "at the area of x < 0 and y > 0, the spin creepage can enhance the traction and therefore to make more grids "
        "to reach the corresponding traction limits",
        "slip cells / contact cells at x < 0, y > 0 grow with spin, all else equal, compliant, Fig. 7",
        lambda c: grows(more_spin(c), upper),
        instead=lambda c: grows(more_spin(c), lower),
        instead_of="At x < 0, y < 0 instead",
        note=SPIN_NOTE,
    ),
    Statement(
        "3.3",
        "in the area of x < 0 and y < 0, the effects of the longitudinal and the lateral creepages on the traction "
        "are neutralized partly by the spin creepage, and some original slip zones are taken over by stick domain",
        "slip cells / contact cells at x < 0, y < 0 shrink with spin, all else equal, compliant, Fig. 7",
        lambda c: shrinks(more_spin(c), lower),
        instead=lambda c: shrinks(more_spin(c), upper),
        instead_of="At x < 0, y > 0 instead",
        note=SPIN_NOTE,
    ),
    Statement(
        "3.3",
        "By comparing the results [7g to 7l] with the ones as provided in Fig. 7a to 7f, similar patterns for each "
        "case can be found",
        f"angle between the directions of slip's centroid from the contact's centre below {SIMILAR:g} degrees, "
        "compliant and stiff, the same creepages",
        lambda c: similar_patterns(between_kinds(c, [7])),
        instead=lambda c: similar_patterns(between_creepages(c, [7])),
        instead_of="Between different creepages",
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
        note=AT_THE_BOUND,
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
        note=AT_THE_BOUND,
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
        lambda c: at_least(symmetric_creepage(c, 9), measures.slip_behind_stick, BEHIND),
    ),
    Statement(
        "3.3",
        "[the slip zones] show symmetrical behaviors [9a, 9b]",
        f"share of slip cells whose mirror image is none below {ALMOST_SYMMETRIC:g}; {OF_SYMMETRY}",
        lambda c: at_most(symmetric_creepage(c, 9), measures.slip_asymmetry, ALMOST_SYMMETRIC),
    ),
    Statement(
        "3.3",
        "the slip zones are relatively small [9a, 9b]",
        f"slip area / contact area below {SMALL:g}; {OF_SYMMETRY}",
        lambda c: at_most(symmetric_creepage(c, 9), measures.slip_ratio, SMALL),
    ),
    Statement(
        "3.3",
        "For the cases with spin creepage, the slip zones prefer to locate at the top part of the trailing edge. [9c "
        "to 9f]",
        TOP,
        lambda c: top_of_trailing_end(with_spin(c, 9), upwards=True),
        instead=lambda c: top_of_trailing_end(with_spin(c, 9), upwards=False),
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
        "this behavior can also be seen in the corresponding results of Figs. 8 and 9 [stiff layers]",
        "slip area / contact area shrinks with thickness, Fig. 7g-l to 8g-l",
        lambda c: shrinks(thicker(c, [7, 8], "stiff"), measures.slip_ratio),
        note="Figs 8 and 9 differ in more than thickness; taken to mean Figs 7 and 8.",
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
        f"smallest tangential force (N) below {1 - SIGNIFICANT:g} of the largest over Figs 7 to 10, for each creepage "
        "set",
        lambda c: spreads(same_creepage(select(c, MAPS)), measures.tangential_force),
        instead=lambda c: spreads(same_creepage(select(c, MAPS)), measures.slip_ratio),
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
