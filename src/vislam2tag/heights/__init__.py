"""Height and floor of every frame (docs/explanation/heights.md).

The ``vertical`` axis is made continuous, with the ``rides`` that the tracker did not see; ``estimate`` ties it to the
building by all that is measured (``differences``); ``floors`` follow without flicker.
"""
