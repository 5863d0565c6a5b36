"""Results that are forgotten with the objects for which they were computed."""

import gc

from cachetools import Cache

from vigil.assets import making
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
    for number in range(40):
        part_boxes(making.make("Mug", Vec3(0.1, 0.1, 0.1), number))
    assert 0 < made.cache.currsize <= 50_000
    assert len(made.cache) < 40
    gc.collect()
    alive = [each for each in gc.get_objects() if type(each).__name__ == "Asset" and each.category == "Mug"]
    assert len(alive) <= len(made.cache) + 1
