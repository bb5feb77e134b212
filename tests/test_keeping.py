"""What is kept of what was made: as much as the bytes allow, the last used first."""

from __future__ import annotations

import numpy as np

from rcstudy.mechanics.convolution import PLAN_BYTES, transform
from rcstudy.mechanics.numerics.keeping import keep_within


def test_the_least_used_goes_when_bytes_run_out() -> None:
    made: list[int] = []

    @keep_within(100)
    def zeros(n: int) -> np.ndarray:
        made.append(n)
        return np.zeros(n, dtype=np.uint8)

    first = zeros(40)
    zeros(50)
    assert zeros(40) is first
    zeros(30)  # 120 bytes: 50 was not asked for the longest
    assert zeros(40) is first
    zeros(50)
    assert made == [40, 50, 30, 50]
    zeros(500)  # more than there may be: kept alone
    zeros(500)
    assert made == [40, 50, 30, 50, 500]
    assert zeros(40) is not first


def test_as_many_go_as_must_and_no_more() -> None:
    made: list[int] = []

    @keep_within(100)
    def zeros(n: int) -> np.ndarray:
        made.append(n)
        return np.zeros(n, dtype=np.uint8)

    for n in (20, 30, 50, 20):  # all that there may be
        zeros(n)
    assert made == [20, 30, 50]
    for n in (80, 20, 50):  # 80 leaves room for the last one used
        zeros(n)
    assert made == [20, 30, 50, 80, 50]


def test_plans_take_no_more_than_they_may() -> None:
    """As after a sweep over large meshes; plans made again give the same bits."""
    transform.cache_clear()
    rng = np.random.default_rng(2)

    def bits(plan):
        values = rng.normal(size=plan.real.shape)
        plan.real[:] = values
        plan.forward()
        return values, plan.hat.copy()

    first = transform((64, 48), 2, 30)
    values, hat = bits(first)
    held = {}
    for k in range(40):
        plan = transform((1024, 512 + 16 * k), 1, 512)
        held[512 + 16 * k] = plan.nbytes
        assert plan.nbytes >= plan.real.nbytes + 3 * plan.hat.nbytes
    assert sum(held.values()) > PLAN_BYTES
    again = transform((64, 48), 2, 30)
    assert again is not first
    again.real[:] = values
    again.forward()
    np.testing.assert_array_equal(again.hat, hat)
    transform.cache_clear()
