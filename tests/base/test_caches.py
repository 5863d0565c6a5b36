"""Results that are forgotten with the objects for which they were computed."""

import gc
import weakref

from cachetools import Cache

from vigil.assets import making
from vigil.assets.kernel.asset import Asset
from vigil.base.caches import cached_while_alive
from vigil.base.geometry import Vec3
from vigil.scene.geometry import part_boxes


class Key:
    pass


def test_a_result_lives_as_long_as_its_key():
    calls: list[tuple[object, ...]] = []

    @cached_while_alive
    def count(_key: Key, *others: object) -> int:
        calls.append(others)
        return len(calls)

    first, second = Key(), Key()
    assert [count(first), count(first), count(first, 1), count(second), count(first, 1)] == [1, 1, 2, 3, 2]
    assert calls == [(), (1,), ()]


def test_assets_that_fall_out_of_the_cache_are_freed(monkeypatch):
    made = making._make_cached
    assert isinstance(made.cache, Cache)
    made.cache_clear()
    monkeypatch.setattr(made.cache, "_Cache__maxsize", 50_000)
    mugs = [using_part_boxes_of(making.make("Mug", Vec3(0.1, 0.1, 0.1), number)) for number in range(40)]
    assert 0 < made.cache.currsize <= 50_000
    assert len(made.cache) < 40
    gc.collect()
    assert sum(mug() is not None for mug in mugs) == len(made.cache)


def using_part_boxes_of(asset: Asset) -> weakref.ref[Asset]:
    part_boxes(asset)
    return weakref.ref(asset)
